#!/usr/bin/env python3
"""`rotorloop rotor fit` on a folder of measured propellers, one folder each, named as the UIUC database names them: apce_9x6 (inches),
ef_130x70 (mm). Prints the share of verdicts `fitted`, and the share of the sweeps held out whole of these within 10 % of C_T and 12 % of C_P (a blade
is `fitted` where two thirds of them are, so that this share is above 67 % by choice; that of all blades stands beside it); 7 inches and
more and below apart. Only measured tables and geometries (*.txt) are given to the command, of each folder the specimen without `spec` in
its name. Propellers that ROTORLOOP_DATA has are left out, and refused when named. A half of the set is drawn by --seed: rules are set on `--half development` and
judged on `--half judged`. The sets are public (dev/DatabaseRaw/Props of usuaero/PyProp; UIUC) and are fetched by hand.
  scripts/propeller_set.py FOLDER                      all
  scripts/propeller_set.py FOLDER --half judged        the half that no rule was set on
  scripts/propeller_set.py FOLDER da4052_5x3.75        these
  scripts/propeller_set.py FOLDER -- --section OPTION  further options of `rotor fit` behind --
Exit code 6 where a share is below its limit: 60 % fitted, 85 % of the sweeps of these."""
import argparse
import concurrent.futures
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
KNOWN = {"apcsf_10x7", "apcff_4.2x4", "apce_16x8", "da4002_5x3.75", "da4002_9x6.75"}  # in ROTORLOOP_DATA/propellers
INCH_M = 0.0254
SMALL_M = 7 * INCH_M
SWEEP_CT, SWEEP_CP = 0.10, 0.12
STATIC_CT, STATIC_CP = 0.04, 0.075
LEAST_FITTED, LEAST_SWEEPS = 0.60, 0.85
THREE_BLADES = re.compile(r"3blade|-3_|triturbo")


def diameter_m(name):
    size = float(re.search(r"_(\d+(?:\.\d+)?)x", name).group(1))
    return size * (0.001 if size > 50 else INCH_M)


def fit(rotorloop, folder, options):
    """The document of the command, or what it said in place of one."""
    files = sorted(str(f) for f in folder.glob("*.txt") if "_spec" not in f.name)
    with tempfile.TemporaryDirectory() as out:
        (pathlib.Path(out) / "blades").mkdir()
        line = [rotorloop, "rotor", "fit", *files, "--diameter", f"{diameter_m(folder.name):.5f}", "--blades",
                "3" if THREE_BLADES.search(folder.name) else "2", "-o", f"{out}/blades/{folder.name}.toml", "--json", *options]
        done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 6):
        return folder.name, None, done.stderr.strip().splitlines()[0] if done.stderr.strip() else f"exit code {done.returncode}"
    return folder.name, json.loads(done.stdout), ""


def held_out(document):
    taken = next(g for g in document["geometries"] if g["taken"])
    return [e for e in taken["errors"] if e["part"] == "held_out" and e["judged"] and e["fitted"]["rows"] > 0
            and (e["static"] or e["whole_sweep"])]


def within(entry, ct, cp):
    return entry["fitted"]["ct_rms"] <= ct and entry["fitted"]["cp_rms"] <= cp


def percent(part, whole):
    return f"{part} of {whole}" + (f" ({100.0 * part / whole:.0f} %)" if whole else "")


def table(title, results):
    """One row; the two shares that have limits."""
    fitted = [d for d in results.values() if d["verdict"] == "fitted"]
    sweeps = {which: [e for d in chosen for e in held_out(d) if not e["static"]]
              for which, chosen in (("fitted", fitted), ("all", list(results.values())))}
    good = {k: sum(within(e, SWEEP_CT, SWEEP_CP) for e in v) for k, v in sweeps.items()}
    static = sum(all(within(e, STATIC_CT, STATIC_CP) for e in held_out(d) if e["static"]) for d in results.values())
    print(f"{title:<18} {percent(len(fitted), len(results)):>18} {percent(good['fitted'], len(sweeps['fitted'])):>20} "
          f"{percent(static, len(results)):>18} {percent(good['all'], len(sweeps['all'])):>20}")
    return (len(fitted) / len(results) if results else 0.0, good["fitted"] / len(sweeps["fitted"]) if sweeps["fitted"] else 0.0)


def names_of(folder, wanted, half, seed):
    """The halves are drawn before the known ones are left out."""
    names = sorted(f.name for f in folder.iterdir() if f.is_dir() and any("geom" in g.name for g in f.glob("*.txt")))
    if wanted:
        for reason, bad in (("no folder with a geometry has that name", set(wanted) - set(names)),
                            ("ROTORLOOP_DATA has it, and rules were set on it: it is not judged", set(wanted) & KNOWN)):
            if bad:
                sys.exit(f"{folder}: {', '.join(sorted(bad))}: {reason}; do: leave it out")
        return [n for n in names if n in wanted]
    if half != "all":
        random.Random(seed).shuffle(names)
        cut = len(names) // 2
        names = sorted(names[:cut] if half == "development" else names[cut:])
    return [n for n in names if n not in KNOWN]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("folder", type=pathlib.Path)
    p.add_argument("names", nargs="*")
    p.add_argument("--rotorloop", default=str(ROOT / "build/release/bin/rotorloop"))
    p.add_argument("--half", choices=["all", "development", "judged"], default="all")
    p.add_argument("--seed", type=int, default=1, help="that draws the halves")
    p.add_argument("--jobs", type=int, default=os.cpu_count())
    words = sys.argv[1:]
    cut = words.index("--") if "--" in words else len(words)
    a, options = p.parse_args(words[:cut]), words[cut + 1:]
    names = names_of(a.folder, a.names, a.half, a.seed)
    if not names:
        sys.exit(f"{a.folder}: no folder with a geometry; do: give the folder that holds one folder for each propeller")
    results, refused = {}, {}
    with concurrent.futures.ThreadPoolExecutor(a.jobs) as pool:
        for name, document, said in pool.map(lambda n: fit(a.rotorloop, a.folder / n, options), names):
            if document is None or not document["fitted"]:
                refused[name] = said or "no static table"
                continue
            results[name] = document
            bounds = [s["name"] for g in document["geometries"] if g["taken"] for s in g["scalars"] if s["at_bound"]]
            print(f"{name:<20} {document['verdict']:<9} {document['section']['inner']:<11} {'; '.join(document['misses'])}"
                  + (f" [at its bound: {', '.join(bounds)}]" if bounds else ""), flush=True)
    for name, said in refused.items():
        print(f"{name:<20} refused: {said}")
    print(f"\n{'':<18} {'fitted':>18} {'their sweeps':>20} {'static within':>18} {'sweeps of all':>20}")
    shares = table("all", results)
    table("7 inches and more", {n: d for n, d in results.items() if diameter_m(n) >= SMALL_M - 1e-9})
    table("below 7 inches", {n: d for n, d in results.items() if diameter_m(n) < SMALL_M - 1e-9})
    print(f"sweeps within {100 * SWEEP_CT:.0f} % of C_T and {100 * SWEEP_CP:.0f} % of C_P, static rows within {100 * STATIC_CT:.0f} and "
          f"{100 * STATIC_CP:.1f} %; {len(refused)} refused")
    return 0 if shares[0] >= LEAST_FITTED and shares[1] >= LEAST_SWEEPS else 6


if __name__ == "__main__":
    sys.exit(main())
