"""The nominal model of scripts/stats diagnose from flights of the present firmware: six sets of flights with nothing hidden, each fitted by
`rotorloop diagnose` without a search, pooled (scripts/pool_vehicles.py) into vehicles/hil_baseline.toml.

  python3 scripts/hil_baseline.py            needs rotorloop in build/release; about 5 minutes on one core
  python3 scripts/hil_baseline.py --with inflow_torque=k_q_N_s2:1e-6

What earlier flights said is a start value and no prior, so that nothing is counted twice; mass is the weighed one of vehicles/calibrated.toml.
An effect belongs here when every set of flights shows it (decision 0109): --with adds one to those that the file has.
"""

import argparse
import pathlib
import re
import subprocess
import sys

import diagnose_study

ROOT = diagnose_study.ROOT
BASELINE = ROOT / "vehicles/hil_baseline.toml"
# Two laws of one cause, of which eq. 4's is left to rotor_drag_with_speed; and the physical share of local inflow (decision 0084).
HELD = ["drag.c_dh", "effect.rotor_local_inflow.share"]
MASS = re.compile(r"^mass_kg = .*$", re.MULTILINE)


def start_file(added):
    """The baseline without what earlier flights knew: their values as guesses, no covariance, the weighed mass."""
    blocks = [b for b in diagnose_study.blocks(BASELINE.read_text(encoding="utf-8")) if not b.startswith(("[[covariance]]", "[provenance]"))]
    text = "".join(blocks).replace('origin = "flight" }', 'origin = "guess" }')
    weighed = MASS.search((ROOT / "vehicles/calibrated.toml").read_text(encoding="utf-8"))[0]
    text = MASS.sub(weighed, text)
    for name, key, u in added:
        text += f'\n[[effect]]\nid = "{name}"\nparameter = {{ "{key}" = {{ value = 0.0, u = {u}, origin = "guess" }} }}\n'
    return text


def effect(words):
    """"ID=KEY:U" as (id, key, u)."""
    name, _, rest = words.partition("=")
    key, _, u = rest.partition(":")
    return name, key, float(u)


def main():
    parser = argparse.ArgumentParser(description="pools vehicles/hil_baseline.toml anew")
    parser.add_argument("--seeds", type=diagnose_study.seed_list, default=diagnose_study.seed_list("301..306"))
    parser.add_argument("--with", dest="added", type=effect, action="append", default=[], metavar="ID=KEY:U", help="an effect besides those of the file")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "build/stats/hil_baseline", help="flights and fits; kept, and not made twice")
    parser.add_argument("-o", "--out", type=pathlib.Path, default=BASELINE)
    o = parser.parse_args()
    o.work = o.work.resolve()
    subprocess.run([sys.executable, ROOT / "scripts/diagnose_study.py", "--only", "clean_full", "--seeds", str(o.seeds[0]), "--clean-seeds",
                    ",".join(map(str, o.seeds)), "--fly-only", "--keep-logs", "--out", o.work, "-j", "1"], check=True)
    start = o.work / "start.toml"
    start.write_text(start_file(o.added), encoding="utf-8")
    fitted = []
    for seed in o.seeds:
        logs = sorted((o.work / "clean_full" / str(seed)).glob("?.csv"))
        fitted.append(o.work / f"{seed}.toml")
        print(f"fit of seed {seed}", file=sys.stderr, flush=True)
        subprocess.run([o.work / "rotorloop", "diagnose", "--vehicle", start, *sum((["--flight", log] for log in logs), []), "--use", "gyro,accel",
                        "--rate", "50", "--hold", *HELD, "--max-effects", "0", "--placebos", "0", "--force", "-q", "-o", fitted[-1]],
                       check=True, stdout=subprocess.DEVNULL)
    subprocess.run([sys.executable, ROOT / "scripts/pool_vehicles.py", *fitted, "-o", o.out], check=True)
    # k_1 still counts as a guess where more than half of what is known of it comes from the thrust stand's c_t: it is no guess any more.
    o.out.write_text(o.out.read_text(encoding="utf-8").replace('origin = "guess"', 'origin = "flight"'), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
