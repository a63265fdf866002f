"""Diagnoses of measured flights, one command each, and their figures against the limits; see scripts/measured."""
import argparse
import hashlib
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
VEHICLES = ROOT / "vehicles/measured"
OUT = ROOT / "runs/measured"
PLACEBOS = ["--placebos", "50"]


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
        shown = " ".join(line).replace(str(ROOT) + "/", "").replace(os.environ["ROTORLOOP_DATA"], "$ROTORLOOP_DATA")
        print(f"\n{name}: {shown}", flush=True)
        if not (done.exists() and made_by.exists() and made_by.read_text() == program):
            done.unlink(missing_ok=True)
            self.folder.mkdir(parents=True, exist_ok=True)
            for old in (self.folder / "result.json", self.folder / "report.html", self.vehicle):
                old.unlink(missing_ok=True)
            before = os.times()
            with open(self.folder / "stdout", "w") as out, open(self.folder / "stderr", "w") as err:
                code = subprocess.run(line, stdout=out, stderr=err).returncode
            after = os.times()
            if code != 0 or (needs_vehicle and not self.vehicle.exists()):
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
    yaw(bare(rotorloop, data), verdicts, 0.70, None)


def load(rotorloop, data, verdicts):
    """What the bare flights say of the vehicle is what its file knows; the loaded one weighs 39.7 g without its load."""
    name, truth_kg = "imrc_cf21bl_payload", 4.7e-3
    nominal = OUT / "load_nominal.toml"
    text = bare(rotorloop, data).vehicle.read_text()
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
    """Each flight is predicted by the three others."""
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
                  ("hub_moment", "rotor_plane_height", "blade_flapping", "body_pitch_moment", "rotor_wake_interference")]
        verdicts.row("moment that grows with speed", ", ".join(moment) or "not found", "named", bool(moment))
        torque2 += a["samples"] * torque(a) ** 2
        force2 += a["samples"] * force(a) ** 2
        samples += a["samples"]
    pooled = math.sqrt(torque2 / samples)
    verdicts.row("torque error, four flights in one pot", f"{pooled:.4f} N m", "0.0185 N m", pooled <= 0.0185)
    print(f"  force error, four flights in one pot: {math.sqrt(force2 / samples):.3f} N")


PARTS = {"idsia": idsia, "imrc": imrc, "load": load, "neurobem": neurobem}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rotorloop", type=pathlib.Path, default=ROOT / "build/release/bin/rotorloop")
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    o = parser.parse_args()
    if "ROTORLOOP_DATA" not in os.environ:
        print("ROTORLOOP_DATA is not set: no measured flights, nothing to diagnose", file=sys.stderr)
        return 2
    for p in o.parts:
        if p not in PARTS:
            parser.error(f"{p} is none of {', '.join(PARTS)}")
    verdicts = Verdicts()
    for name in o.parts or PARTS:
        PARTS[name](o.rotorloop, pathlib.Path(os.environ["ROTORLOOP_DATA"]), verdicts)
    print(f"\n{verdicts.missed} limits missed")
    return 6 if verdicts.missed else 0


if __name__ == "__main__":
    sys.exit(main())
