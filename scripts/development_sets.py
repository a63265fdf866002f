#!/usr/bin/env python3
"""Diagnoses of the development sets, and their answers beside them.

For each set: a vehicle file from what `known.toml` says and guesses for the rest, `rotorloop diagnose` with its default options on five
flights (the sixth, general2, is held out), and a line of the table: verdict, names, classes, what was true. The sets are for development:
a figure from them is no claim. ROTORLOOP_DATA names the folder that holds flights/.
  scripts/development_sets.py                       all twenty: half an hour of one free core
  scripts/development_sets.py d03 undeclared_a      these
  scripts/development_sets.py --rotorloop FILE --out FOLDER d03 -- --placebos 0     another build, other options of diagnose
What the same program left in the folder with the same options is not run again.
"""
import argparse
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
FITTED = ["vertical", "horizontal", "rotation", "general", "low"]
HELD_OUT = "general2"
LARGEST_CLASS = 3

# Weight, geometry and noise are known. Guesses: inertia of known.toml, thrust, torque and drag of the paper's quadrotor.
VEHICLE = """format = 1
name = "{name}"

[body]
mass_kg = {{ value = {mass}, u = 0.001, origin = "cad" }}
inertia_kg_m2.xx = {{ value = {xx:.6g}, u = {xx_u:.3g}, origin = "guess" }}
inertia_kg_m2.yy = {{ value = {yy:.6g}, u = {yy_u:.3g}, origin = "guess" }}
inertia_kg_m2.zz = {{ value = {zz:.6g}, u = {zz_u:.3g}, origin = "guess" }}
com_offset_m.x = {{ value = 0.0, u = 0.005, origin = "guess" }}
com_offset_m.y = {{ value = 0.0, u = 0.005, origin = "guess" }}
{rotors}
[thrust_model]
k1_N_s2 = {{ value = 3.119e-06, u = 9.4e-07, origin = "guess" }}
k2_N_s2_m = {{ value = -0.0001541, u = 7.7e-05, origin = "guess" }}
radius_m = {radius}
air_density_kg_m3 = {density}
rpm_window = [4000, 20000]

[torque_model]
c_q_N_m_s2 = {{ value = 3.1e-08, u = 1e-08, origin = "guess" }}
rotor_inertia_kg_m2 = {{ value = 9.4e-06, u = 9e-06, origin = "guess" }}

[drag]
c_dh_s_m = {{ value = 0.0175, u = 0.0175, origin = "guess" }}
c_dxy_N_s2_m2 = {{ value = 0.0055, u = 0.0055, origin = "guess" }}
c_dz_N_s2_m2 = {{ value = 0.0185, u = 0.0185, origin = "guess" }}

[pose_sensor]
offset_m = {{ value = {offset}, u = [0.02, 0.02, 0.02], origin = "guess" }}
quaternion_wxyz = {{ value = {quaternion}, u_rad = [0.1, 0.1, 0.2], origin = "guess" }}

[provenance]
written_by = "scripts/development_sets.py"
"""

MAPPING = """format = 1
name = "{name}"
log = "csv"

[time]
column = "t"
unit = "s"

[[stream]]
quantity = "pose"
columns = ["px", "py", "pz"]
unit = "m"
quaternion = ["qw", "qx", "qy", "qz"]

[[stream]]
quantity = "gyro"
columns = ["gx", "gy", "gz"]
unit = "rad/s"

[[stream]]
quantity = "accel"
columns = ["ax", "ay", "az"]
unit = "m/s2"

[[stream]]
quantity = "rotor_speed"
columns = ["omega1", "omega2", "omega3", "omega4"]
unit = "rad/s"

[[stream]]
quantity = "battery"
columns = ["vbat"]
unit = "V"
"""


def vehicle_text(name, known):
    body, sensor = known["body"], known["pose_sensor_guess"]
    xx, yy, zz = (known["inertia_guess"][f"{a}_kg_m2"] for a in ("xx", "yy", "zz"))
    zz = min(zz, 0.97 * (xx + yy))  # no body has more than the sum, whatever was guessed
    half = body["arm_half_spacing_m"]
    rotors = ""
    for (x, y), reaction in zip(((1, -1), (-1, 1), (1, 1), (-1, -1)), known["rotor"]["reaction_on_body"]):
        rotors += f"\n[[rotor]]\nposition_m = [{x * half}, {y * half}, 0.0]\nreaction = {reaction}\n"
    return VEHICLE.format(name=name, mass=body["mass_kg"], xx=xx, xx_u=0.3 * xx, yy=yy, yy_u=0.3 * yy, zz=zz, zz_u=0.3 * zz, rotors=rotors,
                          radius=known["rotor"]["radius_m"], density=known["rotor"]["air_density_kg_m3"], offset=sensor["offset_m"],
                          quaternion=sensor["quaternion_wxyz"])


