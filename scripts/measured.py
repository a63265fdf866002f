"""Diagnoses of measured flights, one command each, and their figures against the limits; see scripts/measured."""
import argparse
import csv
import hashlib
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tomllib

import loop_page

ROOT = pathlib.Path(__file__).resolve().parent.parent
VEHICLES = ROOT / "vehicles/measured"
OUT = ROOT / "runs/measured"
PLACEBOS = ["--placebos", "50"]
REFUSED = 5  # exit code


class Run:
    """One command of rotorloop in a folder of its own: result.json of a diagnosis, and the vehicle file that it wrote."""

    def __init__(self, rotorloop, name, command, arguments, needs_vehicle=True):
        self.folder = OUT / name
        self.vehicle = self.folder / "vehicle.toml"
        done, made_by = self.folder / "done", self.folder / "made_by"
        program = hashlib.sha256(pathlib.Path(rotorloop).read_bytes()).hexdigest()
        line = [str(rotorloop), command, *map(str, arguments)]
        if needs_vehicle:
            line += ["-o", str(self.vehicle)]
        if command == "diagnose":
            line += ["--report", str(self.folder)]
        shown = " ".join(["rotorloop", *line[1:]]).replace(str(ROOT) + "/", "").replace(os.environ["ROTORLOOP_DATA"], "$ROTORLOOP_DATA")
        print(f"\n{name}: {shown}", flush=True)
        self.shown = shown
        if not (done.exists() and made_by.exists() and made_by.read_text() == program):
            done.unlink(missing_ok=True)
            self.folder.mkdir(parents=True, exist_ok=True)
            for old in (self.folder / "result.json", self.folder / "report.html", self.vehicle):
                old.unlink(missing_ok=True)
            before = os.times()
            with open(self.folder / "stdout", "w") as out, open(self.folder / "stderr", "w") as err:
                code = subprocess.run(line, stdout=out, stderr=err).returncode
            after = os.times()
            # A diagnosis whose vehicle is refused has found all the same what it found.
            if code not in (0, REFUSED) or not (self.vehicle.exists() or (self.folder / "result.json").exists()):
                sys.exit(f"{name} failed with exit code {code}:\n{(self.folder / 'stderr').read_text()[-1500:]}")
            made_by.write_text(program)
            done.write_text(f"{after.children_user - before.children_user:.0f} s of one core\n")
        print(f"  {done.read_text().strip()}")
        path = self.folder / "result.json"
        self.result = json.loads(path.read_text()) if path.exists() else None
        if self.result:
            self.print_verdict()

    def print_verdict(self):
        print(f"  verdict: {self.result['verdict']}")
        for a in self.result["added"]:
            sizes = ", ".join(f"{p['name']} {p['value']:.4g} ± {p['u']:.2g} {p['unit']}" for p in a["parameters"])
            others = "; or " + ", ".join(t["id"] for t in a["twins"]) if a["twins"] else ""
            print(f"    {a['id']}: {sizes} (W {a['evidence']['wald']:.0f}){others}")
            for r in a["ratios"]:
                print(f"      determined: {r['name']} {r['value']:.4g} ± {r['u']:.2g}")
        for r in self.result["rejected"]:
            print(f"    tried and taken out again: {r['id']}: {r['ruled_out_by']}")

    def added(self, effect):
        """Parameters of an effect that was added, alone or as a member of a class; None when it was not."""
        for a in self.result["added"]:
            if a["id"] == effect:
                return {p["name"]: p["value"] for p in a["parameters"]}
        return None

    def ratio(self, effect, name):
        """Ratio of an added effect's parameter to a scale of the vehicle, and its u, where the flights determine it better than either alone."""
        for a in self.result["added"]:
            for r in a["ratios"] if a["id"] == effect else []:
                if r["name"] == name:
                    return r["value"], r["u"]
        return None

    def wrench(self, which):
        return self.result["held_out"]["wrench"][which]

    def value(self, *keys):
        with open(self.vehicle, "rb") as f:
            at = tomllib.load(f)
        for k in keys:
            at = at[k]
        return at["value"]

    def effect(self, name, parameter):
        with open(self.vehicle, "rb") as f:
            for e in tomllib.load(f).get("effect", []):
                if e["id"] == name:
                    return e["parameter"][parameter]["value"]
        return None


class Verdicts:
    def __init__(self):
        self.missed = 0

    def row(self, what, value, limit, met):
        self.missed += not met
        print(f"  {'met   ' if met else 'MISSED'}  {what}: {value} (limit {limit})", flush=True)


