"""Flies a plant with one unmodelled effect after the other, lets `rotorloop diagnose` say what the logs show, and keeps what it
said: see scripts/stats diagnose. Uses the command line of rotorloop alone; scripts/diagnose_score.py judges,
scripts/diagnose_compare.py holds two programs against each other.

A trial is one plant and one seed: build/stats/diagnose/CASE/SEED with plant.toml, the vehicle file, and trial.json
(how the flights ended, what was said). A trial that has its trial.json is not repeated; logs are deleted once they are read.
"""

import argparse
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import time
import tomllib

import diagnose_score
import diagnose_sensor_cases as sensors

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILT = ROOT / "build/release/bin/rotorloop"
STUDY = ROOT / "scripts/diagnose_study.toml"
SENSORS = ROOT / "scripts/diagnose_sensors.toml"
MODEL_TRUE = ROOT / "build/release/test-bin/model_true_logs"
DIAGNOSE = ["--use", "gyro,accel", "--rate", "50", "--max-effects", "3", "--json", "-q"]  # one command line for all


@dataclasses.dataclass(frozen=True)
class Case:
    name: str
    kind: str                    # separable, class_only, not_observable, pair, foreign, clean_full, clean_reduced; diagnose_sensor_cases.py
    truth: tuple = ()            # ids that the answer should hold
    entries: tuple = ()          # (id, {key: value}) that the plant gets, over those of its file
    unmodelled: tuple = ()       # ids that the vehicle file loses: the plant has them, the model does not
    blade_level: bool = False    # the plant's law is not the model's
    drawn: dict = None           # what diagnose_sensor_cases.py draws for each seed
    says: str = ""               # words that the checks must have for the log


def toml(path):
    return tomllib.loads(pathlib.Path(path).read_text(encoding="utf-8"))


def change_for(effect, study, in_plant, nominal):
    """(entries, unmodelled) that make this effect one that the vehicle file does not know: what the file holds it loses, and the plant
    gets the effect, unless it has it by itself."""
    key, name = effect["parameter"], effect["id"]
    unmodelled = (name,) if name in nominal else ()
    if name in in_plant and unmodelled:
        return (), unmodelled
    return ((name, {key: study["size"].get(name, effect["typical_value"]), **study["option"].get(name, {})}),), unmodelled


def cases(study, catalogue, drawn=None):
    effects = {e["id"]: e for e in catalogue["effect"] if e["plant"]}
    in_plant = {e["id"] for e in toml(ROOT / study["plant"]).get("effect", [])}
    nominal = {e["id"] for e in toml(ROOT / study["vehicle"]).get("effect", [])}

    def case(name, kind, ids, **more):
        parts = [change_for(effects[i], study, in_plant, nominal) for i in ids]
        entries, unmodelled = (tuple(x for p in parts for x in p[k]) for k in range(2))
        return Case(**{"name": name, "kind": kind, "truth": tuple(ids), "entries": entries, "unmodelled": unmodelled, **more})

    clean = [Case("clean_full", "clean_full"), Case("clean_reduced", "clean_reduced")]
    if drawn:
        return [*sensors.all_cases(drawn, case), *clean]
    if strangers := set(study["blade_level"]) - set(effects):
        sys.exit(f"{STUDY}: blade_level: {', '.join(sorted(strangers))}: no effect of the plant")
    singles = [case(i, study["class"].get(i, e["class"]), [i]) for i, e in effects.items()]
    out = [dataclasses.replace(c, blade_level=c.name in study["blade_level"]) for c in singles]
    out += [case("+".join(p["effects"]), "pair", p["effects"]) for p in study["pair"]]
    out += [Case(f["id"], "foreign", (), ((f["id"], {k: v for k, v in f.items() if k != "id"}),)) for f in study["foreign"]]
    return [*out, *clean]


def blocks(text):
    """A TOML file as the lines before its first [[…]] and those of each such block."""
    out = [[]]
    for line in text.splitlines():
        if line.startswith("["):
            out.append([])
        out[-1].append(line)
    return ["\n".join(b) + "\n" for b in out]


def plant_text(entries, study):
    source = ROOT / study["plant"]
    text = source.read_text(encoding="utf-8").replace('"blades/', f'"{source.parent}/blades/').replace('"motors/', f'"{source.parent}/motors/')
    gone = {i for i, _ in entries}
    kept = [b for b in blocks(text) if not (b.startswith("[[effect]]") and tomllib.loads(b)["effect"][0]["id"] in gone)]
    for name, values in entries:
        kept.append(f'\n[[effect]]\nid = "{name}"\n' + "".join(f"{k} = {v}\n" for k, v in values.items()))
    return "".join(kept)


