"""Flies the paper's three identification flights with one effect after the other that the paper's model lacks, identifies as the paper
does, and compares with what is true of the plant: see scripts/stats paper-questions. Uses the command line of rotorloop alone;
scripts/paper_questions_table.py judges and writes docs/acceptance/paper_questions.md.

A trial is one case of scripts/paper_questions.toml and one seed: build/stats/paper_questions/CASE/SEED.json. A trial that is there is not
repeated. Cases that change the log or the vehicle file alone share the flights of their plant.
"""

import argparse
import concurrent.futures
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import threading
import tomllib

import alter_log
import paper_questions_table
from diagnose_study import ROOT, blocks, seed_list, toml

STUDY = ROOT / "scripts/paper_questions.toml"
BUILT = ROOT / "build/release/bin/rotorloop"
FLIGHTS = ("vertical", "horizontal", "rotation")
# States 50 times a second and 100 agree (docs/acceptance/identify_closed_loop.md). The paper estimates no delays.
IDENTIFY = ["--use", "none", "--rate", "50", "--hold", "pose_delay", "rotor_delay", "--json", "-q"]


def plant_text(case, plant):
    source = ROOT / plant
    text = source.read_text(encoding="utf-8")
    for folder in ("blades", "motors"):
        text = text.replace(f'"{folder}/', f'"{source.parent}/{folder}/')
    effects = case.get("effect", [])
    gone = {*case.get("without", []), *(e["id"] for e in effects)}
    kept = [b for b in blocks(text) if not (b.startswith("[[effect]]") and tomllib.loads(b)["effect"][0]["id"] in gone)]
    for e in effects:
        kept.append("\n[[effect]]\n" + "".join(f'{k} = {json.dumps(v)}\n' for k, v in e.items()))
    return "".join(kept)


def scenario_text(case, study, plant):
    source = ROOT / study["scenario"]
    text = source.read_text(encoding="utf-8").replace(f'"../{study["plant"]}"', f'"{plant}"').replace('"../', f'"{ROOT}/')
    if "rotation" in case:
        text = text.replace("trajectories/identify_rotation.toml", case["rotation"])
    return text.replace('"trajectories/', f'"{source.parent}/trajectories/')


def vehicle_text(case, study):
    """The vehicle file that identification starts from, with hubs assumed elsewhere."""
    text = (ROOT / study["vehicle"]).read_text(encoding="utf-8")
    nominal = case.get("believed", {})
    scale, height = nominal.get("arms", 1.0), nominal.get("hub_height_m", 0.02)
    for x in (-1, 1):
        for y in (-1, 1):
            text = text.replace(f"position_m = [{0.0885 * x}, {0.0885 * y}, 0.02]",
                                f"position_m = [{0.0885 * x * scale:.6f}, {0.0885 * y * scale:.6f}, {height}]")
    return text


def flight_key(case, study):
    return hashlib.sha256((plant_text(case, study["plant"]) + case.get("rotation", "")).encode()).hexdigest()[:16]


def fly(case, seed, folder, o, study):
    """{flight: log} and how each flight ended. Flights that a study which was stopped has left are taken as they are."""
    flown = folder / "flown.json"
    if flown.exists():
        logs, ends = json.loads(flown.read_text(encoding="utf-8"))
        return {name: pathlib.Path(log) for name, log in logs.items()}, ends
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "plant.toml").write_text(plant_text(case, study["plant"]), encoding="utf-8")
    (folder / "scenario.toml").write_text(scenario_text(case, study, folder / "plant.toml"), encoding="utf-8")
    with open(folder / "fly.txt", "w", encoding="utf-8") as log:
        subprocess.run([o.program, "hil", folder / "scenario.toml", "--seeds", f"{seed},", "--out", folder, "--name", "run", "--force", "-q", "-j", "1"],
                       stdout=log, stderr=log, check=False)
    result = json.loads((folder / "run/result.json").read_text(encoding="utf-8"))
    logs = {f["flight"]: folder / "run" / f["flight"] / f["variant"] / str(seed) / "flight.csv" for f in result["flights"]}
    ends = {f["flight"]: f["end"] for f in result["flights"]}
    flown.write_text(json.dumps([{name: str(log) for name, log in logs.items()}, ends]) + "\n", encoding="utf-8")
    return logs, ends


