"""Stands in for the simulator programs of ArduPilot (JSON backend) and PX4 (MAVLink interface), from their documented packets alone.

stand_in_autopilot.py ardupilot|px4 MODE [OPTIONS OF THE PROGRAM]: MODE flies, or fails as it says: ends_at_start, silent, stops, ends_in_flight;
mute (PX4: connects and never answers). Angle mode is that of the stand-in for Betaflight, from states and sticks as each of them hears those.
"""
import json
import math
import signal
import socket
import struct
import sys

from stand_in_betaflight import IDLE, angle_mode

KIND, MODE = sys.argv[1], sys.argv[2]
SPIN_MIN = 0.05


def ours(outputs):
    """Rear right, front right, rear left, front left -> motors 1 to 4 of a quad X: front right, rear left, front left, rear right."""
    rear_right, front_right, rear_left, front_left = outputs
    return [front_right, rear_left, front_left, rear_right]


def outputs_of(gyro, quaternion, roll, nose_down, output, yaw_right):
    """Rates and quaternion of a body x-forward, y-right, z-down over north, east, down; sticks -1 to 1, output 0 to 1."""
    state = [0.0, gyro[0], gyro[1], -gyro[2], 0, 0, 0, *quaternion]
    throttle = 1050 + 950 * max(0.0, (output - IDLE) / (1 - IDLE))
    return ours(angle_mode(state, [1500 + 500 * roll, 1500 + 500 * nose_down, throttle, 1500 + 500 * yaw_right]))


def failing(t):
    if t > 9.0 and MODE == "ends_in_flight":
        sys.exit("out of battery")
    return t > 9.0 and MODE == "stops"


def ardupilot():
    parameters = dict(line.split() for line in open(sys.argv[sys.argv.index("--defaults") + 1]))
    assert sys.argv[sys.argv.index("--model") + 1] == "JSON:127.0.0.1" and float(parameters["MOT_THST_EXPO"]) == 1.0
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    s.settimeout(20)
    pwm, armed = [1000] * 16, False
    for count in range(1, 1 << 30):
        s.sendto(struct.pack("<HHI16H", 18458, int(float(parameters["SIM_RATE_HZ"])), count, *pwm), ("127.0.0.1", 9002))
        text = s.recv(65536).decode()
        assert text[0] == "\n" and text[-1] == "\n"
        state = json.loads(text)
        rc = [state["rc"][f"rc_{i}"] for i in range(1, 9)]
        armed = rc[6] > 1700 and (armed or (state["timestamp"] > 5.0 and rc[2] < 1050))
        if failing(state["timestamp"]):
            continue_silent()
        thrust = (rc[2] - 1000) / 1000
        # Its motors take the root of the thrust: MOT_THST_EXPO 1.
        outputs = outputs_of(state["imu"]["gyro"], state["quaternion"], (rc[0] - 1500) / 500, -(rc[1] - 1500) / 500,
                             SPIN_MIN + (1 - SPIN_MIN) * math.sqrt(thrust), (rc[3] - 1500) / 500)
        pwm = [round(1000 + 1000 * o) for o in outputs] + [1000] * 12 if armed else [1000] * 16


def continue_silent():
    while True:
        signal.pause()


EXTRA = {92: 54, 93: 47, 107: 108, 113: 124}  # of the public message definitions


def crc(data):
    value = 0xFFFF
    for byte in data:
        t = (byte ^ value) & 0xFF
        t = (t ^ t << 4) & 0xFF
        value = (value >> 8 ^ t << 8 ^ t << 3 ^ t >> 4) & 0xFFFF
    return value


def messages(stream):
    while True:
        head = stream.read(10)
        if len(head) < 10:
            return
        assert head[0] == 0xFD
        payload, check = stream.read(head[1]), stream.read(2)
        number = int.from_bytes(head[7:10], "little")
        assert crc(head[1:] + payload + bytes([EXTRA[number]])) == int.from_bytes(check, "little"), number
        yield number, payload + bytes(128 - len(payload))


def controls(sequence, time_us, armed, outputs):
    payload = struct.pack("<QQ16fB", time_us, 0, *outputs, *([0.0] * 12), 128 if armed else 0)
    body = bytes([len(payload), 0, 0, sequence & 255, 1, 1, 93, 0, 0]) + payload
    return b"\xfd" + body + struct.pack("<H", crc(body + bytes([EXTRA[93]])))


def px4():
    s = socket.create_connection(("127.0.0.1", 4560))
    stream, sequence, armed, gps, channels = s.makefile("rb"), 0, False, None, [1500, 1500, 1000, 1500, 1000]
    field = (0.21, 0.0, 0.43)
    for number, payload in messages(stream):
        if number == 92:
            channels = struct.unpack_from("<Q12H", payload)[1:]
        elif number == 113:
            gps = struct.unpack_from("<Qiii", payload)
        elif number == 107:
            values = struct.unpack_from("<Q13fI", payload)
            t, gyro, magnet = values[0] * 1e-6, values[4:7], values[7:10]
            accel = values[1:4]
            if failing(t) or MODE == "mute":
                continue_silent()
            armed = channels[4] > 1700 and (armed or (t > 5.0 and channels[2] < 1050 and gps is not None))
            attitude = ATTITUDE.step(t, gyro, accel, magnet, field)
            outputs = outputs_of(gyro, attitude, (channels[0] - 1500) / 500, (channels[1] - 1500) / 500,
                                 0.05 + 0.95 * (channels[2] - 1000) / 1000, (channels[3] - 1500) / 500)
            s.sendall(controls(sequence, values[0], armed, outputs if armed else [0.0] * 4))
            sequence += 1


class Attitude:
    """PX4 hears no attitude: from the gyro, pulled slowly to where the field and, at rest, the specific force say that down is."""

    def __init__(self):
        self.q, self.t = [1.0, 0.0, 0.0, 0.0], None

    def step(self, t, gyro, accel, magnet, field):
        dt, self.t = (0.0 if self.t is None else t - self.t), t
        w, x, y, z = self.q

        def to_body(v):
            rows = ((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)), (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
                    (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)))
            return [sum(r * c for r, c in zip(row, v)) for row in rows]

        def cross(a, b):
            return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

        size = math.sqrt(sum(m * m for m in magnet)) * math.sqrt(sum(f * f for f in field))
        pull = [3.0 * c / size for c in cross(magnet, to_body(field))]
        force = math.sqrt(sum(a * a for a in accel))
        if t < 6.0 and force > 1.0:
            pull = [p + 3.0 * c / force for p, c in zip(pull, cross([-a for a in accel], to_body((0, 0, 1))))]
        p, q, r = (g + c for g, c in zip(gyro, pull))
        dq = (-x * p - y * q - z * r, w * p + y * r - z * q, w * q - x * r + z * p, w * r + x * q - y * p)
        self.q = [a + 0.5 * dt * b for a, b in zip(self.q, dq)]
        n = math.sqrt(sum(a * a for a in self.q))
        self.q = [a / n for a in self.q]
        return self.q


ATTITUDE = Attitude()
if MODE == "ends_at_start":
    sys.exit("no gyro")
elif MODE == "silent":
    continue_silent()
elif KIND == "ardupilot":
    ardupilot()
else:
    px4()
