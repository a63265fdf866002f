"""Judges the bootloader of an ESC.

usage: boot_check.py ELF [--check]
--check: prints flash, RAM, stack and what must not be in it; exit 6 when one is beyond its limit. Reads the .su files of the same build.
"""
import pathlib
import re
import sys

import firmware_image
import firmware_stack

LIMITS = {"flash": 24 * 1024, "RAM with stack": 8 * 1024}


def checked(elf):
    """Lines of the table, and what is wrong."""
    s = firmware_image.sections(elf)
    stack = firmware_stack.bound(elf)
    values = {"flash": sum(s[name][0] for name in (".vectors", ".text", ".rodata", ".data")),
              "RAM with stack": sum(s[name][0] for name in (".stack", ".data", ".bss"))}
    rows, wrong = [], []
    for name, value in values.items():
        missed = value > LIMITS[name]
        rows.append(f"| {name} | {value} | {LIMITS[name]}{' **missed**' if missed else ''} |")
        wrong += [f"{name} has {value} bytes, limit {LIMITS[name]}"] if missed else []
    if stack.total > s[".stack"][0]:
        wrong.append(f"the stack may take {stack.total} bytes and has {s['.stack'][0]}")
    wrong += [f"recursion: {' -> '.join(loop)}" for loop in stack.loops]
    names = [line.split()[-1] for line in firmware_image.tool("nm", elf).splitlines()]
    foreign = [name for name in names if firmware_image.FOREIGN.match(name)]
    wrong += [f"foreign symbol: {name}" for name in foreign]
    rows.append(f"stack: {stack.text()}, has {s['.stack'][0]}")
    rows.append(f"double precision, heap, mathematics library, 64-bit division, recursion: {'found' if foreign or stack.loops else 'none'}")
    return rows, wrong


def main(words):
    elf = pathlib.Path(words[0])
    if not re.search(r"_boot\.elf$", elf.name) or words[1:] not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    print(f"in {elf.parent}: {elf.name}")
    if not words[1:]:
        return 0
    rows, wrong = checked(elf)
    print("| bytes | value | limit |\n| --- | --- | --- |\n" + "\n".join(rows))
    for line in wrong:
        print(f"{elf}: {line}", file=sys.stderr)
    return 6 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
