"""Builds the self-test with the cross compiler, at -O2 and -Os, and runs it on the core: every check has to hold.

usage: selftest_test.py PROGRAM WORK_FOLDER
PROGRAM is mcu_image_port. Exit code 1: a check failed; 77: arm-none-eabi-g++ is missing.
"""
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
FLAGS = ("-std=c++20 -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffreestanding -fno-exceptions -fno-rtti -ffp-contract=off"
         " -fno-threadsafe-statics -Wall -Wextra -nostartfiles -nostdlib")
CHECKS = 77


def build(work, optimisation):
    """(ELF, image of its flash)"""
    elf, image = work / f"selftest{optimisation}.elf", work / f"selftest{optimisation}.bin"
    subprocess.run(["arm-none-eabi-g++", *FLAGS.split(), optimisation, f"-Wl,-T,{HERE / 'selftest.ld'}", str(HERE / "selftest.cpp"), "-lgcc", "-o", str(elf)],
                   check=True)
    subprocess.run(["arm-none-eabi-objcopy", "-O", "binary", "-j", ".text", str(elf), str(image)], check=True)
    return elf, image


def run(program, work, optimisation):
    _, image = build(work, optimisation)
    done = subprocess.run([program, str(image)], capture_output=True, text=True, timeout=120)
    passed = done.stdout.count("ok     ")
    print(f"{optimisation}:\n{done.stdout}{passed} checks hold")
    return done.returncode == 0 and passed == CHECKS


def main(program, work):
    if not shutil.which("arm-none-eabi-g++"):
        print("skipped: 1 program; arm-none-eabi-g++ is missing")
        return 77
    work.mkdir(parents=True, exist_ok=True)
    return 0 if all([run(program, work, o) for o in ("-O2", "-Os")]) else 1


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], pathlib.Path(sys.argv[2])))
