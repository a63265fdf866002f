#!/usr/bin/env python3
"""Every measured flight by itself through `rotorloop identify`: how each ends, and how far the trials of one vehicle lie apart.

Prints for each trial exit code, iterations, CPU and the parameters that short flights settle worst, then for each vehicle and parameter
the scatter of the trials in units of their own u (rms z, about 1 where u is right) and the largest factor between a written inertia and
the median of the trials. ROTORLOOP_DATA names the folder that holds flights/. What the same program left in runs/ is not run again.
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
# Flights of the brushed Crazyflie from jana20 on have a rotor whose speed drops out: the checks' business.
DATASETS = {
    "imrc_cf21bl_bare": "*[0-9].csv",
    "imrc_cf21bl_payload": "*[0-9].csv",
    "imrc_cf21_brushed": "jana[01][0-9].csv",
    "neurobem_test": "*.csv",
    "idsia_nanodrone_cf21bl": "*.csv",
}
SHOWN = ["m", "I_xx", "I_yy", "I_zz", "c_q"]
NOT_IDENTIFIED = ("not identified", "weighed", "at its bound", "not excited")
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


def rms_z(trials, symbol):
    """Scatter about the weighted mean over the trials that call the parameter identified; their number."""
    values = []
    for t in trials:
        e = t.estimates().get(symbol)
        if t.code == 0 and e and e["mark"] not in NOT_IDENTIFIED:
            values.append((e["value"], max(e["u"], e["u_robust"] or 0.0)))
    values = [(v, u) for v, u in values if u > 0.0]
    if len(values) < 3:
        return math.nan, len(values)
    weights = [1.0 / (u * u) for _, u in values]
    mean = sum(w * v for (v, _), w in zip(values, weights)) / sum(weights)
    return math.sqrt(sum(((v - mean) / u) ** 2 for v, u in values) / (len(values) - 1)), len(values)


def summary(dataset, trials):
    ended = [t for t in trials if t.code == 0]
    print(f"{dataset}: {len(ended)} of {len(trials)} end with a vehicle file; {sum(t.cpu_s for t in trials):.0f} s of CPU")
    for symbol in INERTIAS:
        all_values = [t.estimates()[symbol]["value"] for t in ended if symbol in t.estimates()]
        if not all_values:
            continue
        middle = statistics.median(all_values)
        worst = max(max(v / middle, middle / v) for v in all_values)
        print(f"  {symbol}: median {middle:.3e}, farthest by a factor of {worst:.2f}")
    symbols = []
    for t in ended:
        symbols += [s for s in t.estimates() if s not in symbols]
    print("  rms z between trials (number): " + ", ".join(f"{s} {z:.2f} ({n})" for s in symbols for z, n in [rms_z(ended, s)] if n >= 3), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rotorloop", type=pathlib.Path, default=ROOT / "build/release/bin/rotorloop")
    parser.add_argument("--label", default="default", help="folder below runs/measured_trials; one for each set of options")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "runs/measured_trials")
    parser.add_argument("--group", action="store_true", help="all flights of a data set in one fit instead")
    parser.add_argument("--only", action="append", help="flights whose name holds this; repeatable")
    parser.add_argument("datasets", nargs="*", metavar="DATASET", help=", ".join(DATASETS))
    o, o.options = parser.parse_known_args()
    if "ROTORLOOP_DATA" not in os.environ:
        print("ROTORLOOP_DATA is not set: no measured flights, nothing to identify", file=sys.stderr)
        return 2
    data = pathlib.Path(os.environ["ROTORLOOP_DATA"])
    o.program = hashlib.sha256(o.rotorloop.read_bytes()).hexdigest()
    print("options:", " ".join(o.options) or "none")
    for dataset in o.datasets or DATASETS:
        found = [f for f in flights(data, dataset) if not o.only or any(part in f.stem for part in o.only)]
        groups = {"group": found} if o.group else {f.stem: [f] for f in found}
        trials = []
        for name, group in groups.items():
            trials.append(Trial(o, dataset, group, name))
            print(trials[-1].shown(), flush=True)
        if not o.group:
            summary(dataset, trials)
    return 0


if __name__ == "__main__":
    sys.exit(main())