def flights(data, dataset, names):
    return [data / "flights" / dataset / f"{n}.csv" for n in names]


def yaw(run, verdicts, least, ratio):
    """Yaw as published: 1 to 10 Hz, streams of each flight aligned."""
    found = run.added("rotor_inertia_reaction")
    verdicts.row("rotor_inertia_reaction", "found" if found else "not found", "found", bool(found))
    plain, aligned = run.wrench("after")[-1], run.wrench("after_aligned")[-1]
    was, was_aligned = run.wrench("before")[-1], run.wrench("before_aligned")[-1]
    print(f"  yaw R² as stamped {was['explained'][5]:.3f} -> {plain['explained'][5]:.3f}; roll and pitch aligned "
          f"{was_aligned['explained'][3]:.3f}, {was_aligned['explained'][4]:.3f} -> {aligned['explained'][3]:.3f}, {aligned['explained'][4]:.3f}")
    r2 = aligned["explained"][5]
    verdicts.row("yaw R² of held-out flights, aligned", f"{was_aligned['explained'][5]:.3f} -> {r2:.3f}", f">= {least}", r2 >= least)
    if not found:
        return
    # Yaw determines this ratio; J_r and J_z themselves only as far as the vehicle file's inertia does.
    firm = run.ratio("rotor_inertia_reaction", "J_r_kg_m2 / I_zz")
    if firm:
        got, text = firm[0], f"{firm[0]:.3e} ± {firm[1]:.1e}"
    elif run.vehicle.exists():
        got = found["J_r_kg_m2"] / run.value("body", "inertia_kg_m2", "zz")
        text = f"{got:.3e} of J_r {found['J_r_kg_m2']:.3e} kg m²"
    else:
        verdicts.row("J_r/J_z", "not determined better than J_r, and no vehicle file", f"{ratio} ± 15 %", False)
        return
    if ratio:
        verdicts.row("J_r/J_z", f"{text}, {100 * (got / ratio - 1):+.1f} %", f"{ratio} ± 15 %", abs(got / ratio - 1) <= 0.15)
    else:
        print(f"  J_r/J_z {text}")


def idsia(rotorloop, data, verdicts):
    """Both squares turn about z as quick as the vehicle can; the streams of each run are off by its own 5 to 25 ms."""
    name = "idsia_nanodrone_cf21bl"
    run = Run(rotorloop, "idsia", "diagnose", [
        "--vehicle", VEHICLES / f"{name}.toml", "-m", VEHICLES / f"{name}.mapping.toml",
        "--flight", *flights(data, name, ["square_20251017_run2", "square_20251017_run3"]),
        "--held-out", *flights(data, name, ["square_20251017_run4", "multisine_20251017_run1", "multisine_20251017_run3",
                                            "random1_20251017_run3", "random2_20251017_run2", "melon_20251017_run1"]),
        "--use", "gyro", "--rate", "50", "--hold", "body.mass", "--hold", "pose_sensor", "--hold", "pose_delay",
        "--free", "rotor_delay", "--per-flight", "rotor_delay", "--max-effects", "2", *PLACEBOS, "--wrench-band", "1,10"],
        needs_vehicle=False)
    yaw(run, verdicts, 0.85, 1.07e-3)
    return run


# Indoors: no wind. The motion capture's origin and clock are taken as they are.
IMRC = ["--use", "gyro,accel", "--rate", "50", "--hold", "pose_sensor.offset", "--hold", "pose_delay", "--free", "rotor_delay",
        "--hold", "drag.c_dz", "--without", "wind_steady", "--without", "wind_shear", *PLACEBOS]


def bare(rotorloop, data):
    name = "imrc_cf21bl_bare"
    return Run(rotorloop, "imrc", "diagnose", [
        "--vehicle", VEHICLES / f"{name}.toml", "-m", VEHICLES / f"{name}.mapping.toml",
        "--flight", *flights(data, name, ["eckart00", "eckart17", "eckart30", "eckart34"]),
        "--held-out", *flights(data, name, ["eckart07", "eckart12", "eckart22", "eckart24", "eckart27"]),
        "--hold", "body.mass", "--free", "body.inertia.zz=9e-6", "--max-effects", "3", "--wrench-band", "1,10", *IMRC])


def imrc(rotorloop, data, verdicts):
    run = bare(rotorloop, data)
    yaw(run, verdicts, 0.70, None)
    verdicts.row("vehicle file", "written" if run.vehicle.exists() else "refused: " + "; ".join(run.result["errors"])[:160], "written", run.vehicle.exists())
    return run


