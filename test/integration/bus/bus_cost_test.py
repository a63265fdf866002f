"""What a frame on the virtual bus costs, in instructions: two nodes with filters, stuff bits counted exactly. The same figure on any machine
and however busy it is, as instructions are counted and not time. Skipped (77) without valgrind.

usage: bus_cost_test.py PATH_TO_ROTORLOOP
"""
import re
import shutil
import subprocess
import sys

MOST_INSTRUCTIONS = 3000  # a frame; asked for when the tools were planned
FEW, MANY = 2000, 12000


def instructions(program, frames):
    done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", program, "bus", "bench", "virtual:", "--frames", str(frames)],
                          capture_output=True, text=True, timeout=600)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or not found:
        sys.exit(f"callgrind failed: {done.stdout}{done.stderr}")
    return int(found.group(1))


if not shutil.which("valgrind"):
    print("skipped: 1 program; valgrind is missing")
    sys.exit(77)
each = (instructions(sys.argv[1], MANY) - instructions(sys.argv[1], FEW)) / (MANY - FEW)
print(f"{each:.0f} instructions a frame on the virtual bus, at most {MOST_INSTRUCTIONS}")
sys.exit(0 if each <= MOST_INSTRUCTIONS else 1)
