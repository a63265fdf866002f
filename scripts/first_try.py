#!/usr/bin/env python3
"""A first user's day on measured flights: a coarse vehicle file from mass, arm and propeller radius, then the commands of docs/manual/identifying.md.

Writes the file that the chapter "A first vehicle from three numbers" describes (inertia guesses wrong by a factor of 2 on purpose, one up, one
down), runs the command that stands there on one group of flights of each set, and ends with 6 unless each ends in a credible vehicle file.
ROTORLOOP_DATA names the folder that holds flights/.
  scripts/first_try.py                   both sets: a minute of one free core
  scripts/first_try.py imrc              this one
"""
import argparse
import math
import os
import pathlib
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
VEHICLES = ROOT / "vehicles/measured"
DENSITY = 1.2

VEHICLE = """format = 1
name = "{name}"

[body]
mass_kg = {{ value = {mass}, u = {mass_u:.2g}, origin = "cad" }}
inertia_kg_m2.xx = {{ value = {xx:.3g}, u = {xx:.3g}, origin = "guess" }}
inertia_kg_m2.yy = {{ value = {yy:.3g}, u = {yy:.3g}, origin = "guess" }}
inertia_kg_m2.zz = {{ value = {zz:.3g}, u = {zz:.3g}, origin = "guess" }}
com_offset_m.x = {{ value = 0.0, u = {com:.2g}, origin = "guess" }}
com_offset_m.y = {{ value = 0.0, u = {com:.2g}, origin = "guess" }}
{rotors}
[thrust_model]
k1_N_s2 = {{ value = {k1:.3g}, u = {k1_u:.2g}, origin = "guess" }}
k2_N_s2_m = {{ value = {k2:.3g}, u = {k2_u:.2g}, origin = "guess" }}
radius_m = {radius}
air_density_kg_m3 = {density}
rpm_window = [1000, 60000]

[torque_model]
c_q_N_m_s2 = {{ value = {c_q:.3g}, u = {c_q:.3g}, origin = "guess" }}
rotor_inertia_kg_m2 = {{ value = {j_r:.2g}, u = {j_r:.2g}, origin = "guess" }}

[drag]
c_dh_s_m = {{ value = 0.02, u = 0.02, origin = "guess" }}
c_dxy_N_s2_m2 = {{ value = {c_d:.2g}, u = {c_d:.2g}, origin = "guess" }}
c_dz_N_s2_m2 = {{ value = {c_d:.2g}, u = {c_d:.2g}, origin = "guess" }}

[pose_sensor]
offset_m = {{ value = [0.0, 0.0, 0.0], u = [0.01, 0.01, 0.02], origin = "guess" }}
quaternion_wxyz = {{ value = [1.0, 0.0, 0.0, 0.0], u_rad = [0.05, 0.05, 0.1], origin = "guess" }}

[provenance]
written_by = "scripts/first_try.py"
"""


def vehicle_text(name, mass, half, radius, wrong):
    """`half`: motor from the centre in x and y, m; `wrong`: factors on the inertia guesses about x, y and z."""
    arm2 = 2 * half * half
    # A third of the mass in the motors at the arms, the rest near the middle.
    xx, yy, zz = (f * share * mass * arm2 for f, share in zip(wrong, (0.25, 0.25, 0.4)))
    zz = min(max(zz, 1.03 * abs(xx - yy)), 0.97 * (xx + yy))  # no body has more than the sum of the others, whatever was guessed
    area = math.pi * radius**2
    c_t = 0.0175 * DENSITY * area * radius**2
    k1 = 1.6 * c_t
    k2 = -3.0 * k1 / radius
    c_q = c_t**1.5 / (0.5 * math.sqrt(2 * DENSITY * area))
    rotors = ""
    for (x, y), reaction in zip(((1, -1), (-1, 1), (1, 1), (-1, -1)), (-1, -1, 1, 1)):
        rotors += f"\n[[rotor]]\nposition_m = [{x * half}, {y * half}, 0.0]\nreaction = {reaction}\n"
    return VEHICLE.format(name=name, mass=mass, mass_u=mass / 100, xx=xx, yy=yy, zz=zz, com=0.05 * half, rotors=rotors, k1=k1, k1_u=0.5 * k1, k2=k2,
                          k2_u=0.5 * abs(k2), radius=radius, density=DENSITY, c_q=c_q, j_r=1e-3 * mass * arm2, c_d=0.3 * area)


SETS = {
    "imrc": ("imrc_cf21bl_bare", 0.037, 0.0325, 0.0275, ("eckart00", "eckart17", "eckart30", "eckart34")),
    "idsia": ("idsia_nanodrone_cf21bl", 0.045, 0.0353, 0.0275, ("square_20251017_run2", "square_20251017_run3", "random1_20251017_run3")),
}
OPTIONS = ["--rate", "100"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="*", metavar="SET", help=", ".join(SETS))
    parser.add_argument("--rotorloop", type=pathlib.Path, default=ROOT / "build/release/bin/rotorloop")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "runs/first_try")
    o = parser.parse_args()
    if "ROTORLOOP_DATA" not in os.environ:
        sys.exit("ROTORLOOP_DATA is not set: it names the folder that holds flights/")
    data = pathlib.Path(os.environ["ROTORLOOP_DATA"]) / "flights"
    missed = 0
    for name in o.sets or SETS:
        dataset, mass, half, radius, flights = SETS[name]
        for wrong in ((2.0, 0.5, 2.0), (0.5, 2.0, 0.5)):
            folder = o.out / f"{name}_{wrong[0]:g}"
            folder.mkdir(parents=True, exist_ok=True)
            vehicle, written = folder / "coarse.toml", folder / "identified.toml"
            written.unlink(missing_ok=True)
            vehicle.write_text(vehicle_text(name, mass, half, radius, wrong))
            line = [str(o.rotorloop), "identify", "--vehicle", str(vehicle), "-m", str(VEHICLES / f"{dataset}.mapping.toml"), "--flight",
                    *(str(data / dataset / f"{f}.csv") for f in flights), *OPTIONS, "-o", str(written), "-q"]
            done = subprocess.run(line, capture_output=True, text=True)
            (folder / "stdout").write_text(done.stdout)
            (folder / "stderr").write_text(done.stderr)
            text = f"inertia guesses times {', '.join(f'{w:g}' for w in wrong)}: exit code {done.returncode}"
            if written.exists():
                with open(written, "rb") as f:
                    v = tomllib.load(f)
                inertia = [v["body"]["inertia_kg_m2"][a] for a in ("xx", "yy", "zz")]
                text += "; " + ", ".join(f"I_{a} {i['value']:.3g} ± {i['u']:.1g}" for a, i in zip(("xx", "yy", "zz"), inertia)) + " kg m²"
            else:
                text += "; " + next((x for x in done.stderr.splitlines() if "error" in x), "no vehicle file")
            missed += not written.exists()
            print(f"{'met   ' if written.exists() else 'MISSED'}  {name}, {len(flights)} flights, {text}", flush=True)
    sys.exit(6 if missed else 0)


if __name__ == "__main__":
    main()
