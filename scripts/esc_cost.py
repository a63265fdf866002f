"""What the motor control costs on a Cortex-M4F, from its object file: code by purpose, divisions, and what must not be in it.

usage: esc_cost.py OBJECT [--check]     --check: says nothing and only fails on double precision, fused multiply-add or foreign symbols
Exit code 6: something is in it that must not be, or without --check the interrupt's code or longest path is beyond its limit.
"""
import collections
import pathlib
import re
import subprocess
import sys

OLD_PATH = 1472  # instructions of the interrupt's longest path at 86a5ca1, by scripts/worst_path.py
LIMIT_BYTES = 10 * 1024  # of the interrupt while it runs: one CCM of the STM32G431
# What runs at power-up, when starting, stopping or tripping, and may lie in flash.
PURPOSES = (("configuration, once", r"configure<|_GLOBAL__|>::Motor\("),
            ("start sequence", r"::start\(|::begin_start\(|(?:step|align)\(rotorloop::firmware::(?:Start|Finder)Config|::learn_at_rest\(|::take_over\("
                               r"|::(?:find_rotor|close_bridge)\(|::short_windings\(|::oppose_emf\(|::adopt_rotor\(|direction_of\("),
            ("trips, stops, tones", r"::trip\(|::sound\(|::come_to_rest\(|::switch_off\("),
            ("self-test, after power-up", r"::test_bridge\(|self_test::"),
            ("with the bridge off", r"calibrate_zero\(|::why_not\(|hand_watch|HandWatch|TurnConfig"))
RUNNING = "interrupt while running"
FUSED = re.compile(r"\bvfn?m[as]\.")  # other bits than the simulated firmware has
DOUBLE = re.compile(r"\bv\w+(?:\.\w+)*\.f64\b")
KNOWN = {"memcpy", "memset"}  # the compiler's own; anything else is a library's, as of double precision, mathematics or a heap


def tool(name, *words):
    return subprocess.run(["arm-none-eabi-" + name, *words], check=True, capture_output=True, text=True).stdout


def main(path, check):
    instructions = [line.split("\t", 2)[2] for line in tool("objdump", "-d", path).splitlines() if line.count("\t") >= 2]
    wrong = [f"fused multiply-add: {i}" for i in instructions if FUSED.search(i)]
    wrong += [f"double precision: {i}" for i in instructions if DOUBLE.search(i)]
    wrong += [f"foreign symbol: {name}" for name in set(tool("nm", "-u", path).replace("U", " ").split()) - KNOWN]
    if not instructions:
        wrong.append("no instruction found: is it an object file for ARM?")
    for line in wrong[:10]:
        print(f"{path}: {line}", file=sys.stderr)
    if check:
        return 6 if wrong else 0
    sizes = collections.Counter()
    for line in tool("nm", "-S", "-C", path).splitlines():
        found = re.match(r"[0-9a-f]+ ([0-9a-f]+) [tTwW] (.*)", line)
        if found:
            purpose = next((name for name, pattern in PURPOSES if re.search(pattern, found[2])), RUNNING)
            sizes[purpose] += int(found[1], 16)
    path_length = int(subprocess.run([sys.executable, "-B", pathlib.Path(__file__).with_name("worst_path.py"), path, "probe_sample_interrupt"],
                                     check=True, capture_output=True, text=True).stdout)
    print(f"longest path of the interrupt: {path_length} instructions (limit {1.05 * OLD_PATH:.0f}, the first version's {OLD_PATH} and 5 %)"
          f"{' **missed**' if path_length > 1.05 * OLD_PATH else ''}")
    divisions = sum(1 for i in instructions if i.startswith("vdiv"))
    print("| motor control on a Cortex-M4F | bytes | limit |\n| --- | --- | --- |")
    for purpose in (RUNNING, *(name for name, _ in PURPOSES)):
        missed = " **missed**" if purpose == RUNNING and sizes[purpose] > LIMIT_BYTES else ""
        print(f"| {purpose} | {sizes[purpose]} | {f'{LIMIT_BYTES}{missed}' if purpose == RUNNING else ''} |")
    print(f"divisions {divisions}, roots {sum(1 for i in instructions if i.startswith('vsqrt'))}, in all of it; double precision, fused multiply-add, "
          f"mathematics library, heap: {'found' if wrong else 'none'}")
    return 6 if wrong or sizes[RUNNING] > LIMIT_BYTES or path_length > 1.05 * OLD_PATH else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], "--check" in sys.argv))
