#!/usr/bin/env python3
"""Measured flights altered as loggers and mappings alter them, each through `rotorloop identify`: refused, or how far the result moves.

A flight is converted to rotorloop's own CSV (`log convert`), altered there and identified alone; the unaltered flight is what it is compared
with; a flight that is refused as it is is counted and not altered. `refused`: exit codes 2 (a bad input file) and 5 (quality of the data);
any other but 0 ends the script with what was run. `wrong`: exit code 0 and a parameter that moved by more than 3 u and by more than 20 %.
ROTORLOOP_DATA names the data folder.
  scripts/altered_flights.py                              one flight of each set: hours of CPU where little is refused
  scripts/altered_flights.py imrc_cf21bl_bare/eckart00    these
  scripts/altered_flights.py --only slip,axes SET/FLIGHT  these alterations: held, frozen, offset, delayed, slip, axes
Exit code 6 where a result is wrong or an unaltered flight is refused."""
import argparse
import csv
import itertools
import json
import math
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
MEASURED = ROOT / "vehicles/measured"
ROTORS = [f"omega_{i}[rad/s]" for i in range(1, 5)]
POSITION = ["p_x[m]", "p_y[m]", "p_z[m]"]
POSE = POSITION + ["q_w[1]", "q_x[1]", "q_y[1]", "q_z[1]"]
LATE_S = 0.1
REFUSED = (2, 5)  # ExitCode::usage, ExitCode::data_quality of host/base/error.hpp


class Log:
    """Rows of rotorloop's own CSV; a cell without a value is empty."""

    def __init__(self, path):
        lines = pathlib.Path(path).read_text(encoding="utf-8").splitlines()
        first = next(i for i, line in enumerate(lines) if not line.startswith("#"))
        self.head, self.names = lines[:first], lines[first].split(",")
        self.rows = list(csv.reader(lines[first + 1:]))

    def at(self, names):
        return [self.names.index(n) for n in names]

    def rows_of(self, columns):
        return [r for r in self.rows if all(r[c] != "" for c in columns)]

    def write(self, path):
        with open(path, "w", encoding="utf-8", newline="") as f:
            f.write("\n".join(self.head + [",".join(self.names)]) + "\n")
            csv.writer(f, lineterminator="\n").writerows(self.rows)


def span(rows):
    return float(rows[0][0]), float(rows[-1][0])


def held(log, rate_Hz):
    """Rotor speeds change `rate_Hz` times a second and stand in between."""
    columns = log.at(ROTORS)
    rows, last, kept = log.rows_of(columns), None, None
    for r in rows:
        slot = math.floor(float(r[0]) * rate_Hz)
        if slot != last:
            last, kept = slot, [r[c] for c in columns]
        for c, v in zip(columns, kept):
            r[c] = v


def frozen(log, names):
    """They stand from a third of the flight to two thirds."""
    columns = log.at(names)
    rows = log.rows_of(columns)
    begin, end = span(rows)
    kept = None
    for r in rows:
        if begin + (end - begin) / 3 <= float(r[0]) <= begin + 2 * (end - begin) / 3:
            kept = kept or [r[c] for c in columns]
            for c, v in zip(columns, kept):
                r[c] = v


def offset(log, name, share):
    column = log.at([name])[0]
    rows = log.rows_of([column])
    mean = sum(float(r[column]) for r in rows) / len(rows)
    for r in rows:
        r[column] = repr(float(r[column]) + share * mean)


def delayed(log, names):
    """Each row shows the values of the last row that is `LATE_S` older; the first rows have none."""
    columns = log.at(names)
    rows = log.rows_of(columns)
    old = [(float(r[0]), [r[c] for c in columns]) for r in rows]
    k = 0
    for r in rows:
        while k + 1 < len(old) and old[k + 1][0] <= float(r[0]) - LATE_S:
            k += 1
        early = old[k][0] > float(r[0]) - LATE_S
        for c, v in zip(columns, old[k][1]):
            r[c] = "" if early else v


def slip(log, share):
    columns = log.at(ROTORS)
    rows = log.rows_of(columns)
    begin, end = span(rows)
    for r in rows:
        if float(r[0]) >= begin + share * (end - begin):
            values = [r[c] for c in columns]
            for c, v in zip(columns, values[1:] + values[:1]):
                r[c] = v


def axes(log, order, signs):
    columns = log.at(POSITION)
    for r in log.rows_of(columns):
        values = [float(r[c]) for c in columns]
        for c, o, s in zip(columns, order, signs):
            r[c] = repr(s * values[o])


def even(order):
    return sum(order[i] > order[j] for i in range(3) for j in range(i)) % 2 == 0


