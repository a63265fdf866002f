"""CPU time of building the command: target rotorloop of this tree and of another, from empty folders, in turn, without a
compiler cache. Called by scripts/bench --build; CPU seconds (user and system of all children) count, so that neither cores nor
waiting matter. Writes build/bench/build_time.json. Exit 6 when this tree needs more than LIMIT of the other's time."""
import argparse
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys

LIMIT = 0.50
TARGET = "rotorloop"


def without_cache():
    """The environment without anything that answers in the compiler's place."""
    env = {k: v for k, v in os.environ.items() if not (k.startswith("CMAKE_") and k.endswith("_LAUNCHER"))}
    return env | {"CCACHE_DISABLE": "1"}


def cpu_seconds_of(command, env):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"error: {' '.join(map(str, command))} ended with {done.returncode}\n{(done.stdout + done.stderr)[-4000:]}")
    return {"user_s": after.ru_utime - before.ru_utime, "system_s": after.ru_stime - before.ru_stime}


def build(source, folder):
    """Configures and builds SOURCE in FOLDER, which is emptied before; CPU seconds of the build alone."""
    shutil.rmtree(folder, ignore_errors=True)
    env = without_cache()
    subprocess.run(["cmake", "--preset", "release", "-B", folder], cwd=source, env=env, check=True, stdout=subprocess.DEVNULL)
    figures = cpu_seconds_of(["cmake", "--build", folder, "--target", TARGET], env)
    shutil.rmtree(folder)
    return figures | {"cpu_s": figures["user_s"] + figures["system_s"]}


def judged(here, other, limit):
    """Ratio of CPU times and the exit code that belongs to it."""
    ratio = here["cpu_s"] / other["cpu_s"]
    return ratio, 0 if ratio <= limit else 6


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", type=pathlib.Path, help="source folder of the other revision; without it, one figure and no ratio")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("build/bench"), help="where the build folders and the figures go")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    out = args.out.resolve()
    figures = {"target": TARGET}
    code = 0
    for name, source in (("other", args.against), ("here", pathlib.Path.cwd())):
        if source is None:
            continue
        figures[name] = build(source, out / f"build_time_{name}")
        print("{:6} {user_s:7.1f} s user + {system_s:6.1f} s system = {cpu_s:7.1f} s CPU".format(name, **figures[name]), flush=True)
    if "other" in figures:
        figures["ratio"], code = judged(figures["here"], figures["other"], LIMIT)
        print(f"ratio  {figures['ratio']:.3f}, limit {LIMIT:.2f}{'' if code == 0 else ': missed'}")
    (out / "build_time.json").write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return code


if __name__ == "__main__":
    sys.exit(main())