def write_nominal(path, case, vehicle):
    """The vehicle file without the terms that the case takes from it; covariance blocks lose their rows."""
    out = []
    for b in blocks(vehicle.read_text(encoding="utf-8")):
        if b.startswith("[[effect]]") and tomllib.loads(b)["effect"][0]["id"] in case.unmodelled:
            continue
        if b.startswith("[[covariance]]") and any(f"effect.{i}" in b for i in case.unmodelled):
            c = tomllib.loads(b)["covariance"][0]
            keep = [k for k, n in enumerate(c["of"]) if not any(n.startswith(f"effect.{i}") for i in case.unmodelled)]
            n = len(c["of"])
            if len(keep) < 2:
                continue
            names = ", ".join(f'"{c["of"][k]}"' for k in keep)
            matrix = ", ".join(repr(c["matrix"][i * n + k]) for i in keep for k in keep)
            b = f"[[covariance]]\nof = [{names}]\nmatrix = [{matrix}]\n\n"
        out.append(b)
    path.write_text("".join(out), encoding="utf-8")


def run(words, log, limit_s):
    """Exit code, seconds by the clock and of CPU, of a command; what it prints goes to `log`."""
    before = time.monotonic()
    with open(log, "w", encoding="utf-8") as out, open(f"{log}.err", "w", encoding="utf-8") as err:
        child = subprocess.Popen([str(w) for w in words], stdout=out, stderr=err)
        late = False
        while not (ended := os.wait4(child.pid, os.WNOHANG))[0]:  # wait4 alone knows the CPU of this child and no other
            if not late and time.monotonic() - before > limit_s:
                late = True
                child.kill()
            time.sleep(0.05)
    _, status, used = ended
    child.returncode = 124 if late else os.waitstatus_to_exitcode(status)
    return child.returncode, time.monotonic() - before, used.ru_utime + used.ru_stime


def entries_of(case, seed):
    return (*case.entries, *(sensors.entries(case, seed) if case.drawn else ()))


def write_scenario(folder, name, entries, study):
    """Plant and scenario of a trial; returns the scenario's text."""
    plant, source = folder / f"plant{name}.toml", ROOT / study["scenario"]
    plant.write_text(plant_text(entries, study), encoding="utf-8")
    text = source.read_text(encoding="utf-8").replace(f'"../{study["plant"]}"', f'"{plant}"')
    text = text.replace('"../', f'"{ROOT}/').replace('"trajectories/', f'"{source.parent}/trajectories/')
    (folder / f"scenario{name}.toml").write_text(text, encoding="utf-8")
    return text


def fly(case, seed, folder, o, study):
    """Logs of the three flights and how each ended."""
    if case.kind == "clean_reduced":
        code, *_ = run([MODEL_TRUE, "--seed", seed, "--out", folder], folder / "fly.txt", 300)
        return sorted(folder.glob("*.csv")), {"model true": "completed" if code == 0 else f"exit {code}"}
    text = write_scenario(folder, "", entries_of(case, seed), study)
    if case.drawn:
        write_scenario(folder, "_without", case.entries, study)
    logs, ends = [], {}
    names = [f["name"] for f in tomllib.loads(text)["flight"]]
    for i, (flight, acts) in enumerate(sensors.flights(case, seed, names)):
        # Gusts and noise of one flight are not those of the next. A motor that does not start is started again, as at the field.
        name = flight if i < len(names) else f"{flight}_again"
        for attempt in range(3):
            own_seed, out = 100 * seed + 10 * i + attempt, folder / "flights" / name
            run([o.out / "rotorloop", "hil", folder / f"scenario{'' if acts else '_without'}.toml", "--flights", flight, "--seeds", f"{own_seed},", "--out",
                 folder / "flights", "--name", name, "--force", "-q", "-j", 1], folder / f"fly_{name}.txt", 300)
            flown = json.loads((out / "result.json").read_text(encoding="utf-8"))["flights"][0]
            if "did not start" not in flown.get("end_detail", ""):
                break
        ends[name] = flown["end"]
        logs.append(out / flight / flown["variant"] / str(own_seed) / "flight.csv")
    return logs, ends


def drawn_text(case, seed, study):
    """What decides the logs of a trial beside its plant: the drawn case, and which flights are flown with it."""
    names = [f["name"] for f in toml(ROOT / study["scenario"])["flight"]]
    return json.dumps({"seed": seed, "drawn": case.drawn, "flights": sensors.flights(case, seed, names)}, sort_keys=True, indent=1) + "\n"


def holds(path, text):
    return path.exists() and path.read_text(encoding="utf-8") == text