def other_axes():
    """The 23 turns of a right-handed frame into another."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            if math.prod(signs) == (1 if even(order) else -1) and (order, signs) != ((0, 1, 2), (1, 1, 1)):
                yield order, signs


def alterations():
    for rate_Hz in (4, 10, 20):
        yield "held", f"rotor speeds held at {rate_Hz} Hz", lambda log, r=rate_Hz: held(log, r)
    yield "frozen", "one rotor speed frozen", lambda log: frozen(log, ROTORS[:1])
    yield "frozen", "poses frozen", lambda log: frozen(log, POSE)
    yield "offset", "one rotor speed + 10 %", lambda log: offset(log, ROTORS[1], 0.1)
    yield "delayed", "rotor speeds delayed by 0.1 s", lambda log: delayed(log, ROTORS)
    yield "delayed", "poses delayed by 0.1 s", lambda log: delayed(log, POSE)
    for share in (0.25, 0.5, 0.75):
        yield "slip", f"rotors slip by one at {100 * share:.0f} %", lambda log, s=share: slip(log, s)
    for order, signs in other_axes():
        name = " ".join(("-" if s < 0 else "+") + "xyz"[o] for o, s in zip(order, signs))
        yield "axes", f"position in axes {name}", lambda log, o=order, s=signs: axes(log, o, s)


def run(command, allowed):
    done = subprocess.run([str(c) for c in command], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in allowed:
        sys.exit(f"exit code {done.returncode} of: {shlex.join(str(c) for c in command)}\n{done.stderr[-2000:]}")
    return done


def identify(rotorloop, log, vehicle, folder):
    """(exit code, {parameter: (value, u)}, first error)"""
    out = folder / "out.toml"
    out.unlink(missing_ok=True)
    done = run([rotorloop, "identify", "--flight", log, "--vehicle", vehicle, "--json", "-o", out], (0, *REFUSED))
    document = json.loads(done.stdout) if done.stdout.lstrip().startswith("{") else {}
    values = {}
    for e in document.get("estimates", []):
        if isinstance(e.get("value"), float) and isinstance(e.get("u"), float):
            values[e["name"]] = (e["value"], max(e["u"], e.get("u_robust") or 0.0))
    errors = document.get("errors", []) + [line for line in done.stderr.splitlines() if "error" in line or "refused" in line]
    return done.returncode, values, str(errors[0]).strip() if errors else ""


def moved(values, reference):
    """The parameters beyond both limits, the farthest first."""
    out = []
    for name, (value, u) in values.items():
        if name in reference:
            before, u_before = reference[name]
            away, share = abs(value - before), abs(value - before) / max(abs(before), 1e-12)
            if away > 3 * math.hypot(u, u_before) and share > 0.2:
                out.append((share, f"{name} {100 * (value / before - 1):+.0f} %" if before != 0 else f"{name} 0 to {value:.3g}"))
    return [text for _, text in sorted(out, reverse=True)]


def judge_flight(a, flight, only, folder):
    """Counts of one flight; prints a line for each alteration."""
    set_name, name = flight.split("/")
    mapping, vehicle = MEASURED / f"{set_name}.mapping.toml", MEASURED / f"{set_name}.toml"
    whole = folder / "whole.csv"
    whole.unlink(missing_ok=True)
    run([a.rotorloop, "log", "convert", f"{os.environ['ROTORLOOP_DATA']}/flights/{flight}.csv", "-m", mapping, "-o", whole], (0,))
    code, reference, why = identify(a.rotorloop, whole, vehicle, folder)
    print(f"{flight}: unaltered: {'identified' if code == 0 else why}", flush=True)
    counts = {"flights": 1, "false": code != 0, "cases": 0, "refused": 0, "wrong": 0}
    if code != 0:
        return counts  # nothing to compare with
    for kind, title, change in alterations():
        if only and kind not in only:
            continue
        log, path = Log(whole), folder / "altered.csv"
        try:
            change(log)
        except (ValueError, IndexError):
            print(f"  {title}: not in this log")
            continue
        log.write(path)
        code, values, why = identify(a.rotorloop, path, vehicle, folder)
        far = moved(values, reference) if code == 0 else []
        counts["cases"] += 1
        counts["refused"] += code != 0
        counts["wrong"] += bool(far)
        print(f"  {title}: {('WRONG ' + ', '.join(far[:3])) if far else 'like the unaltered' if code == 0 else 'refused: ' + why[:120]}", flush=True)
    return counts


def one_of_each_set():
    flights = pathlib.Path(os.environ["ROTORLOOP_DATA"]) / "flights"
    for mapping in sorted(MEASURED.glob("*.mapping.toml")):
        name = mapping.name.removesuffix(".mapping.toml")
        files = [f for f in sorted((flights / name).glob("*.csv")) if not f.stem.endswith("_mocap")] if (flights / name).is_dir() else []
        if files:
            yield f"{name}/{files[0].stem}"


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("flights", nargs="*", help="SET/FLIGHT")
    p.add_argument("--only", default="", help="alterations, separated by commas")
    p.add_argument("--rotorloop", default=str(ROOT / "build/release/bin/rotorloop"))
    a = p.parse_args()
    if "ROTORLOOP_DATA" not in os.environ:
        sys.exit("ROTORLOOP_DATA is not set; do: let it name the data folder")
    only = set(filter(None, a.only.split(",")))
    total = {}
    with tempfile.TemporaryDirectory() as folder:
        for flight in a.flights or one_of_each_set():
            for key, n in judge_flight(a, flight, only, pathlib.Path(folder)).items():
                total[key] = total.get(key, 0) + n
    print(f"\n{total['flights']} flights, {total['false']} of them refused unaltered and left out; {total['cases']} altered: {total['refused']} refused, "
          f"{total['wrong']} wrong, {total['cases'] - total['refused'] - total['wrong']} like the unaltered")
    return 6 if total["false"] or total["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
