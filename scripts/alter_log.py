"""What a vehicle's own instruments may do to a flight log, done to a log of ours: rotor speeds that are late, smoothed, scaled, or the ones
that were commanded; poses that are smoothed or come from a mount that gives way. The flight stays the same flight; only what the log says of it changes."""

import bisect
import csv
import math

ROTORS = [f"omega_{i}[rad/s]" for i in range(1, 5)]
POSE = ["p_x[m]", "p_y[m]", "p_z[m]", "q_w[1]", "q_x[1]", "q_y[1]", "q_z[1]"]
LONGEST_STEP_S = 5e-4  # of the mount's equation of motion


def late(t, x, late_s):
    """The log shows at its stamp what was `late_s` before; between samples linearly."""
    out = []
    for s in t:
        at = min(max(s - late_s, t[0]), t[-1])
        i = min(max(bisect.bisect_right(t, at), 1), len(t) - 1)
        share = (at - t[i - 1]) / (t[i] - t[i - 1])
        out.append(x[i - 1] + share * (x[i] - x[i - 1]))
    return out


def low_pass(t, x, tau_s):
    """First order, exact for a value that is held from one sample to the next."""
    out = [x[0]]
    for i in range(1, len(x)):
        out.append(out[-1] + (x[i] - out[-1]) * -math.expm1(-(t[i] - t[i - 1]) / tau_s))
    return out


def mounted(t, x, natural_Hz, damping):
    """A sensor on a spring and a damper: y'' = 2 d w (x' - y') + w² (x - y), the base x linear between samples."""
    w, y, v = 2.0 * math.pi * natural_Hz, x[0], 0.0
    out = [y]
    for i in range(1, len(x)):
        span = t[i] - t[i - 1]
        n = max(1, math.ceil(span / LONGEST_STEP_S))
        slope, h = (x[i] - x[i - 1]) / span, span / n
        for k in range(n):
            base = x[i - 1] + slope * h * (k + 0.5)
            v += h * (2.0 * damping * w * (slope - v) + w * w * (base - y))
            y += h * v
        out.append(y)
    return out


def altered(t, x, kind, spec):
    if kind == "late":
        return late(t, x, spec)
    if kind == "low_pass":
        return low_pass(t, x, spec)
    if kind == "mount":
        return mounted(t, x, spec["natural_Hz"], spec["damping"])
    if kind == "gain":
        return [v * spec for v in x]
    raise ValueError(f"alter_log: no change is called {kind}; do: take commanded, late, low_pass, mount or gain")


def alter(source, target, changes):
    """`changes`: {"rotors" or "pose": {kind: size}}, applied in this order. A row without a pose stays without one."""
    with open(source, encoding="utf-8", newline="") as f:
        head = []
        for line in f:
            head.append(line)
            if not line.startswith("#"):
                break
        columns = head[-1].rstrip("\n").split(",")
        rows = list(csv.reader(f))
    for what, kinds in changes.items():
        names, clock = (ROTORS, "t[s]") if what == "rotors" else (POSE, "pose_t[s]")
        stamp = columns.index(clock)
        for name in names:
            c = columns.index(name)
            if kinds.get("commanded"):
                for r in rows:
                    r[c] = r[columns.index(name.replace("omega_", "omega_cmd_"))]
            there = [r for r in rows if r[c] != "" and r[stamp] != "" and math.isfinite(float(r[c]))]
            t, x = [float(r[stamp]) for r in there], [float(r[c]) for r in there]
            for kind, spec in kinds.items():
                x = x if kind == "commanded" else altered(t, x, kind, spec)
            for r, v in zip(there, x):
                r[c] = f"{v:.7f}"
    if "pose" in changes:
        unit_quaternions(rows, [columns.index(n) for n in POSE[3:]])
    with open(target, "w", encoding="utf-8", newline="") as f:
        f.writelines(head)
        csv.writer(f, lineterminator="\n").writerows(rows)


def unit_quaternions(rows, at):
    for r in rows:
        if r[at[0]] == "":
            continue
        q = [float(r[c]) for c in at]
        norm = math.sqrt(sum(v * v for v in q))
        for c, v in zip(at, q):
            r[c] = f"{v / norm:.7f}"
