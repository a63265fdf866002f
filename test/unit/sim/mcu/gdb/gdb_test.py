"""gdb-multiarch at the emulated core: breakpoint, registers, memory, watchpoint, step, interrupt, reset, as a user types them.

usage: gdb_test.py PROGRAM WORK_FOLDER
PROGRAM is mcu_gdb_port. Exit code 1: an answer is not as expected; 77: gdb-multiarch or arm-none-eabi-g++ is missing.
"""
import pathlib
import re
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
FLAGS = ("-std=c++20 -g -Og -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffreestanding -fno-exceptions -fno-rtti -nostartfiles"
         " -nostdlib -Wall -Wextra").split()
# What is typed, and what its answer has to show.
DIALOGUE = [
    ("target remote 127.0.0.1:PORT", r"begin"),
    ("p/x $sp", r"= 0x20004000"),
    ("break counted", r"Breakpoint 1 at 0x80"),
    ("continue", r"Breakpoint 1, counted \(by=.*1\)"),
    ("set var $s5 = 1.5", r""),
    ("p $s5", r"= 1\.5"),
    ("p half", r"= 0\.5"),
    ("info registers xpsr", r"xpsr +0x[0-9a-f]*1000000"),
    ("p/x $msp", r"= 0x2000"),
    ("p $control", r"= 4"),
    ("stepi", r"0x080|counter"),
    ("finish", r"Run till exit|begin"),
    ("p counter", r"= 1"),
    ("set var counter = 100", r""),
    ("continue", r"counted \(by=.*2\)"),
    ("bt", r"#1 .*begin"),
    ("delete 1", r""),
    ("watch counter", r"atchpoint 2: counter"),
    ("continue", r"Old value = 100\s+New value = 102"),
    ("delete 2", r""),
    ("break on_svc", r"Breakpoint 3"),
    ("continue", r"Breakpoint 3, on_svc"),
    ("p/x $xpsr & 0x1ff", r"= 0xb"),
    ("x/2xw 0x08000000", r"0x20004000\s+0x080"),
    ("p/x *(unsigned*)0xE000ED00", r"= 0x410fc24[0-9a-f]"),
    ("monitor cycles", r""),
    ("monitor reset", r""),
    ("flushregs", r""),
    ("p/x $pc == (unsigned)&begin", r"= 0x1"),
    ("continue", r"Breakpoint 3, on_svc"),
    ("p counter", r"= 6"),
    ("p *(int*)0x60000000", r"Cannot access memory"),
    ("kill", r"killed"),
]


def build(work):
    elf = work / "debugged.elf"
    script = HERE.parent / "core/selftest/selftest.ld"
    subprocess.run(["arm-none-eabi-g++", *FLAGS, f"-Wl,-T,{script}", str(HERE / "debugged.cpp"), "-o", str(elf)], check=True)
    return elf


def talk(port, elf):
    commands = ["set pagination off", "set confirm off", f"file {elf}"]
    for typed, _ in DIALOGUE:
        commands += [f"echo \\n@@@ {typed}\\n", typed.replace("PORT", port)]
    arguments = ["gdb-multiarch", "-q", "-nx", "-batch"]
    script = elf.with_suffix(".gdb")
    # An error would end a script: each command stands alone.
    script.write_text("python\nimport gdb\nfor line in " + repr(commands) + ":\n  try:\n    gdb.execute(line)\n  except gdb.error as e:\n    print(e)\nend\n")
    done = subprocess.run([*arguments, "-x", str(script)], capture_output=True, text=True, timeout=60)
    return done.stdout + done.stderr


def main(program, work):
    for tool in ("gdb-multiarch", "arm-none-eabi-g++"):
        if not shutil.which(tool):
            print(f"skipped: 1 program; {tool} is missing")
            return 77
    work.mkdir(parents=True, exist_ok=True)
    elf = build(work)
    server = subprocess.Popen([program, str(elf)], stdout=subprocess.PIPE, text=True)
    try:
        text = talk(server.stdout.readline().strip(), elf)
    finally:
        server.kill()
        server.wait()
    answers = re.split(r"^@@@ ", text, flags=re.M)[1:]
    wrong = [typed for (typed, expected), answer in zip(DIALOGUE, answers) if not re.search(expected, answer[len(typed):])]
    print(text)
    print(f"{len(answers)} answers, {len(wrong)} not as expected: {wrong}")
    cycles = re.search(r"cycle \d+, \d+ instructions", text)  # on a stream of its own
    return 0 if cycles and len(answers) == len(DIALOGUE) and not wrong else 1


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], pathlib.Path(sys.argv[2])))
