"""Tracking without and with added terms, paired over seeds: see scripts/effects_in_control. Uses the command line of rotorloop alone.

The terms are written by hand here, at the plant's true size or a given factor of it, so that the controller alone is judged;
`rotorloop close` does the same with terms that a diagnosis found.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys

ROTORLOOP = "build/release/bin/rotorloop"
PLANT, VEHICLE = "vehicles/reference_plant.toml", "vehicles/calibrated.toml"
WITHOUT, WITH = "pd_ff_no_effects", "pd_ff_thrust_drag"
NO_WORSE_CM = 0.1  # a flight that the effect does not touch may lose this much: a tenth of what the pose drifts
T_95 = {1: 12.706, 2: 4.303, 3: 3.182, 4: 2.776, 5: 2.571, 6: 2.447, 7: 2.365, 8: 2.306, 9: 2.262}  # Student, two-sided

TRAJECTORIES = {"horizontal": ("horizontal_8p5", "mean_3d"), "vertical": ("vertical_3p1", "mean_z"),
                "general": ("general", "mean_3d"), "low_hover": ("low_hover", "mean_z")}

# A load of 0.1 kg, 30 mm ahead of the centre: the centre of mass moves by 0.1 * (30 mm - 1.4 mm) / 0.782.
PAYLOAD_KG, PAYLOAD_X_M, PLANT_KG, PLANT_COM_X_M = 0.1, 0.03, 0.682, 0.0014
PAYLOAD_DX_M = PAYLOAD_KG * (PAYLOAD_X_M - PLANT_COM_X_M) / (PLANT_KG + PAYLOAD_KG)

# name: what the plant has, what the vehicle file says, flights in which it must help, flights that it must leave alone
CASES = {
    "aft-rotor wake": ({"rotor_wake_interference": {"kappa": 0.35}}, {"rotor_wake_interference": {"kappa": 0.35}}, ["horizontal"], ["low_hover"]),
    "ground effect": ({"ground_effect_vehicle": {"gain": 1.0}}, {"ground_effect_vehicle": {"gain": 1.0}}, ["low_hover"], ["vertical"]),
    "payload that shifts the centre of mass": (
        {"payload_mass": {"mass_kg": PAYLOAD_KG, "x_m": PAYLOAD_X_M}},
        {"payload_mass": {"mass_kg": PAYLOAD_KG}, "com_offset": {"dx_m": PAYLOAD_DX_M}}, ["low_hover", "horizontal"], []),
    "strut blockage": ({"blockage_strut": {"loss": 0.08}}, {"blockage_strut": {"loss": 0.08}}, ["vertical", "horizontal"], []),
}


def say(text):
    print(text, file=sys.stderr, flush=True)


def with_effects(base, effects, vehicle):
    """The text of a plant or vehicle file with further [[effect]]s at its end."""
    text = pathlib.Path(base).read_text(encoding="utf-8")
    for name, parameters in effects.items():
        text += f'\n[[effect]]\nid = "{name}"\n'
        for key, value in parameters.items():
            text += f'parameter.{key} = {{ value = {value!r}, u = 0.0, origin = "guess" }}\n' if vehicle else f"{key} = {value!r}\n"
    return text


def scenario_text(plant, vehicle, flights):
    root = pathlib.Path.cwd()
    text = f'format = 1\nname = "effects in control"\nplant = "{plant}"\nvehicle = "{vehicle}"\nseeds = [1]\n'
    text += f'variants = ["{WITHOUT}", "{WITH}"]\n[controller]\ngains = "{root / "vehicles/gains.toml"}"\n'
    for f in flights:
        text += f'[[flight]]\nname = "{f}"\ntrajectory = "{root / "scenarios/trajectories" / (TRAJECTORIES[f][0] + ".toml")}"\n'
    return text


def scaled(effects, factor):
    return {name: {key: value * factor for key, value in parameters.items()} for name, parameters in effects.items()}


def fly(out, case, factor, flights, seeds, jobs):
    """result.json of this case; not flown again when it is there and complete."""
    plant_effects, vehicle_effects, _, _ = CASES[case]
    folder = out / f"{case.replace(' ', '_')}_{factor:g}"
    done = folder / "run" / "result.json"
    if done.exists() and json.loads(done.read_text(encoding="utf-8"))["seeds"] == seeds:
        return json.loads(done.read_text(encoding="utf-8"))
    folder.mkdir(parents=True, exist_ok=True)
    # Plant files name others relative to themselves, so the changed ones lie beside the originals' copies by absolute paths.
    vehicles = (pathlib.Path.cwd() / "vehicles").as_posix()
    plant = with_effects(PLANT, plant_effects, vehicle=False).replace('"blades/', f'"{vehicles}/blades/').replace('"motors/', f'"{vehicles}/motors/')
    (folder / "plant.toml").write_text(plant, encoding="utf-8")
    (folder / "vehicle.toml").write_text(with_effects(VEHICLE, scaled(vehicle_effects, factor), vehicle=True), encoding="utf-8")
    (folder / "scenario.toml").write_text(scenario_text("plant.toml", "vehicle.toml", flights), encoding="utf-8")
    words = ["hil", folder / "scenario.toml", "--seeds", ",".join(map(str, seeds)) + ",", "--out", folder, "--name", "run", "--force", "-q", "-j", jobs]
    say("rotorloop " + " ".join(map(str, words)))
    with open(folder / "log.txt", "w", encoding="utf-8") as log:
        status = subprocess.run([ROTORLOOP, *map(str, words)], stdout=log, stderr=subprocess.STDOUT, check=False).returncode
    if status not in (0, 6, 7):
        sys.exit(f"error: rotorloop ended with {status}; see {folder / 'log.txt'}")
    return json.loads(done.read_text(encoding="utf-8"))


def errors_cm(result, flight, variant):
    axis = TRAJECTORIES[flight][1]
    return {f["seed"]: f["error_cm"][axis] for f in result["flights"]
            if f["flight"] == flight and f["variant"] == variant and f["end"] == "completed"}


def counted(result):
    """What the controller counted over all flights with terms, as words; empty when nothing."""
    names = ["effects_not_finite", "effects_bounded", "effects_not_converged"]
    sums = {n: sum(f["counters"][f"control.{n}"] for f in result["flights"] if f["variant"] == WITH) for n in names}
    return ", ".join(f"{n} {v:.0f}" for n, v in sums.items() if v)


def mean(values):
    return sum(values) / len(values)


def paired(before, after):
    """Mean of after - before over common seeds, and half of its 95 % interval."""
    seeds = sorted(set(before) & set(after))
    d = [after[s] - before[s] for s in seeds]
    m = mean(d)
    half = T_95[len(d) - 1] * math.sqrt(sum((x - m) ** 2 for x in d) / (len(d) - 1) / len(d)) if len(d) > 1 else math.nan
    return m, half, len(d)


def seed_list(text):
    out = []
    for part in text.split(","):
        low, _, high = part.partition("..")
        out += range(int(low), int(high or low) + 1)
    return out


def main():
    parser = argparse.ArgumentParser(prog="scripts/effects_in_control", description="tracking without and with the vehicle file's effects")
    parser.add_argument("--seeds", type=seed_list, default=seed_list("1..6"), help="1..6 or 1,4; at least two, at most ten")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("runs/effects_in_control"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--factor", type=float, default=1.0, help="the vehicle file's parameters over the plant's")
    parser.add_argument("--cases", help="only these, by a part of their names: wake,strut")
    o = parser.parse_args()

    print("| plant has | flight | without, cm | with, cm | difference, cm (95 %) | limit | met |\n| --- | --- | --- | --- | --- | --- | --- |")
    missed = False
    for case, (_, _, helped, untouched) in CASES.items():
        if o.cases and not any(part in case for part in o.cases.split(",")):
            continue
        result = fly(o.out, case, o.factor, helped + untouched, o.seeds, o.jobs)
        for flight in helped + untouched:
            before, after = errors_cm(result, flight, WITHOUT), errors_cm(result, flight, WITH)
            m, half, n = paired(before, after)
            limit = 0.0 if flight in helped else NO_WORSE_CM
            met = n == len(o.seeds) and m + half < limit
            missed |= not met
            axis = "\\|z\\|" if TRAJECTORIES[flight][1] == "mean_z" else "3-D"
            print(f"| {case} | {flight} ({axis}) | {mean(before.values()):.2f} | {mean(after.values()):.2f} | {m:+.2f} ± {half:.2f} (n {n}) | "
                  f"{'below 0' if flight in helped else f'below +{NO_WORSE_CM}'} | {'yes' if met else '**no**'} |", flush=True)
        if words := counted(result):
            print(f"| | counted: {words} | | | | | |", flush=True)
    sys.exit(6 if missed else 0)


if __name__ == "__main__":
    main()
