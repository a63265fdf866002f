"""The firmware core built for the chip, at -O2 and -Os, in closed loop with a drive: equal bit for bit to the same core built for the host.

usage: core_loop_test.py PROGRAM SOURCE_FOLDER WORK_FOLDER PERIODS|sweep
PROGRAM is mcu_core_loop; `sweep`: interrupts at every instruction, and the same bytes in five runs (core_sweep.cpp). Exit code 1: a period differs, or self-test, start, steps, trip, catch, stop (and commissioning, in more than 96 000
periods) did not all happen; 77: arm-none-eabi-g++ is missing.
"""
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
FLAGS = ("-std=c++20 -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffreestanding -fno-exceptions -fno-rtti -ffp-contract=off"
         " -fno-math-errno -fno-threadsafe-statics -ffunction-sections -fdata-sections -DNDEBUG -Wall -Wextra -nostartfiles -nostdlib -Wl,--gc-sections")


def build(source, work, optimisation):
    elf, image = work / f"plain{optimisation}.elf", work / f"plain{optimisation}.bin"
    subprocess.run(["arm-none-eabi-g++", *FLAGS.split(), optimisation, f"-I{source}", str(HERE / "plain_program.cpp"),
                    str(source / "firmware/core/commission/procedure_spin.cpp"), f"-Wl,-T,{HERE / 'plain_program.ld'}", "-lgcc", "-o", str(elf)], check=True)
    subprocess.run(["arm-none-eabi-objcopy", "-O", "binary", "-j", ".text", str(elf), str(image)], check=True)
    return image


def main(program, source, work, periods):
    if not shutil.which("arm-none-eabi-g++"):
        print("skipped: 1 program; arm-none-eabi-g++ is missing")
        return 77
    work.mkdir(parents=True, exist_ok=True)
    failed = 0
    for optimisation in ("-O2", "-Os"):
        print(f"{optimisation}: ", end="", flush=True)
        failed |= subprocess.run([program, str(build(source, work, optimisation)), periods], check=False).returncode
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]), sys.argv[4]))
