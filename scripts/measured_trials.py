#!/usr/bin/env python3
"""Every measured flight by itself and in groups through `rotorloop identify`: how each ends, and how far the trials of one vehicle lie apart.

Prints for each trial exit code, iterations, CPU and the parameters that short flights settle worst; then for each vehicle the share that ends
with a vehicle file, for each parameter that trials call identified their scatter in units of their own u (rms z, about 1 where u is right;
the median u over the scatter; rms z also between flights of one session alone), and the largest factor between a written inertia and that of
the group of flights; last the whole table, Markdown. Logs with a rotor that drops out are listed as refused and count
nowhere else. ROTORLOOP_DATA names the folder that holds flights/. What the same program left in runs/ is not run again.
  scripts/measured_trials.py                              all sets, default options
  scripts/measured_trials.py imrc_cf21bl_bare --rate=100  one, with options of identify
"""
import argparse
import hashlib
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
VEHICLES = ROOT / "vehicles/measured"
DATASETS = {
    "imrc_cf21bl_bare": "*[0-9].csv",
    "imrc_cf21bl_payload": "*[0-9].csv",
    "imrc_cf21_brushed": "*[0-9].csv",
    "neurobem_test": "*.csv",
    "idsia_nanodrone_cf21bl": "*.csv",
}
# A rotor whose speed drops out, from jana20 on: to be refused by the checks.
FAULTY = ("jana20", "jana24", "jana27", "jana30", "jana32")
# Flights that the pages of docs/ fit together; else all of a set.
GROUPS = {
    "imrc_cf21bl_bare": ("eckart00", "eckart17", "eckart30", "eckart34"),
    "imrc_cf21bl_payload": ("eckart29", "eckart43", "eckart45", "eckart67", "eckart68"),
    "idsia_nanodrone_cf21bl": ("square_20251017_run2", "square_20251017_run3", "random1_20251017_run3"),
}
SHOWN = ["m", "I_xx", "I_yy", "I_zz", "c_q"]
NOT_IDENTIFIED = ("not identified", "weighed", "at its bound", "not excited")
REFUSED = 5  # exit code
INERTIAS = ["I_xx", "I_yy", "I_zz"]


def flights(data, dataset):
    found = sorted((data / "flights" / dataset).glob(DATASETS[dataset]))
    return [f for f in found if not f.stem.endswith("_mocap")]


class Trial:
    """One command of rotorloop in a folder of its own."""

    def __init__(self, o, dataset, group, name):
        folder = o.out / o.label / dataset / name
        self.name, self.result, self.written = name, None, None
        line = [str(o.rotorloop), "identify", "--vehicle", str(VEHICLES / f"{dataset}.toml"), "-m", str(VEHICLES / f"{dataset}.mapping.toml")]
        for f in group:
            line += ["--flight", str(f)]
        line += ["-o", str(folder / "vehicle.toml"), "--report", str(folder), "-q", *o.options]
        key = hashlib.sha256(json.dumps([o.program, line]).encode()).hexdigest()
        done = folder / "done.json"
        if not (done.exists() and json.loads(done.read_text())["key"] == key):
            folder.mkdir(parents=True, exist_ok=True)
            for old in folder.iterdir():
                old.unlink()
            with open(folder / "stdout", "w") as out, open(folder / "stderr", "w") as err:
                child = subprocess.Popen(line, stdout=out, stderr=err)
                _, status, usage = os.wait4(child.pid, 0)
            done.write_text(json.dumps({"key": key, "code": os.waitstatus_to_exitcode(status), "cpu_s": usage.ru_utime + usage.ru_stime}))
        ended = json.loads(done.read_text())
        self.code, self.cpu_s = ended["code"], ended["cpu_s"]
        self.message = (folder / "stderr").read_text()
        if (folder / "result.json").exists():
            self.result = json.loads((folder / "result.json").read_text())
        self.wrote = (folder / "vehicle.toml").exists()

    def estimates(self):
        return {e["symbol"]: e for e in (self.result or {}).get("estimates", []) if e["flight"] is None}

    def shown(self):
        fit = (self.result or {}).get("fit", {})
        cells = [f"{self.name:<34} exit {self.code} {fit.get('iterations', 0):4d} it {fit.get('noise_rounds', 0):3d} noise {self.cpu_s:6.1f} s"]
        found = self.estimates()
        for symbol in SHOWN:
            e = found.get(symbol)
            if e:
                mark = {"not identified": "°", "not excited": "°", "at its bound": "|", "model error": "!", "contradicted": "#"}.get(e["mark"], "")
                cells.append(f"{symbol} {e['value']:.3e} ± {max(e['u'], e['u_robust'] or 0):.0e}{mark}")
        if self.code != 0:
            error = self.message.split("identify: error: ")[-1].splitlines()
            cells.append("| " + (error[0][:150] if error else ""))
        return "  ".join(cells)


def sessions(trials):
    """Trials of consecutive numbers, taken for flights of one session."""
    out = []
    for t in trials:
        number = int("".join(filter(str.isdigit, t.name)) or 0)
        if not out or number != out[-1][0] + 1:
            out.append([number, []])
        out[-1][0] = number
        out[-1][1].append(t)
    return [group for _, group in out]