def diagnosed(program, flights, name, out, more):
    """result.json of a set, and the seconds of CPU that it took."""
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    vehicle, mapping, made_by = folder / "vehicle.toml", folder / "mapping.toml", folder / "made_by"
    with open(flights / "known.toml", "rb") as f:
        vehicle.write_text(vehicle_text(name, tomllib.load(f)))
    mapping.write_text(MAPPING.format(name=name))
    line = [str(program), "diagnose", "--vehicle", str(vehicle), "-m", str(mapping), "--flight",
            *(str(flights / f"{f}.csv") for f in FITTED), "--held-out", str(flights / f"{HELD_OUT}.csv"), "--report", str(folder), *more]
    key = hashlib.sha256(program.read_bytes() + vehicle.read_bytes() + " ".join(line).encode()).hexdigest()
    result, seconds = folder / "result.json", folder / "cpu_s"
    if not (made_by.exists() and made_by.read_text() == key and result.exists()):
        made_by.unlink(missing_ok=True)
        for old in ("result.json", "report.html"):
            (folder / old).unlink(missing_ok=True)
        before = os.times()
        with open(folder / "stdout", "w") as stdout, open(folder / "stderr", "w") as stderr:
            code = subprocess.run(line, stdout=stdout, stderr=stderr).returncode
        after = os.times()
        if code not in (0, 5):  # 5: refused as faulty, which is an answer
            sys.exit(f"{name}: exit code {code}\n{(folder / 'stderr').read_text()[-1500:]}")
        seconds.write_text(f"{after.children_user - before.children_user:.0f}")
        made_by.write_text(key)
    return json.loads(result.read_text()), seconds.read_text()


# Laws of the catalogue that hold the same form as what the answers name.
# d12: "0.3 of it, signed by spin, along (v_x, v_y)" is the law of rotor_rolling_moment.
SAME_FORM = {"d07": {"rotor_wake_thrust_loss": "rotor_wake_interference"}, "d10": {"world_force": "tether"}, "d11": {"height_pull": "tether"}, "d12": {"rotor_rolling_moment": "hub_moment"}}


def judged(name, added, right):
    """Effects found out of those that were there, and names that stand for none of them."""
    as_answered = SAME_FORM.get(name, {})
    classes = [{as_answered.get(i, i) for i in (a["id"], *(t["id"] for t in a["twins"]))} for a in added]
    found = sum(any(c & set(ids) and len(c) <= LARGEST_CLASS for c in classes) for ids in right)
    wrong = sum(not any(c & set(ids) for ids in right) for c in classes)
    return f"{found} of {len(right)}, wrong {wrong}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="*", help="d01 to d20, or a folder of flights/ with a known.toml")
    parser.add_argument("--rotorloop", type=pathlib.Path, default=ROOT / "build/release/bin/rotorloop")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "runs/development")
    arguments, more = sys.argv[1:], []
    if "--" in arguments:
        arguments, more = arguments[:arguments.index("--")], arguments[arguments.index("--") + 1:]
    args = parser.parse_args(arguments)
    if "ROTORLOOP_DATA" not in os.environ:
        sys.exit("ROTORLOOP_DATA is not set: it names the folder that holds flights/development")
    data = pathlib.Path(os.environ["ROTORLOOP_DATA"]) / "flights"
    with open(data / "development/answers.toml", "rb") as f:
        answers = tomllib.load(f)
    print("| set | verdict | effects | there was | found | CPU, s |\n|---|---|---|---|---|---|")
    for name in args.sets or sorted(p.name for p in (data / "development").glob("d*")):
        answer = answers.get(name)
        flights = data / "development" / name if answer else data / name
        result, seconds = diagnosed(args.rotorloop.resolve(), flights, name, args.out.resolve(), more)
        effects = "; ".join(" or ".join([a["id"], *(t["id"] for t in a["twins"])]) for a in result["added"]) or "–"
        there = "; ".join(f"{e['name']} {e['size']}" for k, e in answer.items() if k.startswith("effect_")) if answer else "not declared"
        found = judged(name, result["added"], answer["right"]) if answer else "–"
        print(f"| {name} | {result['verdict']} | {effects} | {there} | {found} | {seconds} |", flush=True)


if __name__ == "__main__":
    main()