def load(rotorloop, data, verdicts):
    """What the bare flights say of the vehicle is what its file knows; the loaded one weighs 39.7 g without its load."""
    name, truth_kg = "imrc_cf21bl_payload", 4.7e-3
    nominal = OUT / "load_nominal.toml"
    known = bare(rotorloop, data).vehicle
    if not known.exists():
        verdicts.row("vehicle file of the bare flights, for those with the load", "refused", "written", False)
        return
    text = known.read_text()
    nominal.write_text(re.sub(r"(?m)^mass_kg = .*", 'mass_kg = { value = 0.0397, u = 0.0005, origin = "cad" }', text))
    flown = ["--flight", *flights(data, name, ["eckart29", "eckart43", "eckart45", "eckart67", "eckart68"]),
             "--held-out", *flights(data, name, ["eckart17", "eckart30"]), "--wrench-band", "0,6", *IMRC]
    mapping = ["-m", VEHICLES / f"{name}.mapping.toml"]
    # They hardly turn about z: inertia and torque there run off together, to a vehicle that no file may hold.
    found = Run(rotorloop, "load", "diagnose", ["--vehicle", nominal, *mapping, *flown, "--hold", "body.mass", "--max-effects", "2"],
                needs_vehicle=False)
    load_kg = (found.added("slung_load") or {}).get("mass_kg")
    verdicts.row("slung_load without payload columns", "found" if load_kg else "not found", "found", bool(load_kg))
    if not load_kg:
        return
    verdicts.row("mass of the load", f"{1e3 * load_kg:.2f} g, {100 * (load_kg / truth_kg - 1):+.1f} %", "4.7 g ± 20 %",
                 abs(load_kg / truth_kg - 1) <= 0.2)


NEUROBEM = {"figure8_1_20210218_170320_seg2": 0.30, "race_track_1_20210218_171908_seg2": 0.30, "melon_1_20210223_114138_seg3": 0.30,
            "figure8_4_20210223_172724_seg2": 0.15}


def neurobem(rotorloop, data, verdicts):
    """Each flight is predicted by the three others. The loop's page tells of the last, the fastest."""
    name = "neurobem_test"
    torque2 = force2 = samples = 0.0
    for held, least in NEUROBEM.items():
        run = Run(rotorloop, f"neurobem_without_{held.split('_2021')[0]}", "diagnose", [
            "--vehicle", VEHICLES / f"{name}.toml", "-m", VEHICLES / f"{name}.mapping.toml",
            "--flight", *flights(data, name, [f for f in NEUROBEM if f != held]), "--held-out", *flights(data, name, [held]),
            "--rate", "50", "--use", "gyro,accel", "--hold", "body.mass", "--hold", "pose_sensor", "--hold", "pose_delay",
            "--without", "wind_steady", "--without", "wind_shear", "--without", "wind_dryden",  # indoors
            *PLACEBOS, "--wrench-band", "0,0"], needs_vehicle=False)
        b, a = run.wrench("before")[-1], run.wrench("after")[-1]
        force = lambda s: math.hypot(*s["rms"][:3])
        torque = lambda s: math.hypot(*s["rms"][3:])
        print(f"  torque {torque(b):.4f} -> {torque(a):.4f} N m")
        gain = 1.0 - force(a) / force(b)
        verdicts.row(f"force error of {held}", f"{force(b):.3f} -> {force(a):.3f} N, {-100 * gain:+.0f} %", f"-{100 * least:.0f} %", gain >= least)
        moment = [x["id"] for x in run.result["added"] if x["id"] in
                  ("hub_moment", "induced_flow_moment", "rotor_plane_height", "blade_flapping", "body_pitch_moment", "rotor_wake_interference")]
        verdicts.row("moment that grows with speed", ", ".join(moment) or "not found", "named", bool(moment))
        torque2 += a["samples"] * torque(a) ** 2
        force2 += a["samples"] * force(a) ** 2
        samples += a["samples"]
    pooled = math.sqrt(torque2 / samples)
    verdicts.row("torque error, four flights in one pot", f"{pooled:.4f} N m", "0.0185 N m", pooled <= 0.0185)
    print(f"  force error, four flights in one pot: {math.sqrt(force2 / samples):.3f} N")
    return run


