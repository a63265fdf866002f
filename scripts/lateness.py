#!/usr/bin/env python3
"""What lateness does to a flight: the paper's vertical flight while, every 250 ms, one of its buses carries nothing for some milliseconds.

All in lockstep, so that nothing of this machine's own lateness is in it. A gap on the state bus is a flight computer that gets its samples late
(they are lost, not late: the worse of both); one on the ESC bus is set-points that stay away while the motors go on with the last ones.
Prints the table of docs/real_time.md.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
GAPS_ms = (0, 2, 5, 10, 15, 19, 21, 25, 29, 32)
FROM_s, TO_s, EVERY_s = 4.0, 25.0, 0.25  # the flight moves in it


def scenario(bus, gap_ms):
    count = round((TO_s - FROM_s) / EVERY_s) if gap_ms else 0
    faults = "".join(f'[[fault]]\nkind = "frame_drop"\nat_s = {FROM_s + i * EVERY_s:.2f}\nduration_s = {gap_ms / 1000}\ntarget = "{bus}"\n' for i in range(count))
    return f"""format = 1
name = "lateness"
plant = "{ROOT}/vehicles/reference_plant.toml"
vehicle = "{ROOT}/vehicles/calibrated.toml"
seeds = [1]
variants = ["pd_ff_thrust_drag"]
[controller]
gains = "{ROOT}/vehicles/gains.toml"
[[flight]]
name = "vertical"
trajectory = "{ROOT}/scenarios/trajectories/vertical_3p1.toml"
{faults}"""


def fly(program, bus, gap_ms):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "s.toml").write_text(scenario(bus, gap_ms), encoding="utf-8")
        done = subprocess.run([program, "hil", "s.toml", "--no-logs", "--name", "r", "-q"], cwd=path, capture_output=True, text=True)
        result = path / "runs/r/result.json"
        if not result.exists():
            sys.exit(done.stderr)
        return json.loads(result.read_text(encoding="utf-8"))["flights"][0]


def cell(flight):
    error = flight["error_cm"]
    if flight["end"] == "completed":
        return f"{error['mean_3d']:.2f}, {error['max_3d']:.2f}"
    return flight["end_detail"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="ROTORLOOP", nargs="?", default=ROOT / "build/release/bin/rotorloop", help="default: %(default)s")
    program = os.path.abspath(parser.parse_args().program)
    print("| gap every 250 ms | state bus: error, mean and worst, cm | ESC bus: the same |\n|---|---|---|")
    for gap_ms in GAPS_ms:
        print(f"| {gap_ms} ms | {cell(fly(program, 'state', gap_ms))} | {cell(fly(program, 'esc', gap_ms))} |", flush=True)


if __name__ == "__main__":
    main()
