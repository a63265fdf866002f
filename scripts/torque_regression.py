"""Where the bias of a fitted inertia comes from, without any fit: Euler's equations over the true states of one flight (`truth.csv`), the
rotors' moments by eq. 1-3, solved for inertia, c_q and centre of mass by least squares; then again with what the equations lack beside
them, one after the other. Tables for docs/acceptance/paper_questions.md:
  python3 scripts/torque_regression.py RUN/rotation/pd_ff/SEED/truth.csv
"""

import csv
import math
import sys

# Hubs (x, y) in m and the side of the reaction torque, as in vehicles/reference_plant.toml.
HUBS = ((0.0885, -0.0885, -1), (-0.0885, 0.0885, -1), (0.0885, 0.0885, 1), (-0.0885, -0.0885, 1))
K_1, K_2 = 2.69e-6, -1.16e-4  # stage 1 of the reference plant; their static c_t is that of the stand to 0.4 %
MOMENTUM = 2.0 * 1.2 * math.pi * 0.0635**2  # 2 rho A, kg/m
TRUE = {"I_xx": 2.41e-3, "I_yy": 3.42e-3, "I_zz": 5.22e-3, "c_q": 2.179e-8}
STEP_S, HALF_S, FLYING_RAD_S = 0.01, 0.005, 300.0
# What eq. 3 and 7 lack: its torque for each unit of its coefficient, by (rates, body velocity, sum of s w, sum of s dw/dt, …), s the sense
# of rotation.
LACKING = {
    "reaction": lambda m: (0.0, 0.0, m["spin_rate"]),
    "gyroscopic": lambda m: (m["spin"] * m["rate"][1], -m["spin"] * m["rate"][0], 0.0),
    "yaw damping": lambda m: (0.0, 0.0, m["rate"][2]),
    "roll, pitch damping": lambda m: (m["rate"][0], m["rate"][1], 0.0),
    "moment by velocity": lambda m: (m["velocity"][1], -m["velocity"][0], 0.0),
}
SETS = ((), ("reaction",), ("gyroscopic",), ("reaction", "gyroscopic"), ("yaw damping",), ("roll, pitch damping",), ("moment by velocity",),
        ("reaction", "gyroscopic", "yaw damping"), tuple(LACKING))


def thrust(w, across, up):
    """Eq. 1-2, by Newton from an induced velocity of 6 m/s."""
    v = 6.0
    for _ in range(8):
        u = math.hypot(across, up + v)
        v -= (MOMENTUM * v * u - K_1 * w * w - K_2 * w * (up + v)) / (MOMENTUM * (u + v * (up + v) / u) - K_2 * w)
    return K_1 * w * w + K_2 * w * (up + v)


def to_body(q, v):
    """v of the world in body axes; q = w, x, y, z, body to world."""
    w, x, y, z = q
    rows = ((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
            (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
            (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)))
    return [sum(a * b for a, b in zip(row, v)) for row in rows]


def read(path):
    with open(path, encoding="utf-8", newline="") as f:
        reader = csv.reader(line for line in f if not line.startswith("#"))
        at = {name.split("[")[0]: i for i, name in enumerate(next(reader))}
        names = ["t", *(f"true_v_{a}" for a in "xyz"), *(f"true_q_{a}" for a in "wxyz"), *(f"true_w_{a}" for a in "xyz"), *(f"true_omega_{k}" for k in range(1, 5))]
        return [[float(row[at[n]]) for n in names] for row in reader if row[at["true_v_x"]] != ""]


def moments(rows):
    """What the regression needs, every STEP_S, in flight; rates of change over HALF_S to either side."""
    dt = rows[1][0] - rows[0][0]
    half, out = max(1, round(HALF_S / dt)), []
    for i in range(half, len(rows) - half, max(1, round(STEP_S / dt))):
        row, change = rows[i], [(b - a) / (rows[i + half][0] - rows[i - half][0]) for a, b in zip(rows[i - half], rows[i + half])]
        omega = row[11:15]
        if min(omega) < FLYING_RAD_S:
            continue
        v = to_body(row[4:8], row[1:4])
        of = [thrust(w, math.hypot(v[0], v[1]), v[2]) for w in omega]
        out.append({"rate": row[8:11], "acceleration": change[8:11], "velocity": v, "thrust": sum(of),
                    "roll": sum(y * t for (_, y, _), t in zip(HUBS, of)), "pitch": -sum(x * t for (x, _, _), t in zip(HUBS, of)),
                    "yaw": sum(s * w * w for (_, _, s), w in zip(HUBS, omega)), "spin": sum(-s * w for (_, _, s), w in zip(HUBS, omega)),
                    "spin_rate": sum(-s * w for (_, _, s), w in zip(HUBS, change[11:15]))})
    return out


def solve(matrix, right):
    n = len(right)
    rows = [list(matrix[i]) + [right[i]] for i in range(n)]
    for i in range(n):
        p = max(range(i, n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[p] = rows[p], rows[i]
        for k in range(n):
            if k != i:
                f = rows[k][i] / rows[i][i]
                rows[k] = [a - f * b for a, b in zip(rows[k], rows[i])]
    return [rows[i][n] / rows[i][i] for i in range(n)]


def regress(samples, lacking=()):
    """{"I_xx": …, "c_q": …, and the coefficient of each thing in `lacking`}. Columns are scaled so that the solve is well behaved."""
    n = 6 + len(lacking)
    normal, right = [[0.0] * n for _ in range(n)], [0.0] * n
    scale = {"reaction": 1e-2, "gyroscopic": 1e-2}
    for m in samples:
        (p, q, r), (dp, dq, dr) = m["rate"], m["acceleration"]
        extra = [[scale.get(k, 1.0) * c for c in LACKING[k](m)] for k in lacking]
        equations = (([dp, -q * r, q * r, 0.0, 0.0, m["thrust"]], m["roll"]), ([p * r, dq, -p * r, 0.0, -m["thrust"], 0.0], m["pitch"]),
                     ([-p * q, p * q, dr, -1e-5 * m["yaw"], 0.0, 0.0], 0.0))
        for axis, (columns, known) in enumerate(equations):
            columns = columns + [e[axis] for e in extra]
            for a in range(n):
                right[a] += columns[a] * known
                for b in range(n):
                    normal[a][b] += columns[a] * columns[b]
    x = solve(normal, right)
    out = {"I_xx": x[0], "I_yy": x[1], "I_zz": x[2], "c_q": 1e-5 * x[3]}
    return out | {k: scale.get(k, 1.0) * v for k, v in zip(lacking, x[6:])}


def table(samples):
    text = "| the equations, and beside them | " + " | ".join(TRUE) + " |\n|" + " --- |" * 5 + "\n"
    for lacking in SETS:
        of = regress(samples, lacking)
        text += f"| {', '.join(lacking) or 'nothing'} | " + " | ".join(f"{100 * (of[k] / v - 1):+.0f}" for k, v in TRUE.items()) + " |\n"
    return text


if __name__ == "__main__":
    print(table(moments(read(sys.argv[1]))), end="")
