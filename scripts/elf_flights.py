"""Flights of four ELFs beside the same flights of native ESCs: verdict, mean tracking error, and reruns byte by byte.

usage: elf_flights.py ROTORLOOP ELF [--vehicles NAME ...] [--boards ideal typical] [--moves sideways up] [--reruns N] [--work FOLDER]
ROTORLOOP: build/release/bin/rotorloop; ELF: of scripts/firmware. Each vehicle flies 1 m sideways and 0.5 m up, each in 1.2 s between two
hovers; typical boards are drawn from the spread of real ones and have clocks of their own. FOLDER (build/elf_flights) keeps scenarios and runs.
Limits: verdict as native, error within 3 % of native. Exit code 6: one was missed, or a rerun of the first flight has other bytes.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent.parent
# Plant, model and gains of each vehicle on a B-G431B-ESC1.
VEHICLES = {"quad_5in": ("vehicles/reference_plant.toml", "vehicles/calibrated.toml", "vehicles/gains.toml"),
            **{f"quad_{size}in": tuple(f"vehicles/quad_{size}in/{part}.toml" for part in ("plant", "calibrated", "gains")) for size in (3, 7, 10)}}
MOVES = {"sideways": ("x", 0.0, 1.0), "up": ("z", 2.0, 0.5)}
HOVER_s, MOVE_s, LIMIT_percent = 0.4, 1.2, 3.0


def trajectory(axis, start_m, distance_m):
    """Hover, one move with rest, velocity, acceleration and jerk zero at both ends, hover."""
    def segment(duration_s, moved):
        rows = [f"[[segment]]\nduration_s = {duration_s}"]
        for name, at in (("x_m", 0.0), ("y_m", 0.0), ("z_m", 2.0), ("yaw_rad", 0.0)):
            c = [start_m + distance_m * max(moved, 0.0)] if name[0] == axis and name != "yaw_rad" else [at]
            if moved == 0.5 and name[0] == axis:
                c = [start_m, 0, 0, 0, *(distance_m * k / MOVE_s**n for k, n in ((35, 4), (-84, 5), (70, 6), (-20, 7)))]
            rows.append(f"{name} = {c}")
        return "\n".join(rows)
    parts = (segment(HOVER_s, 0.0), segment(MOVE_s, 0.5), segment(HOVER_s, 1.0))
    return 'format = 1\nname = "short move"\n\n' + "\n\n".join(parts) + "\n"


def plant_file(work, vehicle, boards):
    """The vehicle's plant with other boards; its paths from here on absolute."""
    plant = HERE / VEHICLES[vehicle][0]
    text = re.sub(r'"([\w./]+\.toml)"', lambda found: f'"{(plant.parent / found[1]).resolve()}"', plant.read_text(encoding="utf-8"))
    clock = "own" if boards == "typical" else "common"
    if "[esc]" in text:
        text = re.sub(r'^board = "\w+"', f'board = "{boards}"', re.sub(r'^clock = "\w+"', f'clock = "{clock}"', text, flags=re.M), flags=re.M)
    elif boards != "ideal":
        text += f'\n[esc]\nstage = "b_g431b_esc1"\nboard = "{boards}"\nclock = "{clock}"\nparameters = "motor_file"\nphase_current_limit_A = 40.0\n'
    file = work / f"{vehicle}_{boards}_plant.toml"
    file.write_text(text, encoding="utf-8")
    return file


def scenario(work, vehicle, boards, kind, elf):
    plant, model, gains = plant_file(work, vehicle, boards), *(HERE / file for file in VEHICLES[vehicle][1:])
    name = f"{vehicle}_{boards}_{kind}"
    esc = f'[esc]\nkind = "{kind}"\nfast_channel_Hz = 1000\n'
    flights = "".join(f'[[flight]]\nname = "{move}"\ntrajectory = "{work / (move + ".toml")}"\n' for move in MOVES)
    text = (f'format = 1\nname = "{name}"\nplant = "{plant}"\nvehicle = "{model}"\nseeds = [1]\nvariants = ["pd_ff_thrust_drag"]\n\n'
            f'[controller]\ngains = "{gains}"\n\n{flights}\n[bus]\nesc = "virtual:"\nstate = "virtual:"\npace = "lockstep"\n\n{esc}')
    if kind == "emulated":
        text += f'elf = "{elf}"\n'
    file = work / f"{name}.toml"
    file.write_text(text, encoding="utf-8")
    return file


def fly(rotorloop, work, file, name, flights):
    words = ["hil", file, "--out", work / "runs", "--name", name, "--flights", ",".join(flights), "-j", "1", "-q", "--force", "--json"]
    done = subprocess.run([rotorloop, *words], capture_output=True, text=True, cwd=HERE)
    if done.returncode not in (0, 6):
        sys.exit(f"{file}: exit code {done.returncode}\n{done.stderr}")
    return json.loads(done.stdout), work / "runs" / name


def error_of(result, flight):
    return result["figures"][f"{flight}/pd_ff_thrust_drag/mean_error_3d"]["value"]


def bytes_of(folder):
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.rglob("*")) if f.suffix in (".log", ".csv")}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rotorloop", type=pathlib.Path)
    parser.add_argument("elf", type=pathlib.Path)
    parser.add_argument("--vehicles", nargs="*", default=list(VEHICLES), choices=list(VEHICLES))
    parser.add_argument("--boards", nargs="*", default=["ideal", "typical"], choices=["ideal", "typical"])
    parser.add_argument("--moves", nargs="*", default=list(MOVES), choices=list(MOVES))
    parser.add_argument("--reruns", type=int, default=3)
    parser.add_argument("--work", type=pathlib.Path, default=HERE / "build/elf_flights")
    o = parser.parse_args()
    work, elf, rotorloop = o.work.resolve(), o.elf.resolve(), o.rotorloop.resolve()
    work.mkdir(parents=True, exist_ok=True)
    for move, shape in MOVES.items():
        (work / f"{move}.toml").write_text(trajectory(*shape), encoding="utf-8")
    missed = 0
    print("| vehicle | boards | move | native, cm | four ELFs, cm | difference, % |\n| --- | --- | --- | --- | --- | --- |", flush=True)
    for vehicle in o.vehicles:
        for boards in o.boards:
            moves = [m for m in o.moves if vehicle == "quad_5in" or m == "sideways"]
            results = [fly(rotorloop, work, scenario(work, vehicle, boards, kind, elf), f"{vehicle}_{boards}_{kind}", moves)[0]
                       for kind in ("native", "emulated")]
            for move in moves:
                native, emulated = (error_of(r, move) for r in results)
                percent = 100.0 * (emulated / native - 1.0)
                wrong = abs(percent) > LIMIT_percent or results[0]["verdict"] != results[1]["verdict"]
                missed += wrong
                print(f"| {vehicle} | {boards} | {move} | {native:.3f} | {emulated:.3f} | {percent:+.1f}{' **missed**' if wrong else ''} |", flush=True)
    runs = []
    for n in range(o.reruns):
        file = scenario(work, o.vehicles[0], o.boards[0], "emulated", elf)
        runs.append(bytes_of(fly(rotorloop, work, file, f"rerun_{n}", ["sideways"])[1]))
    if runs:
        same = sum(run == runs[0] for run in runs)
        size = sum(map(len, runs[0].values()))
        print(f"{same} of {len(runs)} runs of {o.vehicles[0]}, {o.boards[0]} boards, sideways: the same {len(runs[0])} logs of {size} bytes")
        missed += same != len(runs) or not runs[0]
    return 6 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
