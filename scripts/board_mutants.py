"""Deliberate errors in the board layer of the ST B-G431B-ESC1, and the named test that finds each.

usage: board_mutants.py [NAME ...] [--work FOLDER]     without names: all of them
Each error is one replaced text in a copy of the sources, in FOLDER (build/mutants); what it changes is built there and the named test is
run, which has to fail, and to say that it was that test. The sources of the product are not touched. Before them all the same tests run
without any error, and have to pass. Tests of the ELF are those of build/release: build selftest_test and safety_test there first.
Prints the table; exit code 6: an error was not found.
"""
import argparse
import dataclasses
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent.parent
FILES = ("CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md")
FOLDERS = ("cmake", "protocols", "firmware", "host", "scripts", "third_party", "test", "sim", "bench", "cli", "vehicles", "effects", "devices", "scenarios",
           "docs")
BOARD, CHIP = "firmware/app/b_g431b_esc1/", "firmware/board/g431/"
PRODUCT, SELFTEST, HOST = "b_g431b_esc1.elf", "b_g431b_esc1_selftest.elf", "test_g431"
SOUND, TURNING = "SelfTest.ASoundBoardPassesEveryCheckWithTheSameLinesOverSerialLineAndBus", "InjectedFailure.ALoopThatStopsOpensTheBridgeWithin100ms"


@dataclasses.dataclass
class Mutant:
    name: str
    file: str
    old: str
    new: str
    target: str  # what is built of the copy
    test: str  # of test_g431, selftest_test or safety_test, by the target


MUTANTS = [
    Mutant("swapped phases", BOARD + "board.hpp", "ccr[k].write(c.phase[k])", "ccr[k].write(c.phase[(k + 1) % 3])", PRODUCT, TURNING),
    Mutant("dead time 0", CHIP + "timer.cpp", "dead_time_bits(timing.dead_time_ns)", "dead_time_bits(0 * timing.dead_time_ns)", SELFTEST, SOUND),
    Mutant("wrong JDR", BOARD + "board.hpp", "adc1().jdr[1].read()", "adc1().jdr[2].read()", HOST,
           "Start.CountsComeFromTheRightConverterAndTheBusVoltageFollowsTheReference"),
    Mutant("break not enabled", CHIP + "timer.cpp", " | kBreakOn | ", " | ", HOST,
           "Start.ThePinsGoToTheTimerOnlyWhenItsOutputsAreOffIdleLowAndItsBreakIsArmed"),
    Mutant("IWDG fed in the interrupt", BOARD + "sample_interrupt.cpp", "  g431::feed_wwdg();", "  g431::feed_iwdg();\n  g431::feed_wwdg();", PRODUCT,
           TURNING),
    Mutant("amplifiers' gain 8", CHIP + "opamp.hpp", "field(0x0B, 14)", "field(0x0A, 14)", SELFTEST, SOUND),
    Mutant("samples without a trigger's edge", CHIP + "adc.hpp", "ByTrgo = field(0, 2) | field(1, 7)", "ByTrgo = field(0, 2) | field(0, 7)", SELFTEST, SOUND),
    Mutant("samples at the trough", CHIP + "adc.hpp", "ByTrgo = field(0, 2) | field(1, 7)", "ByTrgo = field(8, 2) | field(1, 7)", PRODUCT, TURNING),
    Mutant("CAN bit sampled at 94 %", CHIP + "fdcan.hpp", "before = 14, after = 2, jump = 2", "before = 15, after = 1, jump = 1", HOST,
           "Can.At1MbitABitHas17QuantaOfA10thOfTheClockAndIsSampledAt88Percent"),
    Mutant("low sides inverted", CHIP + "timer.hpp", "(low ? 4u : 0u)", "(low ? 12u : 0u)", SELFTEST, SOUND),
    Mutant("shunts of U and W swapped", BOARD + "pins.hpp", ".u_adc1 = 3, .w_adc1 = 12", ".u_adc1 = 12, .w_adc1 = 3", PRODUCT, TURNING),
    Mutant("no bootstrap charge", BOARD + "board.cpp", "  if (report.ok()) charge_bootstrap();\n", "", HOST,
           "Start.BootstrapIsChargedFor10MsByLowSidesAloneAndTheBridgeIsOffAfterIt"),
    Mutant("zeros sampled at the crest", CHIP + "timer.cpp", "t.ccr[3].write(1); ", "t.ccr[3].write(timing.top);", PRODUCT, TURNING),
]


def run(*words, **options):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)


def copy_tree(work):
    """The sources as they are, files whose bytes did not change left alone, so that nothing is built anew for nothing."""
    tree = work / "tree"
    for file in [HERE / name for name in FILES] + [f for folder in FOLDERS for f in (HERE / folder).rglob("*") if f.is_file()]:
        copy = tree / file.relative_to(HERE)
        if not copy.exists() or copy.read_bytes() != file.read_bytes():
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, copy)
    for preset in ("firmware", "release"):
        if not (tree / "build" / preset / "build.ninja").exists():
            run("cmake", "--preset", preset, cwd=tree, check=True)
    return tree


def finds(tree, m):
    """Whether the test fails, and what it says."""
    preset = "release" if m.target == HOST else "firmware"
    built = run("cmake", "--build", tree / "build" / preset, "--target", m.target)
    if built.returncode != 0:
        sys.exit(f"{m.name}: does not compile, which finds nothing\n{built.stdout[-2000:]}{built.stderr[-2000:]}")
    if m.target == HOST:
        words = [found(tree / "build/release", HOST)]
    else:
        elf = tree / "build/firmware/bin" / m.target
        run(sys.executable, "-B", HERE / "scripts/firmware_image.py", elf, "--commit", "0", check=True)
        words = [HERE / "build/release/test-bin" / ("selftest_test" if m.target == SELFTEST else "safety_test"), elf]
    done = run(*words, f"--gtest_filter={m.test}", timeout=1800)
    return done.returncode != 0 and f"[  FAILED  ] {m.test}" in done.stdout, done.stdout


def found(folder, name):
    at = [p for p in folder.rglob(name) if p.is_file() and p.stat().st_mode & 0o100]
    return at[0] if at else sys.exit(f"{folder}: {name} was not built")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--work", type=pathlib.Path, default=HERE / "build/mutants")
    o = parser.parse_args()
    chosen = [m for m in MUTANTS if not o.names or m.name in o.names]
    if unknown := set(o.names) - {m.name for m in MUTANTS}:
        parser.error(f"no error of the name {', '.join(sorted(unknown))}; there are: {', '.join(m.name for m in MUTANTS)}")
    tree = copy_tree(o.work)
    for target, test in dict.fromkeys((m.target, m.test) for m in chosen):
        _, output = finds(tree, Mutant("no error", "", "", "", target, test))
        if f"[       OK ] {test}" not in output:
            sys.exit(f"{test}: fails without any error\n{output[-3000:]}")
    print("| deliberate error | found by |\n| --- | --- |", flush=True)
    missed = 0
    for m in chosen:
        source = tree / m.file
        text = source.read_text(encoding="utf-8")
        if text.count(m.old) != 1:
            sys.exit(f"{m.file}: '{m.old}' stands there {text.count(m.old)} times, not once: mend {pathlib.Path(__file__).name}")
        source.write_text(text.replace(m.old, m.new), encoding="utf-8")
        try:
            caught, _ = finds(tree, m)
        finally:
            source.write_text(text, encoding="utf-8")
        missed += not caught
        print(f"| {m.name} | {f'`{m.test}`' if caught else '**not found**'} |", flush=True)
    print(f"{len(chosen) - missed} of {len(chosen)} found")
    return 6 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
