#!/usr/bin/env python3
"""A position controller at attitude level, Python 3.11 and its standard library alone.

rotorloop hil scenarios/paper.toml --flights horizontal --controller "python3 controller.py"

One JSON object a line: the first question describes the vehicle, every further one a control step (docs/controller.md).
"""
import json
import math
import sys
import tomllib

G_M_S2 = 9.80665
# Wanted behaviour of the position error: natural frequency (rad/s) and damping ratio. The attitude loop below is five times as fast.
HORIZONTAL, VERTICAL = (3.4, 0.8), (4.0, 0.9)
TILT_MAX_RAD = math.radians(65.0)
LEAST_VERTICAL = 0.2  # of the weight: never aims downwards


def say(**fields):
    print(json.dumps(fields), flush=True)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def scaled(a, k):
    return [k * x for x in a]


def unit(a):
    return scaled(a, 1.0 / math.sqrt(dot(a, a)))


def columns(q):
    """Axes x, y, z of the body in the world."""
    w, x, y, z = q
    return ([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])


def quaternion(x, y, z):
    """Of the rotation whose columns are the three axes."""
    trace = x[0] + y[1] + z[2]
    largest = max(trace, x[0], y[1], z[2])
    if largest == trace:
        q = [1 + trace, y[2] - z[1], z[0] - x[2], x[1] - y[0]]
    elif largest == x[0]:
        q = [y[2] - z[1], 1 + x[0] - y[1] - z[2], x[1] + y[0], z[0] + x[2]]
    elif largest == y[1]:
        q = [z[0] - x[2], x[1] + y[0], 1 - x[0] + y[1] - z[2], y[2] + z[1]]
    else:
        q = [x[1] - y[0], z[0] + x[2], y[2] + z[1], 1 - x[0] - y[1] + z[2]]
    return unit(q)


class PositionController:
    def __init__(self, setup):
        with open(setup["vehicle_file"], "rb") as file:
            drag = tomllib.load(file)["drag"]
        self.mass_kg = setup["mass_kg"]
        self.rotor_drag_s_m = drag["c_dh_s_m"]["value"]
        self.drag_xy, self.drag_z = drag["c_dxy_N_s2_m2"]["value"], drag["c_dz_N_s2_m2"]["value"]  # N s²/m²

    def thrust_W_N(self, s):
        """Feed-forward, two gains an axis, and the drag of the present speed cancelled; then the limits."""
        axes = (HORIZONTAL, HORIZONTAL, VERTICAL)
        f = []
        for i, (w, damping) in enumerate(axes):
            e_p = s["estimate_p_W_m"][i] - s["setpoint_p_W_m"][i]
            e_v = s["estimate_v_W_m_s"][i] - s["setpoint_v_W_m_s"][i]
            f.append(self.mass_kg * (s["setpoint_a_W_m_s2"][i] - w * w * e_p - 2 * damping * w * e_v))
        f[2] += self.mass_kg * G_M_S2
        body = columns(s["estimate_q_WB"])
        v_B = [dot(axis, s["estimate_v_W_m_s"]) for axis in body]
        carried_N = max(0.0, dot(f, body[2]))
        drag_B = [-self.drag_xy * v_B[0] * abs(v_B[0]) - carried_N * self.rotor_drag_s_m * v_B[0],
                  -self.drag_xy * v_B[1] * abs(v_B[1]) - carried_N * self.rotor_drag_s_m * v_B[1],
                  -self.drag_z * v_B[2] * abs(v_B[2])]
        for axis, drag_N in zip(body, drag_B):
            f = [a - drag_N * b for a, b in zip(f, axis)]
        f[2] = max(f[2], LEAST_VERTICAL * self.mass_kg * G_M_S2)
        sideways, most = math.hypot(f[0], f[1]), f[2] * math.tan(TILT_MAX_RAD)
        if sideways > most:
            f = [f[0] * most / sideways, f[1] * most / sideways, f[2]]
        return f, body

    def answer(self, s):
        f, body = self.thrust_W_N(s)
        z = unit(f)
        yaw = s["setpoint_yaw_rad"]
        y = unit(cross(z, [math.cos(yaw), math.sin(yaw), 0.0]))
        x = cross(y, z)
        # The thrust direction turns with the jerk of the trajectory.
        j = s["setpoint_j_W_m_s3"]
        z_dot = scaled([a - dot(j, z) * b for a, b in zip(j, z)], self.mass_kg / math.sqrt(dot(f, f)))
        return {"q_WB": quaternion(x, y, z),
                "w_B_rad_s": [-dot(y, z_dot), dot(x, z_dot), s["setpoint_yaw_rate_rad_s"] * z[2]],
                "thrust_N": max(0.0, dot(f, body[2]))}  # what acts along the present axis


def main():
    controller = PositionController(json.loads(sys.stdin.readline()))
    say(rotorloop_controller=1, level="attitude")
    for line in sys.stdin:
        s = json.loads(line)
        say(step=s["step"], **controller.answer(s))


if __name__ == "__main__":
    main()
