"""The cases of scripts/stats diagnose-sensors: errors of sensors and logs, and foreign physics in a part of the flights, drawn by seed from
scripts/diagnose_sensors.toml. scripts/diagnose_study.py flies them, scripts/diagnose_score.py judges."""

import csv
import math
import random

from pose_bursts import direction, put_bursts

GYRO, ACCEL = ([f"{name}_{a}[{unit}]" for a in "xyz"] for name, unit in (("gyro", "rad/s"), ("accel", "m/s2")))
POSITION, QUATERNION = [f"p_{a}[m]" for a in "xyz"], [f"q_{a}[1]" for a in "wxyz"]
TURN = ("roll_rad", "pitch_rad", "yaw_rad")


def all_cases(drawn, case):
    """`case(name, kind, ids, **more)` makes one: what the plant has besides is that of the effects of `ids`."""
    out = []
    for s in drawn["sensor"]:
        beside = [s["beside"]] if "beside" in s else []
        kind = "sensor_pair" if beside else "sensor"
        out.append(case("+".join([s["id"], *beside]), kind, beside, truth=(s["id"], *beside), drawn=s))
    for s in drawn["log"]:
        beside = [s["beside"]] if "beside" in s else []
        out.append(case("+".join([s["name"], *beside]), "log_error", beside, truth=tuple(beside), drawn=s, says=s["says"]))
    return out + [case(s["name"], "foreign_part", [], truth=(), drawn=s) for s in drawn["foreign"]]


def draws_of(case, seed):
    return random.Random(f"{case.name} {seed}")


def size_of(spec, draw):
    low, high = spec["size"]
    return draw.choice((-1, 1)) * math.exp(draw.uniform(math.log(low), math.log(high)))


def entries(case, seed):
    """(id, {key: value}) that the plant gets for this seed."""
    spec, draw = case.drawn, draws_of(case, seed)
    if case.kind.startswith("sensor"):
        if "turn_deg" in spec:
            turn = direction(draw, math.radians(math.exp(draw.uniform(*map(math.log, spec["turn_deg"])))))
            return ((spec["id"], dict(zip(TURN, turn))),)
        key = "rate" if spec["id"] == "clock_rate" else "error"
        values = {key: size_of(spec, draw)}
        return ((spec["id"], values | ({"axis": draw.randint(*spec["axis"])} if "axis" in spec else {})),)
    if case.kind == "foreign_part":
        values = {spec["key"]: abs(size_of(spec, draw))}
        return ((spec["id"], values | {k: draw.uniform(*v) for k, v in spec.get("option", {}).items()}),)
    return ()


def flights(case, seed, names):
    """(name of the flight, whether the drawn effect acts) of a trial; foreign physics is flown in five."""
    if case.kind != "foreign_part":
        return [(n, True) for n in names]
    five = [*names, *names][:5]
    at = random.Random(f"flight {case.name} {seed}").randint(*case.drawn["flight"]) if "flight" in case.drawn else None
    return [(n, at is None or i == at) for i, n in enumerate(five)]


def clipped(rows, columns, names, limit):
    for c in (columns.index(n) for n in names):
        for r in rows:
            if r[c]:
                r[c] = f"{min(max(float(r[c]), -limit), limit):.7g}"


def spoil(log, case, seed):
    """Does to the log what the case says, in place."""
    if case.kind != "log_error":
        return
    with open(log, encoding="utf-8", newline="") as f:
        head = []
        for line in f:
            head.append(line)
            if not line.startswith("#"):
                break
        rows = list(csv.reader(f))
    columns = head[-1].rstrip("\n").split(",")
    spec, draw = case.drawn, random.Random(f"{log.name} {case.name} {seed}")
    if "gyro_range_rad_s" in spec:
        clipped(rows, columns, GYRO, spec["gyro_range_rad_s"])
    if "accel_range_m_s2" in spec:
        clipped(rows, columns, ACCEL, spec["accel_range_m_s2"])
    if "bursts" in spec:
        kind = spec["bursts"][seed % len(spec["bursts"])]
        put_bursts(rows, columns.index("pose_t[s]"), [columns.index(n) for n in POSITION + QUATERNION], kind, draw, decimals=(7, 7))
    with open(log, "w", encoding="utf-8", newline="") as f:
        f.writelines(head)
        csv.writer(f, lineterminator="\n").writerows(rows)
