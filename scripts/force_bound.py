"""How much of the force of measured flights the terms below could predict, whatever their coefficients: least squares on the log's own
accelerations, without a fit of the motion. For the four NeuroBEM flights (measured rotor speeds, velocity and acceleration in body axes),
with the terms of the paper's eq. 1-5 and with ever more beside them: error on the flight left out, and on the flight itself when it alone
is fitted, below which no law of these terms can come (other laws can). Tables for docs/acceptance/diagnose_measured.md:
  python3 scripts/force_bound.py [FOLDER]        FOLDER: $ROTORLOOP_DATA/flights/neurobem_test
"""

import csv
import math
import os
import pathlib
import sys

MASS_KG = 0.752  # with which the published predictions were made
ROTORS = ("mot1", "mot2", "mot3", "mot4")
NEEDED = (*ROTORS, "dmot1", "dmot2", "dmot3", "dmot4", "ax", "ay", "az", "vx_body", "vy_body", "vz_body", "wx", "wy")

# Force along x, y, z for each unit of a coefficient, by the quantities of one moment. s1, s2: sums of omega and omega^2; vh: speed across
# the shafts.
PAPER = {
    "omega^2": lambda m: (0.0, 0.0, m.s2),
    "omega v_z": lambda m: (0.0, 0.0, m.s1 * m.vz),
    "omega v_xy": lambda m: (m.s1 * m.vx, m.s1 * m.vy, 0.0),
    "drag across": lambda m: (m.vx * abs(m.vx), m.vy * abs(m.vy), 0.0),
    "drag along": lambda m: (0.0, 0.0, m.vz * abs(m.vz)),
}
LIFT = {"v_xy^2": lambda m: (0.0, 0.0, m.vh * m.vh)}
MANY = {
    "omega v_y": lambda m: (0.0, m.s1 * m.vy, 0.0),
    "drag x": lambda m: (m.v * m.vx, 0.0, 0.0),
    "drag y": lambda m: (0.0, m.v * m.vy, 0.0),
    "drag z": lambda m: (0.0, 0.0, m.v * m.vz),
    "damping": lambda m: (m.vx, m.vy, 0.0),
    "damping z": lambda m: (0.0, 0.0, m.vz),
    "omega v_h": lambda m: (0.0, 0.0, m.s1 * m.vh),
    "omega^2 v_h": lambda m: (0.0, 0.0, m.s2 * m.vh),
    "v_z v_h": lambda m: (0.0, 0.0, m.vz * m.vh),
    "constant x": lambda m: (1.0, 0.0, 0.0),
    "constant y": lambda m: (0.0, 1.0, 0.0),
    "constant z": lambda m: (0.0, 0.0, 1.0),
    "tilt x": lambda m: (m.s2, 0.0, 0.0),
    "tilt y": lambda m: (0.0, m.s2, 0.0),
    "acceleration": lambda m: (0.0, 0.0, m.speeding),
    "rates^2": lambda m: (0.0, 0.0, m.p * m.p + m.q * m.q),
    "v_z^2": lambda m: (0.0, 0.0, m.vz * m.vz),
    "q": lambda m: (m.q, 0.0, 0.0),
    "p": lambda m: (0.0, m.p, 0.0),
    "v_h^4 / omega^2": lambda m: (0.0, 0.0, m.vh**4 / m.s2),
    "omega": lambda m: (0.0, 0.0, m.s1),
    "v_h^3": lambda m: (0.0, 0.0, m.vh**3),
}
SETS = {"paper": PAPER, "with lift": PAPER | LIFT, f"{len(PAPER | LIFT | MANY)} terms": PAPER | LIFT | MANY}


class Moment:
    def __init__(self, row):
        omega = [row[k] for k in ROTORS]
        self.s1, self.s2 = sum(omega), sum(w * w for w in omega)
        self.vx, self.vy, self.vz = row["vx_body"], row["vy_body"], row["vz_body"]
        self.vh = math.hypot(self.vx, self.vy)
        self.v = math.hypot(self.vh, self.vz)
        self.p, self.q = row["wx"], row["wy"]
        self.speeding = sum(w * row["d" + k] for w, k in zip(omega, ROTORS))
        self.force = (MASS_KG * row["ax"], MASS_KG * row["ay"], MASS_KG * row["az"])


def moments(path):
    with open(path, newline="", encoding="utf-8") as f:
        reader = csv.DictReader(f)
        missing = [k for k in NEEDED if k not in (reader.fieldnames or ())]
        if missing:
            sys.exit(f"{path}: no column {', '.join(missing)}; this script reads the NeuroBEM test flights of the data folder")
        return [Moment({k: float(row[k]) for k in NEEDED}) for row in reader]


def normal(flight, terms):
    """Sums of products of the columns, the force being the last, and the number of moments."""
    n = len(terms) + 1
    a = [[0.0] * n for _ in range(n)]
    for m in flight:
        columns = [law(m) for law in terms.values()] + [m.force]
        for axis in range(3):
            row = [(i, c[axis]) for i, c in enumerate(columns) if c[axis] != 0.0]
            for k, (i, x) in enumerate(row):
                for j, y in row[k:]:
                    a[i][j] += x * y
    for i in range(n):
        for j in range(i):
            a[i][j] = a[j][i]
    return a, len(flight)


def summed(parts):
    return [[sum(p[i][j] for p in parts) for j in range(len(parts[0]))] for i in range(len(parts[0]))]


def coefficients(a):
    """Least squares from the sums, columns scaled to one, by elimination with pivoting; a column that others hold gets 0."""
    n = len(a) - 1
    scale = [1.0 / math.sqrt(a[i][i]) if a[i][i] > 0.0 else 0.0 for i in range(n)]
    m = [[a[i][j] * scale[i] * scale[j] for j in range(n)] + [a[i][n] * scale[i]] for i in range(n)]
    order, left = [], list(range(n))
    for step in range(n):
        best = max(left, key=lambda i: m[i][i])
        if m[best][best] < 1e-10:
            break
        left.remove(best)
        order.append(best)
        for i in left:
            factor = m[i][best] / m[best][best]
            m[i] = [x - factor * y for x, y in zip(m[i], m[best])]
    x = [0.0] * n
    for i in reversed(order):
        x[i] = (m[i][n] - sum(m[i][j] * x[j] for j in order if j != i and x[j] != 0.0)) / m[i][i]
    return [v * s for v, s in zip(x, scale)]


def error_N(a, count, x):
    n = len(x)
    full = [*x, -1.0]
    return math.sqrt(max(0.0, sum(full[i] * full[j] * a[i][j] for i in range(n + 1) for j in range(n + 1))) / count)


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("ROTORLOOP_DATA", "") + "/flights/neurobem_test")
    files = sorted(root.glob("*.csv"))
    if len(files) < 2:
        sys.exit(f"{root}: {len(files)} flights, at least 2 are needed; set ROTORLOOP_DATA or name the folder")
    flights = {f.stem.split("_2021")[0]: moments(f) for f in files}
    print("Error of the force, N: on a flight that the others predict | on a flight fitted by itself\n")
    print("| flight | " + " | ".join(SETS) + " |\n| --- |" + " --- |" * len(SETS))
    sums = {name: {terms: normal(flight, SETS[terms]) for terms in SETS} for name, flight in flights.items()}
    for name in flights:
        cells = []
        for terms in SETS:
            a, count = sums[name][terms]
            others = summed([sums[k][terms][0] for k in flights if k != name])
            cells.append(f"{error_N(a, count, coefficients(others)):.3f} \\| {error_N(a, count, coefficients(a)):.3f}")
        print(f"| {name} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