def logs_of(case, seed, folder, o, study):
    """The flights of a trial, flown when they are not there yet: paths of their logs, and how each ended."""
    flown, drawn = folder / "flown.json", folder / "drawn.json"
    same = holds(drawn, drawn_text(case, seed, study)) and (
        case.kind == "clean_reduced" or holds(folder / "plant.toml", plant_text(entries_of(case, seed), study)))
    if not (flown.exists() and same):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        logs, ends = fly(case, seed, folder, o, study)
        for i, log in enumerate(logs):
            sensors.spoil(log.rename(folder / f"{i + 1}.csv"), case, seed)
        shutil.rmtree(folder / "flights", ignore_errors=True)
        drawn.write_text(drawn_text(case, seed, study), encoding="utf-8")
        flown.write_text(json.dumps(ends) + "\n", encoding="utf-8")
    return sorted(folder.glob("?.csv")), json.loads(flown.read_text(encoding="utf-8"))


def trial(case, seed, o, study):
    folder = (o.out / case.name / str(seed)).resolve()
    done = folder / "trial.json"
    if done.exists():
        return
    logs, ends = logs_of(case, seed, folder, o, study)
    if o.fly_only:
        print(f"{case.name} {seed}: {ends}", file=sys.stderr, flush=True)
        return
    vehicle = ROOT / study["vehicle"]
    if case.kind == "clean_reduced":
        vehicle = ROOT / study["vehicle_reduced"]
    elif case.unmodelled:
        write_nominal(folder / "nominal.toml", case, vehicle)
        vehicle = folder / "nominal.toml"
    code, wall_s, cpu_s = run([o.out / "rotorloop", "diagnose", "--vehicle", vehicle, *sum((["--flight", log] for log in logs), []), *DIAGNOSE],
                       folder / "result.json", 3600)
    record = {"case": case.name, "kind": case.kind, "truth": case.truth, "seed": seed, "says": case.says, "ends": ends, "exit": code, "wall_s": round(wall_s, 1), "cpu_s": round(cpu_s, 1)}
    if not o.keep_logs:
        for log in logs:
            log.unlink()
        (folder / "flown.json").unlink()
    done.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"{case.name} {seed}: {diagnose_score.in_words(folder)}", file=sys.stderr, flush=True)


def seed_list(text):
    """"1..10", "3,5" or "4"."""
    out = []
    for part in text.split(","):
        low, _, high = part.partition("..")
        out += range(int(low), int(high or low) + 1)
    return out


def main():
    parser = argparse.ArgumentParser(prog="scripts/stats diagnose", description="which effects `rotorloop diagnose` finds in simulated flights")
    parser.add_argument("--seeds", type=seed_list, default=seed_list("501..510"), help="1..10 or 3,5")
    parser.add_argument("--sensors", action="store_true", help="errors of sensors and logs, foreign physics in a part of the flights (diagnose_sensors.toml)")
    parser.add_argument("--clean-seeds", type=seed_list, help="of the two clean controls; default: --seeds")
    parser.add_argument("--only", type=lambda t: t.split(","), help="these cases, by name or kind")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/stats/diagnose")
    parser.add_argument("--program", type=pathlib.Path, default=BUILT, help="rotorloop to use; a study that is resumed keeps the one that lies in its folder")
    parser.add_argument("--jobs", "-j", type=int, default=2)
    parser.add_argument("--table", type=pathlib.Path, help="page to write, as docs/acceptance/diagnose_hil.md")
    parser.add_argument("--fly-only", action="store_true", help="how the flights end, without a diagnosis")
    parser.add_argument("--keep-logs", action="store_true", help="20 MB for each trial: remove trial.json, and only the diagnosis is made again")
    parser.add_argument("--score-only", action="store_true", help="judge what is there")
    o = parser.parse_args()
    study, catalogue = toml(STUDY), toml(ROOT / "effects/catalogue.toml")
    wanted = [c for c in cases(study, catalogue, toml(SENSORS) if o.sensors else None) if not o.only or c.name in o.only or c.kind in o.only]
    if not wanted:
        sys.exit(f"error: no case is called {o.only}\n  do: take an effect's id, or a kind: separable, pair, foreign, clean_full, …")
    if not o.score_only:
        o.out = o.out.resolve()
        o.out.mkdir(parents=True, exist_ok=True)
        if not (o.out / "rotorloop").exists():  # the whole study with one program, whatever is built until it is resumed
            shutil.copy2(o.program, o.out / "rotorloop")
        clean_seeds = o.clean_seeds or o.seeds
        # All cases of one seed before the next seed: a study that is stopped has judged every case equally often.
        work = [(c, s) for s in sorted({*o.seeds, *clean_seeds}) for c in wanted if s in (clean_seeds if c.kind.startswith("clean") else o.seeds)]
        with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
            for future in [pool.submit(trial, c, s, o, study) for c, s in work]:
                future.result()
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(f"{used.ru_utime + used.ru_stime:.0f} s of CPU", file=sys.stderr)
    if o.fly_only:
        return 0
    page, missed = diagnose_score.page(o.out, wanted, diagnose_score.HEAD_SENSORS if o.sensors else diagnose_score.HEAD)
    if o.table:
        o.table.write_text(page, encoding="utf-8")
    print(page)
    return 6 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
