"""Builds that people fly in the ESC laboratory: a row each, judged. Usage: scripts/esc_builds (esc_builds.py ROTORLOOP OPTIONS)."""
import argparse
import concurrent.futures
import json
import pathlib
import subprocess
import sys
import tempfile

# Name; take-off mass kg, wheelbase mm, propeller, rpm/V, mohm between leads, pole pairs, cells, phase current limit A. Resistance and pole
# pairs as sellers print them for motors of this size and speed constant; no motor of these was measured.
BUILDS = [
    ("5 in 2207 1950 rpm/V 6S", 0.68, 225, "5.1x4.6x3", 1950, 60, 7, 6, 35),
    ("5 in 2207 1950 rpm/V 6S, 30 A", 0.68, 225, "5.1x4.6x3", 1950, 60, 7, 6, 30),
    ("5 in 2306 2450 rpm/V 4S", 0.65, 225, "5.1x4.6x3", 2450, 45, 7, 4, 35),
    ("7 in 2806.5 1300 rpm/V 6S", 0.95, 300, "7x4x3", 1300, 60, 7, 6, 35),
    ("10 in 3115 900 rpm/V 6S", 2.0, 430, "10x5x3", 900, 45, 7, 6, 40),
    ("10 in 2216 880 rpm/V 4S", 1.5, 450, "10x4.5", 880, 110, 7, 4, 30),
    ("10 in 2216 920 rpm/V 3S", 1.3, 450, "10x4.5", 920, 120, 7, 3, 25),
    ("13 in 4006 380 rpm/V 6S", 2.2, 600, "13x4.4", 380, 180, 12, 6, 25),
    ("18 in 5008 340 rpm/V 6S", 4.5, 900, "18x6.1", 340, 80, 14, 6, 40),
    ("15 in 4008 620 rpm/V 6S", 2.8, 700, "15x5", 620, 90, 12, 6, 35),
    ("3 in 1404 3800 rpm/V 4S", 0.25, 150, "3x3x3", 3800, 140, 6, 4, 20),
    ("2.5 in 1204 5000 rpm/V 3S", 0.14, 115, "2.5x2.5x3", 5000, 200, 6, 3, 15),
    ("2 in 1103 8000 rpm/V 2S", 0.09, 95, "2x1.5x3", 8000, 180, 6, 2, 8),
    ("1.2 in 0802 19500 rpm/V 1S", 0.026, 65, "1.2x0.8x4", 19500, 330, 6, 1, 5),
]
TRIP_SHARE = 0.02
WHOOP_START_MS = 500  # frozen for the 1S build; the others have the limit of their class
FIGURES = {"slowest": "slowest start", "never": "draws that never started", "gaps": "draws without speed", "tripped": "draws with a trip",
           "dead": "draws not turning"}


def options(build):
    name, mass, wheelbase, propeller, kv, mohm, pairs, cells, limit = build
    return ["--mass-kg", mass, "--wheelbase-mm", wheelbase, "--propeller", propeller, "--kv", kv, "--resistance-mohm", mohm, "--pole-pairs",
            pairs, "--cells", cells, "--current-limit-A", limit]


def run(words, allowed=(0,)):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    if done.returncode not in allowed:
        raise RuntimeError(f"{' '.join(str(w) for w in words)}\n{done.stderr}")
    return done


def figures_of(program, build, draws, seed, folder):
    run([program, "vehicle", "new", folder, *options(build)])
    done = run([program, "esc-lab", "--plant", folder / "plant.toml", "--only", "start", "--draws", draws, "--seed", seed, "--json", "-q"], (0, 6))
    result = json.loads(done.stdout)
    rows = {key: next(row for row in result["rows"] if row["what"].startswith(what)) for key, what in FIGURES.items()}
    rows["holds"] = result["facts"]["phase current limit"].split("up to ")[1].split(" with")[0]
    return rows


def judged(build, rows, draws):
    start_limit = WHOOP_START_MS if build[7] == 1 else rows["slowest"]["limit"]
    missed = []
    if rows["never"]["value"] > 0 or rows["slowest"]["value"] > start_limit:
        missed.append("start")
    if rows["tripped"]["value"] > TRIP_SHARE * draws:
        missed.append("trips")
    if rows["gaps"]["value"] > 0:
        missed.append("without speed")
    if rows["dead"]["value"] > 0:
        missed.append("dead")
    never = f", never {rows['never']['value']:.0f}" if rows["never"]["value"] else ""
    late = f" ({rows['slowest']['note']})" if rows["slowest"]["note"].startswith("late") else ""
    cells = [build[0], f"{build[8]} of {rows['holds']}", f"{rows['slowest']['value']:.0f} ({start_limit:.0f}){never}{late}",
             f"{rows['tripped']['value']:.0f}", f"{rows['gaps']['value']:.0f}", f"{rows['dead']['value']:.0f}", rows["tripped"]["note"],
             "**missed**: " + ", ".join(missed) if missed else "met"]
    return cells, bool(missed)


def main(argv):
    parser = argparse.ArgumentParser(prog="scripts/esc_builds", description=__doc__)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", type=int, default=2)
    o = parser.parse_args(argv)
    builds = [build for build in BUILDS if o.only in build[0]]
    if not builds:
        parser.error(f"no build's name holds \"{o.only}\"")
    print(f"{o.draws} draws each, seeds {o.seed} to {o.seed + o.draws - 1}; limits: at most {100 * TRIP_SHARE:.0f} % of the draws with a trip, "
          "none that never starts, starts late, is without speed for 100 ms or does not turn at its end\n")
    print("| build | limit A, of what the ESC holds | slowest start ms (limit) | with a trip | without speed | not turning at the end | "
          "causes | |\n| --- | --- | --- | --- | --- | --- | --- | --- |")
    any_missed = False
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
        running = [pool.submit(figures_of, o.program, b, o.draws, o.seed, pathlib.Path(folder) / f"build_{k}") for k, b in enumerate(builds)]
        for build, done in zip(builds, running):
            cells, missed = judged(build, done.result(), o.draws)
            any_missed = any_missed or missed
            print("| " + " | ".join(cells) + " |", flush=True)
    return 6 if any_missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