def identify(case, logs, folder, o, study):
    """What the paper's method says: {"stages": {...}, "joint": {...}}, or {"error": …}."""
    if "log" in case:
        changed = {}
        for name, log in logs.items():
            changed[name] = folder / f"{case['name']}_{name}.csv"
            alter_log.alter(log, changed[name], case["log"])
        logs = changed
    vehicle = folder / f"{case['name']}.toml"
    vehicle.write_text(vehicle_text(case, study), encoding="utf-8")
    words = [o.program, "identify", "--vehicle", vehicle, *IDENTIFY, "--noise", case.get("noise", "fixed")]
    for name in FLIGHTS:
        words += [f"--{name}", logs[name]]
    for term in case.get("term", []):
        words += ["--term", term]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if "log" in case:
        for log in logs.values():
            log.unlink()
    try:
        said = json.loads(done.stdout)
    except json.JSONDecodeError:
        return {"error": done.stderr.strip()[-400:]}
    if "fit" not in said:  # refused before anything was fitted
        return {"error": "; ".join(said["errors"])[-400:]}
    of = {"vertical": ("k_1", "k_2"), "rotation": ("I_xx", "I_yy", "I_zz", "c_q")}
    stages = {s["parameter"]: s["value"] for s in said["stages"] if s["parameter"] in of.get(s["stage"], ())}
    joint = {n: said["figures"][n]["value"] for names in of.values() for n in names}
    return {"stages": stages, "joint": joint, "u_stages": {s["parameter"]: s["u"] for s in said["stages"] if s["parameter"] in stages},
            "converged": said["fit"]["converged"]}


class Flights:
    """Of one plant, rotation flight and seed: flown when the first of its cases asks, deleted after the last."""

    def __init__(self, cases, seed, o, study):
        self.cases, self.seed, self.o, self.study = cases, seed, o, study
        self.folder = o.out / "flights" / f"{flight_key(cases[0], study)}_{seed}"
        self.lock, self.flown, self.left = threading.Lock(), None, len(cases)

    def logs(self):
        with self.lock:
            if not self.flown:
                self.flown = fly(self.cases[0], self.seed, self.folder, self.o, self.study)
        return self.flown

    def done(self):
        with self.lock:
            self.left -= 1
            if not self.left:
                shutil.rmtree(self.folder)


def trial(case, flights, o, study):
    logs, ends = flights.logs()
    record = {"case": case["name"], "seed": flights.seed, "ends": ends}
    record |= identify(case, logs, flights.folder, o, study) if set(logs) == set(FLIGHTS) else {"error": "not every flight has a log"}
    target = record_file(o.out, case, flights.seed)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"{case['name']} {flights.seed}: {paper_questions_table.in_words(record, study)}", file=sys.stderr, flush=True)
    flights.done()


def record_file(out, case, seed):
    return out / case["name"] / f"{seed}.json"


def main():
    parser = argparse.ArgumentParser(prog="scripts/stats paper-questions", description="what biases the paper's Table I, by simulation")
    parser.add_argument("--seeds", type=seed_list, default=[101], help="1..10 or 3,5")
    parser.add_argument("--only", type=lambda t: t.split(","), help="these cases, by name or group")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/stats/paper_questions")
    parser.add_argument("--program", type=pathlib.Path, default=BUILT, help="rotorloop to use")
    parser.add_argument("--jobs", "-j", type=int, default=2)
    parser.add_argument("--table-only", action="store_true", help="judge what is there")
    parser.add_argument("--write", action="store_true", help="write the tables into docs/acceptance/paper_questions.md")
    o = parser.parse_args()
    study = toml(STUDY)
    if not o.table_only:
        o.out = o.out.resolve()
        o.out.mkdir(parents=True, exist_ok=True)
        shutil.copy2(o.program, o.out / "rotorloop")  # the whole study with one program, whatever is built meanwhile
        o.program = o.out / "rotorloop"
        wanted = [c for c in study["case"] if "same_as" not in c and (not o.only or c["name"] in o.only or c["group"] in o.only)]
        if not wanted:
            sys.exit(f"error: no case is called {o.only}\n  do: take a name or a group of scripts/paper_questions.toml")
        jobs = []
        for seed in o.seeds:
            groups = {}
            for case in wanted:
                if not record_file(o.out, case, seed).exists():
                    groups.setdefault(flight_key(case, study), []).append(case)
            for group in groups.values():
                flights = Flights(group, seed, o, study)
                jobs += [(case, flights) for case in group]
        with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
            for future in [pool.submit(trial, case, flights, o, study) for case, flights in jobs]:
                future.result()
    text = paper_questions_table.tables(o.out, study)
    if o.write:
        paper_questions_table.write(ROOT / "docs/acceptance/paper_questions.md", text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
