#!/usr/bin/env python3
"""`rotorloop stand estimate` on every CSV file of a folder, as it is: how many give a coefficient, and why the others give none.

A motor runs in a file that has a rotor speed above 0 in three rows or more. Each refusal counts under its first reason, numbers left out.
For public logs of others, fetched by hand (HeinzGerhard/RCBenchmark: 156 of a Series 1780, in and out of a wind tunnel).
  scripts/stand_logs.py FOLDER                 the table, and one line for each file with a running motor
  scripts/stand_logs.py FOLDER -- --density 1.2      options for the command
Exit code 6 where less than 90 % of the files with a running motor give a coefficient."""
import argparse
import collections
import csv
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LEAST = 0.90
ROWS = 3


def number(cell):
    try:
        return float(cell)
    except ValueError:
        return 0.0


def turns(path):
    """Rows whose speed is above 0, of the column that has most of them."""
    with open(path, encoding="utf-8-sig", errors="replace", newline="") as f:
        rows = csv.reader(f)
        columns, most = [], 0
        counts = collections.Counter()
        for row in rows:
            named = [i for i, cell in enumerate(row) if "speed" in cell.lower() and "rpm" in cell.lower()]
            columns = named or columns
            for i in columns:
                counts[i] += i < len(row) and number(row[i]) > 0.0
        most = max(counts.values(), default=0)
    return most


def reason(text, name):
    text = text.removeprefix(name + ": ").split("; likely")[0]
    return re.sub(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", "#", text).strip()[:100]


def estimate(rotorloop, path, options):
    """(document or {}, exit code, first reason)"""
    done = subprocess.run([rotorloop, "stand", "estimate", str(path), "--json", *options], cwd=ROOT, capture_output=True, text=True,
                          errors="replace", check=False)
    document = json.loads(done.stdout) if done.stdout.lstrip().startswith("{") else {}
    errors = document.get("errors") or [line.split("error: ", 1)[-1] for line in done.stderr.splitlines() if "error: " in line]
    return document, done.returncode, reason(errors[0], path.name) if errors else ""


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("folder", type=pathlib.Path)
    p.add_argument("options", nargs="*", help="behind --, for the command")
    p.add_argument("--rotorloop", default=str(ROOT / "build/release/bin/rotorloop"))
    a = p.parse_args()
    files = sorted(a.folder.rglob("*.csv"))
    if not files:
        sys.exit(f"{a.folder}: no CSV file; do: give the folder that holds the logs")
    running, given, reasons, still_exit_0 = 0, 0, collections.Counter(), 0
    for path in files:
        document, code, why = estimate(a.rotorloop, path, a.options)
        if turns(path) < ROWS:
            still_exit_0 += code == 0
            continue
        running += 1
        given += code == 0
        if code != 0:
            reasons[f"exit {code}: {why}"] += 1
        print(f"{path.name:<45} {code} {figures(document) if code == 0 else why}", flush=True)
    print(f"\n{len(files)} files, {running} with a running motor: {given} give a coefficient ({100.0 * given / max(running, 1):.0f} %); "
          f"{still_exit_0} of the {len(files) - running} others do")
    for text, n in reasons.most_common():
        print(f"{n:5}  {text}")
    return 0 if running and given >= LEAST * running else 6


def figures(document):
    """Values of the coefficients of the file."""
    out = {}
    for name in ("c_t", "c_q"):
        c = document["files"][0].get(name) or {}
        if isinstance(c.get("value"), float):
            out[name] = f"{c['value']:.3g}"
    return ", ".join(f"{k} {v}" for k, v in out.items())


if __name__ == "__main__":
    sys.exit(main())
