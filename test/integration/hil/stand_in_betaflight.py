"""Stands in for Betaflight's simulator program: its command line, its ports and packets, and angle mode of a few lines.

stand_in_betaflight.py MODE [--config FILE]: MODE flies, or fails as it says: refuses, writes_nothing, ends_at_start, ends_in_flight,
silent, or stops answering in the middle (stops). Packets: 18 doubles of state on UDP 9003, a double and 16 unsigned shorts of channels on 9004, four floats back to 9002.
"""
import math
import socket
import struct
import sys

MODE = sys.argv[1]
ANGLE_LIMIT = math.radians(60.0)  # tilt at full stick, as the bridge configures it
YAW_LIMIT = math.radians(200.0)
IDLE = 0.055
STATE, CHANNELS, MOTORS = struct.Struct("<18d"), struct.Struct("<d16H"), struct.Struct("<4f")


def configure():
    if MODE == "refuses":
        print("###ERROR IN set: INVALID NAME: throttle_boost###")
    if MODE != "writes_nothing":
        with open("eeprom.bin", "wb") as f:
            f.write(b"\0" * 16)


def angle_mode(state, channels):
    """Outputs 0 to 1 of rear right, front right, rear left, front left."""
    roll_rate, pitch_up_rate, yaw_rate = state[1:4]  # x-forward, y-right; the last one up: Betaflight counts yaw to the left
    w, x, y, z = state[7:11]
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch_up = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    stick = [(c - 1500) / 500 for c in channels[:4]]
    throttle = max(0.0, (channels[2] - 1050) / 950)
    base = IDLE + throttle * (1 - IDLE)
    right = 0.038 * (8.0 * (stick[0] * ANGLE_LIMIT - roll) - roll_rate)  # 0.038: 28 rad/s over 737 rad/s² of the full output
    down = 0.054 * (8.0 * (stick[1] * ANGLE_LIMIT + pitch_up) + pitch_up_rate)
    left_turn = 0.086 * (-stick[3] * YAW_LIMIT - yaw_rate)
    if throttle == 0.0:
        right = down = left_turn = 0.0
    mixed = (base - right + down + left_turn, base - right - down - left_turn, base + right + down - left_turn, base + right - down + left_turn)
    return [max(IDLE, min(1.0, m)) for m in mixed]


def bound(port):
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    s.bind(("127.0.0.1", port))
    return s


def fly():
    states, sticks = bound(9003), bound(9004)
    sticks.setblocking(False)
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.bind(("127.0.0.1", 5761))
    listener.listen()
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    channels = [1500, 1500, 1000] + [1500] * 13
    armed = was_high = False
    while True:
        state = STATE.unpack(states.recv(4096))
        try:
            while True:
                channels = CHANNELS.unpack(sticks.recv(4096))[1:]
        except BlockingIOError:
            pass
        high = channels[4] > 1700
        armed = high and (armed or not was_high and state[0] > 5.0 and channels[2] < 1050)
        was_high = high
        if MODE == "ends_in_flight" and state[0] > 9.0:
            sys.exit("out of battery")
        if MODE != "silent" and not (MODE == "stops" and state[0] > 9.0):
            out.sendto(MOTORS.pack(*(angle_mode(state, channels) if armed else [0.0] * 4)), ("127.0.0.1", 9002))


if __name__ != "__main__":
    pass  # stand_in_autopilot.py flies the same angle mode
elif "--config" in sys.argv:
    configure()
elif MODE == "ends_at_start":
    sys.exit("no gyro")
else:
    fly()
