#!/usr/bin/env python3
"""Runs two builds of the command on the same inputs and compares what they write (see scripts/same_bits).

    scripts/same_bits.py OLD_COMMAND NEW_COMMAND [--tolerance X] [--only PART,...] [--out FOLDER]
"""

import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path

import closed_loop

ROOT = Path(__file__).resolve().parents[1]
# What a result.json says about the run itself, not about what it computed.
PROVENANCE = {"version", "git", "started_utc", "wall_s", "inputs", "cost", "log_sha256", "realtime_factor", "fit_wall_s"}
PARTS = ["fly", "effects", "identify", "diagnose", "rotor"]


def run(command, *arguments, may_end_with=(0,)):
    print(" ".join(["rotorloop", *map(str, arguments)])[:160], file=sys.stderr, flush=True)
    done = subprocess.run([command, *map(str, arguments)], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in may_end_with:
        raise SystemExit(f"error: `{' '.join(map(str, arguments))}` ended with {done.returncode}:\n{done.stderr}")
    return done


def require(path):
    """A part that left nothing to compare is an error, not an agreement."""
    if not path.is_file():
        raise SystemExit(f"error: {path} was not written, so there is nothing to compare")


def produce(command, out, parts):
    """Everything that is compared, below `out`."""
    shutil.rmtree(out, ignore_errors=True)  # of an earlier comparison
    out.mkdir(parents=True)
    runs = ["--out", out, "--force", "-q"]
    if "fly" in parts:
        run(command, "hil", "scenarios/paper.toml", "--seeds", 1, *runs, may_end_with=(0, 6, 7))
    if "effects" in parts:
        run(command, "hil", "scenarios/effects.toml", "--seeds", 1, *runs, may_end_with=(0, 6, 7))
    if {"identify", "diagnose"} & set(parts):
        run(command, "hil", "scenarios/identify.toml", "--seeds", "101,", *runs, may_end_with=(0, 6, 7))
        logs = {role: out / "identify" / role / "pd_ff" / "101" for role in ("vertical", "horizontal", "rotation")}
    if "identify" in parts:
        roles = [x for role, log in logs.items() for x in (f"--{role}", log)]
        terms = [x for term in closed_loop.TERMS for x in ("--term", term)]  # the paper's own terms alone give these rotors no fit to compare
        run(command, "identify", "--vehicle", "vehicles/reference_guess.toml", "--use", "none", "--noise", "em-per-flight", "--rate", 50, *terms, *roles,
            "--report", out / "identified", "-q")
        require(out / "identified" / "result.json")
    if "diagnose" in parts:
        run(command, "diagnose", "--vehicle", "vehicles/calibrated.toml", "--flight", *logs.values(), "--report", out / "diagnosed", "-q", may_end_with=(0, 5))
        require(out / "diagnosed" / "result.json")
    if "rotor" in parts:
        run(command, "rotor", "plot", "vehicles/blades/triblade_5in.toml", "-o", out / "rotor.html", may_end_with=(0,))


def leaves(value, path=""):
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in PROVENANCE:
                yield from leaves(inner, f"{path}.{key}")
    elif isinstance(value, list):
        for at, inner in enumerate(value):
            yield from leaves(inner, f"{path}[{at}]")
    else:
        yield path, value


def relative(a, b):
    """How far two figures lie apart; infinite when they are not two finite numbers."""
    numbers = all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in (a, b))
    return abs(a - b) / max(abs(a), abs(b), 1e-300) if numbers else float("inf")


def compare_figures(old, new, tolerance):
    """[(how far apart, what)] of two parsed JSON documents, largest first."""
    a, b = dict(leaves(old)), dict(leaves(new))
    found = [(float("inf"), f"{key}: only in {'the old' if key in a else 'the new'}") for key in a.keys() ^ b.keys()]
    for key in a.keys() & b.keys():
        if a[key] != b[key] and not (a[key] != a[key] and b[key] != b[key]):
            apart = relative(a[key], b[key])
            if apart > tolerance:
                found.append((apart, f"{key}: {a[key]} -> {b[key]}"))
    return sorted(found, key=lambda f: (-f[0], f[1]))


COMPARED_BYTES = {".csv", ".log"}  # flight.csv, truth.csv, esc.log, state.log


def compare_folders(old, new, tolerance):
    """(number of files compared, [difference])."""
    names = {p.relative_to(old) for p in old.rglob("*") if p.is_file()} | {p.relative_to(new) for p in new.rglob("*") if p.is_file()}
    compared, differences = 0, []
    for name in sorted(n for n in names if n.suffix in COMPARED_BYTES or n.name == "result.json"):
        a, b = old / name, new / name
        if not a.is_file() or not b.is_file():
            differences.append(f"{name}: only in {'the old' if a.is_file() else 'the new'}")
            continue
        compared += 1
        if name.suffix in COMPARED_BYTES:
            if a.read_bytes() != b.read_bytes():
                differences.append(f"{name}: other bytes")
        else:
            found = compare_figures(json.loads(a.read_text()), json.loads(b.read_text()), tolerance)
            differences += [f"{name}{what}" + (f"  ({apart:.2g} relative)" if apart != float("inf") else "") for apart, what in found]
    return compared, differences


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--tolerance", type=float, default=0.0)
    parser.add_argument("--only", default=",".join(PARTS))
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "same_bits" / "out")
    o = parser.parse_args(arguments)
    parts = o.only.split(",")
    if unknown := set(parts) - set(PARTS):
        parser.error(f"--only: {', '.join(sorted(unknown))} is none of {', '.join(PARTS)}")
    for name, command in (("old", o.old.resolve()), ("new", o.new.resolve())):
        produce(command, o.out / name, parts)
    compared, differences = compare_folders(o.out / "old", o.out / "new", o.tolerance)
    for d in differences[:200]:
        print(d)
    print(f"{compared} files compared, {len(differences)} differences")
    return 8 if differences or compared == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