# What flights of up to 17.7 m/s ask for beyond eq. 1-5 (docs/acceptance/diagnose_measured.md), with the width of its prior about "not there".
# The longitudinal pair is held: no flight turned its tail into the wind long enough.
FAST_TERMS = {"induced_flow_moment": {"k_roll_N_s2_m": 1e-3, "k_pitch_N_s2_m": 1e-3},
              "rotor_pair_interaction": {"kappa_lateral": 0.5, "kappa_longitudinal": 0.5, "kappa_diagonal": 0.5},
              "thrust_speed_cubed": {"k3_N_s3": 3e-10},
              "rotor_drag_with_inflow": {"k_N_s2_m2": 0.01},
              "rotor_drag_with_speed": {"k_d_N_s2_m": 1e-4}}
# Force of the same flights by a diagnosis from the file without them, N.
PLAIN_FORCE_N = {"figure8_1": 0.426, "race_track_1": 0.864, "melon_1": 0.513, "figure8_4": 2.361}
# Inertia that the motors' moments at 8 to 18 Hz ask for, where air turns nothing.
BAND_INERTIA_KG_M2 = {"xx": 0.0033, "yy": 0.0032}


def fast_vehicle(name, inertia):
    text = (VEHICLES / "neurobem_test.toml").read_text()
    for axis, value in inertia.items():
        text = re.sub(rf"(?m)^inertia_kg_m2.{axis} = {{ value = [0-9.]+", f"inertia_kg_m2.{axis} = {{ value = {value}", text)
    lines = []
    for effect, parameters in FAST_TERMS.items():
        lines += ["[[effect]]", f'id = "{effect}"']
        lines += [f'parameter.{k} = {{ value = 0.0, u = {u}, origin = "guess" }}' for k, u in parameters.items()] + [""]
    out = OUT / f"{name}.toml"
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(text.replace("[provenance]", "\n".join(lines) + "\n[provenance]"))
    return out


def trivial_rows(data):
    """Thrust in proportion to the square of rotor speed (from the other three flights), no torque, and the published BEM + network."""
    mass_kg, inertia = 0.752, (0.0025, 0.0021, 0.0043)
    sums = {}
    for name in NEUROBEM:
        with open(flights(data, "neurobem_test", [name])[0], newline="", encoding="utf-8") as f:
            rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)]
        s = {"n": len(rows), "aa": 0.0, "ab": 0.0, "bb": 0.0, "zero": 0.0, "nn_f": 0.0, "nn_t": 0.0, "across": 0.0}
        for r in rows:
            squares, f_z = sum(r[f"mot{i}"] ** 2 for i in range(1, 5)), mass_kg * r["az"]
            s["aa"] += squares * squares
            s["ab"] += squares * f_z
            s["bb"] += f_z * f_z
            s["across"] += (mass_kg * r["ax"]) ** 2 + (mass_kg * r["ay"]) ** 2
            torque = [j * r[f"dw{a}"] for j, a in zip(inertia, "xyz")]
            s["zero"] += sum(t * t for t in torque)
            s["nn_t"] += sum((t - r[f"bemnn_m{a}"]) ** 2 for t, a in zip(torque, "xyz"))
            s["nn_f"] += sum((mass_kg * r[f"a{a}"] - r[f"bemnn_f{a}"]) ** 2 for a in "xyz")
        sums[name] = s
    n = sum(s["n"] for s in sums.values())
    quadratic = 0.0
    for held, s in sums.items():
        c = sum(o["ab"] for k, o in sums.items() if k != held) / sum(o["aa"] for k, o in sums.items() if k != held)
        quadratic += s["across"] + s["bb"] - 2.0 * c * s["ab"] + c * c * s["aa"]
    rms = lambda key: math.sqrt(sum(s[key] for s in sums.values()) / n)
    print(f"  beside it: no torque {rms('zero'):.4f} N m; thrust quadratic in rotor speed {math.sqrt(quadratic / n):.3f} N; "
          f"published BEM + network {rms('nn_f'):.3f} N, {rms('nn_t'):.4f} N m")