def scatter_of(groups, symbol):
    """Of the trials that call a parameter identified: scatter about the weighted mean of their group in their own u, median u over the scatter,
    and the number of trials."""
    squares, deviations, freedom, all_u = 0.0, 0.0, 0, []
    for trials in groups:
        values = []
        for t in trials:
            e = t.estimates().get(symbol)
            if t.code == 0 and e and e["mark"] not in NOT_IDENTIFIED:
                values.append((e["value"], max(e["u"], e["u_robust"] or 0.0)))
        values = [(v, u) for v, u in values if u > 0.0]
        if len(values) < 2:
            continue
        weights = [1.0 / (u * u) for _, u in values]
        mean = sum(w * v for (v, _), w in zip(values, weights)) / sum(weights)
        squares += sum(((v - mean) / u) ** 2 for v, u in values)
        deviations += (len(values) - 1) * statistics.variance(v for v, _ in values)
        freedom += len(values) - 1
        all_u += [u for _, u in values]
    if freedom < 2 or deviations == 0.0:
        return math.nan, math.nan, len(all_u)
    return math.sqrt(squares / freedom), statistics.median(all_u) / math.sqrt(deviations / freedom), len(all_u)


def farthest(trials, group, symbol):
    """Largest factor between a written inertia and the group's, or the trials' median where the group has no file."""
    values = [t.estimates()[symbol]["value"] for t in trials if t.code == 0 and symbol in t.estimates()]
    if not values:
        return math.nan
    middle = group.estimates()[symbol]["value"] if group.code == 0 else statistics.median(values)
    return max(max(v / middle, middle / v) if v > 0.0 else math.inf for v in values)


def summary(dataset, trials, group):
    """Prints what the trials of a set say, and returns its row of the table."""
    sound = [t for t in trials if t.name not in FAULTY]
    faulty = [t for t in trials if t.name in FAULTY]
    ended = [t for t in sound if t.code == 0]
    print(f"{dataset}: {len(ended)} of {len(sound)} end with a vehicle file; {sum(t.cpu_s for t in trials):.0f} s of CPU")
    if faulty:
        print(f"  faulty logs: {sum(t.code == REFUSED for t in faulty)} of {len(faulty)} refused ({', '.join(t.name for t in faulty if t.code == REFUSED)})")
    factors = {s: farthest(sound, group, s) for s in INERTIAS}
    print("  farthest from the group's inertia: " + ", ".join(f"{s} by a factor of {f:.2f}" for s, f in factors.items()))
    symbols = []
    for t in ended:
        symbols += [s for s in t.estimates() if s not in symbols]
    found = {s: scatter_of([ended], s) for s in symbols}
    print("  rms z between trials, u over scatter (number): " +
          ", ".join(f"{s} {z:.2f}, {r:.2f} ({n})" for s, (z, r, n) in found.items() if n >= 3), flush=True)
    within = {s: scatter_of(sessions(ended), s) for s in symbols}
    print("  rms z between flights of one session: " + ", ".join(f"{s} {z:.2f} ({n})" for s, (z, _, n) in within.items() if n >= 10), flush=True)
    z_text = ", ".join(f"{s} {found[s][0]:.2f}" for s in ("I_xx", "I_yy", "c_q") if s in found and found[s][2] >= 3) or "–"
    outside = [f"{s} {z:.2f}" for s, (z, _, n) in found.items() if n >= 15 and not 0.55 <= z <= 1.5]
    wide = [f"{s} {r:.2f}" for s, (_, r, n) in found.items() if n >= 15 and r > 1.5]
    return (f"| {dataset} | {len(ended)} of {len(sound)} | {'file' if group.code == 0 else 'exit code %d' % group.code} | "
            f"{', '.join(f'{s} {f:.2f}' for s, f in factors.items())} | {z_text} | {', '.join(outside) or '–'} | {', '.join(wide) or '–'} | "
            f"{f'{sum(t.code == REFUSED for t in faulty)} of {len(faulty)}' if faulty else '–'} |"), len(ended), len(sound)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rotorloop", type=pathlib.Path, default=ROOT / "build/release/bin/rotorloop")
    parser.add_argument("--label", default="default", help="folder below runs/measured_trials; one for each set of options")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "runs/measured_trials")
    parser.add_argument("--only", action="append", help="flights whose name holds this; repeatable")
    parser.add_argument("datasets", nargs="*", metavar="DATASET", help=", ".join(DATASETS))
    o, o.options = parser.parse_known_args()
    if "ROTORLOOP_DATA" not in os.environ:
        print("ROTORLOOP_DATA is not set: no measured flights, nothing to identify", file=sys.stderr)
        return 2
    data = pathlib.Path(os.environ["ROTORLOOP_DATA"])
    o.program = hashlib.sha256(o.rotorloop.read_bytes()).hexdigest()
    print("options:", " ".join(o.options) or "none")
    rows, ended, sound = [], 0, 0
    for dataset in o.datasets or DATASETS:
        found = [f for f in flights(data, dataset) if not o.only or any(part in f.stem for part in o.only)]
        trials = []
        for f in found:
            trials.append(Trial(o, dataset, [f], f.stem))
            print(trials[-1].shown(), flush=True)
        together = [f for f in found if f.stem in GROUPS.get(dataset, (f.stem,)) and f.stem not in FAULTY]
        group = Trial(o, dataset, together or found, "group")
        print(group.shown(), flush=True)
        row, ended_here, sound_here = summary(dataset, trials, group)
        rows.append(row)
        ended, sound = ended + ended_here, sound + sound_here
    print("\n| set | single trials with a file | group | farthest from the group's inertia, factor | rms z of I_xx, I_yy, c_q | "
          "rms z outside 0.55 to 1.5 (15 trials and more) | u above 1.5 × the scatter | faulty logs refused |\n" + "| --- " * 8 + "|")
    print("\n".join(rows))
    print(f"{ended} of {sound} sound flights end with a vehicle file ({100.0 * ended / max(sound, 1):.0f} %, limit 95 %)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
