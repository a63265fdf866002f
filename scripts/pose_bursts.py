#!/usr/bin/env python3
"""Bursts of a motion capture put into the flights of a development set, and what `rotorloop identify` makes of it.

Of each flight 4 to 6 % of the poses leave the motion for 0.1 to 0.3 s, every 2 to 5 s, by 0.1 to 0.5 rad and 3 to 10 cm. For each set and kind
a line: the bursts that the checks found, and the largest change of an estimate against the flights as they are, in its standard uncertainty.
ROTORLOOP_DATA names the folder that holds flights/.
  scripts/pose_bursts.py d01 d02 --seed 11                 all kinds: some two minutes of one core a set
  scripts/pose_bursts.py d01 --kinds swell --limit 0.5     exit code 6 where an estimate moves by more
"""
import argparse
import csv
import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import tomllib

from development_sets import FITTED, MAPPING, ROOT, vehicle_text

BURST_S, PAUSE_S, TURN_RAD, SHIFT_M = (0.1, 0.3), (2.0, 5.0), (0.1, 0.5), (0.03, 0.1)


def product(a, b):
    w, x, y, z = a
    v, i, j, k = b
    return (w * v - x * i - y * j - z * k, w * i + x * v + y * k - z * j, w * j - x * k + y * v + z * i, w * k + x * j - y * i + z * v)


def turned(q, vector):
    angle = math.hypot(*vector)
    share = math.sin(angle / 2) / angle if angle > 0 else 0.0
    return product(q, (math.cos(angle / 2), *(share * v for v in vector)))


def direction(draw, length):
    v = [draw.gauss(0, 1) for _ in range(3)]
    return [length * x / math.hypot(*v) for x in v]


def offset_at(kind, share, turn, shift, draw):
    """Turn in rad and shift in m at `share` of a burst."""
    if kind == "noise":
        return [draw.gauss(0, 0.06) for _ in range(3)], [draw.gauss(0, 0.03) for _ in range(3)]
    size = math.sin(math.pi * share) if kind == "swell" else 1.0
    return [size * x for x in turn], [size * x for x in shift]


def put_bursts(rows, clock, pose, kind, draw, decimals=(5, 6)):
    """Puts bursts into rows of cells, in place; returns how many. `clock` and `pose`: columns of the time, s, and of place and quaternion;
    rows without them stay. `decimals`: of place and quaternion."""
    posed = [r for r in rows if r[pose[0]] and r[clock]]
    count, at = 0, float(posed[0][clock]) + 1.0 + draw.uniform(0, 3)
    while at < float(posed[-1][clock]) - 1.0:
        length, count = draw.uniform(*BURST_S), count + 1
        turn, shift = direction(draw, draw.uniform(*TURN_RAD)), direction(draw, draw.uniform(*SHIFT_M))
        for row in posed:
            share = (float(row[clock]) - at) / length
            if not 0 <= share <= 1:
                continue
            a, b = offset_at(kind, share, turn, shift, draw)
            before = [float(row[c]) for c in pose]
            after = [p + d for p, d in zip(before[:3], b)] + list(turned(before[3:], a))
            for k, (c, v) in enumerate(zip(pose, after)):
                row[c] = f"{v:.{decimals[k >= 3]}f}"
        at += length + draw.uniform(*PAUSE_S)
    return count


def spoil(source, target, kind, seed):
    """Writes the flight with bursts; returns how many."""
    with open(source, newline="", encoding="utf-8") as f:
        head, *rows = csv.reader(f)
    count = put_bursts(rows, 0, range(1, 8), kind, random.Random(f"{kind} {seed} {source.stem}"))
    with open(target, "w", newline="", encoding="utf-8") as f:
        csv.writer(f).writerows([head, *rows])
    return count


def identified(program, folder, vehicle, mapping):
    done = subprocess.run([str(program), "identify", "--vehicle", str(vehicle), "-m", str(mapping), "-q", "--json", "--flight",
                           *(str(folder / f"{f}.csv") for f in FITTED)], capture_output=True, text=True)
    if done.returncode not in (0, 5):
        sys.exit(f"{folder}: exit code {done.returncode}\n{done.stderr[-1500:]}")
    return json.loads(done.stdout), done.returncode


def found_bursts(result):
    return sum(int(f["what"].split()[0]) for flight in result["checks"] for f in flight["findings"] if "bursts of at most" in f["what"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+")
    parser.add_argument("--kinds", default="step,swell,noise")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=0.5, help="largest change of an estimate, in its standard uncertainty")
    parser.add_argument("--rotorloop", type=pathlib.Path, default=ROOT / "build/release/bin/rotorloop")
    o = parser.parse_args()
    if "ROTORLOOP_DATA" not in os.environ:
        sys.exit("ROTORLOOP_DATA is not set: it names the folder that holds flights/")
    missed = False
    print("| set | bursts | put in | found | estimate that moved most | change, u |\n|---|---|---|---|---|---|")
    for name in o.sets:
        flights = pathlib.Path(os.environ["ROTORLOOP_DATA"], "flights/development", name)
        with tempfile.TemporaryDirectory() as work:
            vehicle, mapping = pathlib.Path(work, "vehicle.toml"), pathlib.Path(work, "mapping.toml")
            vehicle.write_text(vehicle_text(name, tomllib.loads((flights / "known.toml").read_text())))
            mapping.write_text(MAPPING.format(name=name))
            as_it_is = {e["name"]: e for e in identified(o.rotorloop, flights, vehicle, mapping)[0]["estimates"]}
            for kind in o.kinds.split(","):
                folder = pathlib.Path(work, kind)
                folder.mkdir()
                count = sum(spoil(flights / f"{f}.csv", folder / f"{f}.csv", kind, o.seed) for f in FITTED)
                result, code = identified(o.rotorloop, folder, vehicle, mapping)
                moved = {e["symbol"]: (e["value"] - as_it_is[e["name"]]["value"]) / as_it_is[e["name"]]["u"] for e in result["estimates"]}
                most = max(moved, key=lambda symbol: abs(moved[symbol]))
                missed = missed or code != 0 or abs(moved[most]) > o.limit
                print(f"| {name} | {kind} | {count} | {found_bursts(result)} | {most} | {moved[most]:+.2f} |", flush=True)
    return 6 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