def fast_folds(rotorloop, data, label, inertia, more, band="0,0"):
    """Rows of each flight, predicted by a fit of the three others; torques in units of the file's own inertia."""
    vehicle = fast_vehicle(label, inertia)
    own = {"xx": 0.0025, "yy": 0.0021}
    scale = [own[a] / inertia.get(a, own[a]) for a in ("xx", "yy")] + [1.0]
    out = {}
    for held in NEUROBEM:
        short = held.split("_2021")[0]
        run = Run(rotorloop, f"{label}_without_{short}", "diagnose", [
            "--vehicle", vehicle, "-m", VEHICLES / "neurobem_test.mapping.toml",
            "--flight", *flights(data, "neurobem_test", [f for f in NEUROBEM if f != held]),
            "--held-out", *flights(data, "neurobem_test", [held]),
            "--rate", "50", "--use", "gyro,accel", "--hold", "body.mass", "--hold", "pose_sensor.rotation", "--hold", "pose_delay",
            "--free", "rotor_delay", "--free", "imu_place", "--hold", "effect.rotor_pair_interaction.kappa_longitudinal", *more,
            "--max-effects", "0", "--placebos", "0", "--wrench-band", band], needs_vehicle=False)
        rows = run.result["held_out"]["wrench"]["after"]
        here, there = rows[0], rows[1]
        out[short] = (here["samples"], math.hypot(*here["rms"][:3]), math.hypot(*there["rms"][:3]),
                      math.hypot(*(k * t for k, t in zip(scale, here["rms"][3:]))))
        print("  force {:.3f} N, with predicted angular acceleration {:.3f} N; torque {:.4f} N m".format(*out[short][1:]))
    return out


def pooled(folds, which):
    return math.sqrt(sum(f[0] * f[which] ** 2 for f in folds.values()) / sum(f[0] for f in folds.values()))


def neurobem_fast(rotorloop, data, verdicts):
    """Each flight predicted by the three others, by a model with the terms of fast flight; nothing further is looked for."""
    trivial_rows(data)
    free = fast_folds(rotorloop, data, "neurobem_fast", {}, [])
    force, there, torque = (pooled(free, k) for k in (1, 2, 3))
    verdicts.row("force error, four flights in one pot", f"{force:.3f} N", "0.75 N", force <= 0.75)
    verdicts.row("... with predicted angular acceleration", f"{there:.3f} N", "0.85 N", there <= 0.85)
    for name, f in free.items():
        change = f[1] / PLAIN_FORCE_N[name] - 1.0
        verdicts.row(f"force error of {name}", f"{PLAIN_FORCE_N[name]:.3f} -> {f[1]:.3f} N, {100 * change:+.0f} %", "-20 %", change <= -0.2)
    verdicts.row("torque error, four flights in one pot", f"{torque:.4f} N m", "0.030 N m", torque <= 0.030)
    # These accelerations were low-passed at 6 to 8 Hz before they were published: model and measurement both to 8 Hz.
    slow = pooled(fast_folds(rotorloop, data, "neurobem_fast_to_8_Hz", {}, [], "0,8"), 1)
    print(f"  force error, four flights in one pot, up to 8 Hz: {slow:.3f} N")
    held = fast_folds(rotorloop, data, "neurobem_fast_inertia", BAND_INERTIA_KG_M2, ["--hold", "body.inertia"])
    torque = pooled(held, 3)
    verdicts.row("... with the inertia of 8 to 18 Hz held", f"{torque:.4f} N m", "0.037 N m", torque <= 0.037)


def write_loop(name, run):
    """docs/acceptance/loop_NAME.md, as the program's result has it."""
    made = run.result["provenance"]
    text = loop_page.page(name, run.shown, f"rotorloop {made['version']} ({made['git']}).", run.result)
    (ROOT / f"docs/acceptance/loop_{name}.md").write_text(text, encoding="utf-8")


PARTS = {"idsia": idsia, "imrc": imrc, "load": load, "neurobem": neurobem, "neurobem_fast": neurobem_fast}
LOOPS = ("idsia", "imrc", "neurobem")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rotorloop", type=pathlib.Path, default=ROOT / "build/release/bin/rotorloop")
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--loop", action="store_true", help=f"write docs/acceptance/loop_PART.md, of {', '.join(LOOPS)}")
    o = parser.parse_args()
    if "ROTORLOOP_DATA" not in os.environ:
        print("ROTORLOOP_DATA is not set: no measured flights, nothing to diagnose", file=sys.stderr)
        return 2
    for p in o.parts:
        if p not in PARTS:
            parser.error(f"{p} is none of {', '.join(PARTS)}")
    verdicts = Verdicts()
    for name in o.parts or PARTS:
        run = PARTS[name](o.rotorloop, pathlib.Path(os.environ["ROTORLOOP_DATA"]), verdicts)
        if o.loop and name in LOOPS:
            write_loop(name, run)
    print(f"\n{verdicts.missed} limits missed")
    return 6 if verdicts.missed else 0


if __name__ == "__main__":
    sys.exit(main())
