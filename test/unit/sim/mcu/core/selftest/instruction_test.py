"""Every form of instruction that the cross compiler makes of this repository's code is executed by a test of the core.

usage: instruction_test.py PROGRAM SOURCE_FOLDER WORK_FOLDER
PROGRAM is mcu_image_port. A form is a mnemonic with the kinds of its operands, as objdump prints them, without condition and width. Executed are
those of the random instructions that the oracle test compares, and those that the self-test went through. Exit code 1: a form is in neither;
77: the cross compiler is missing.
"""
import collections
import pathlib
import re
import shutil
import struct
import subprocess
import sys

import selftest_test

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "oracle"))
import random_instructions  # noqa: E402

# What the firmware consists of, as it is measured for the target, and the self-test.
SOURCES = ["firmware/board/fake/size_probe.cpp", "firmware/app/application_probe.cpp", "test/target/receive_cost.cpp",
           "test/unit/sim/mcu/core/selftest/selftest.cpp", "test/unit/sim/mcu/gdb/debugged.cpp"]
FLAGS = "-ffunction-sections -fdata-sections -DNDEBUG -c"
RANDOM_OF_A_CLASS = 3000
CONDITION = re.compile(r"(eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)$")
PLAIN = {"bls", "bcs", "bcc", "blt", "ble", "bge", "bgt", "beq", "bne", "bmi", "bpl", "bvs", "bvc", "bhi"}
# Mnemonics that end like a condition and have none.
WHOLE = {"teq", "smlal", "umlal", "muls", "mls", "vmls", "vnmls", "lsls", "cps", "movs", "svc", "bics", "sbcs", "adcs", "vcvt", "vabs", "smmls"}


def mnemonic(word):
    base, dot, suffix = word.partition(".")
    if suffix in ("w", "n"):
        dot = suffix = ""
    if base in PLAIN:
        return "b<cond>"
    if base not in WHOLE and len(base) > 3 and CONDITION.search(base):
        base = CONDITION.sub("", base)
    if base.startswith("it") and set(base[1:]) <= set("te"):
        return "it"
    return base + dot + suffix


def operands(text):
    text = re.sub(r"\s*[;@<].*", "", text)
    text = re.sub(r"\{[^}]*\}", "{}", text)
    text = re.sub(r"\b(r\d+|sl|fp|ip|sp|lr|pc)\b", "r", text)
    text = re.sub(r"#-?[\d.e+]+", "#", text)
    text = re.sub(r"\bs\d+\b", "s", text)
    text = re.sub(r"\bd\d+\b", "d", text)
    text = re.sub(r"\b(lsl|lsr|asr|ror) #", "shift #", text)
    text = re.sub(r"\b(?:0x)?[0-9a-f]{1,8}$", "@", text)
    return re.sub(r"\s+", " ", text.strip())


LINE = re.compile(r"^\s*([0-9a-f]+):\t(?:[0-9a-f]{4} ?)+\s*\t([a-z][a-z0-9.]*)\s*(.*)$")


def forms(listing, wanted=None):
    found = collections.defaultdict(int)
    for line in listing.splitlines():
        m = LINE.match(line)
        if m and (wanted is None or int(m[1], 16) in wanted):
            found[f"{mnemonic(m[2])} {operands(m[3])}".strip()] += 1
    return found


def disassemble(path, *arguments):
    return subprocess.run(["arm-none-eabi-objdump", *arguments, str(path)], check=True, capture_output=True, text=True).stdout


def emitted(source, work):
    found = collections.Counter()
    for name in SOURCES:
        for optimisation in ("-O2", "-Os"):
            target = work / (pathlib.Path(name).stem + optimisation + ".o")
            flags = selftest_test.FLAGS.replace("-nostartfiles -nostdlib", "").split()
            subprocess.run(["arm-none-eabi-g++", *flags, *FLAGS.split(), optimisation, f"-I{source}", str(source / name), "-o", str(target)], check=True)
            found.update(forms(disassemble(target, "-d")))
    return found


def compared_with_the_oracle(work):
    halfwords = []
    for index, name in enumerate(random_instructions.INTEGER + random_instructions.FLOATING):
        make = getattr(random_instructions.Generator(index), name)
        for _ in range(RANDOM_OF_A_CLASS):
            halfwords += make() + [0xBF00]
    image = work / "random.bin"
    image.write_bytes(struct.pack(f"<{len(halfwords)}H", *halfwords))
    return forms(disassemble(image, "-D", "-b", "binary", "-m", "arm", "-M", "force-thumb"))


def gone_through_by_the_self_test(program, work):
    found = collections.Counter()
    for optimisation in ("-O2", "-Os"):
        elf, image = selftest_test.build(work, optimisation)
        addresses = work / f"executed{optimisation}"
        subprocess.run([program, str(image), str(addresses)], check=True, capture_output=True, timeout=120)
        found.update(forms(disassemble(elf, "-d"), {int(a, 16) for a in addresses.read_text().split()}))
    return found


def main(program, source, work):
    if not shutil.which("arm-none-eabi-g++"):
        print("skipped: 1 program; arm-none-eabi-g++ is missing")
        return 77
    work.mkdir(parents=True, exist_ok=True)
    by_compiler = emitted(source, work)
    random, self_test = compared_with_the_oracle(work), gone_through_by_the_self_test(program, work)
    missing = {f: n for f, n in by_compiler.items() if f not in random and f not in self_test}
    for form, times in sorted(missing.items(), key=lambda x: -x[1]):
        print(f"{times:6} {form}")
    by_oracle = sum(f in random for f in by_compiler)
    print(f"{sum(by_compiler.values())} instructions of {len(by_compiler)} forms: {by_oracle} compared with the oracle, "
          f"{sum(f in self_test and f not in random for f in by_compiler)} by the self-test, "
          f"{len(missing)} by none")
    return 1 if missing or len(by_compiler) < 100 else 0


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])))
