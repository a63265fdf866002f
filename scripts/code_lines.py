#!/usr/bin/env python3
"""Lines of code, of comments and of blanks in the shipped rooms, for this tree or for a revision.

    scripts/code_lines.py [REV]       firmware, host, bench, sim, protocols, cli; namespace lines are not counted as code
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("firmware", "host", "bench", "sim", "protocols", "cli")
SUFFIXES = (".cpp", ".hpp", ".inc")
NAMESPACE = re.compile(r"^(?:inline )?namespace\b.*\{$|^\}\s*// namespace.*$|^namespace \{$|^using namespace\b.*;$")


def count(text):
    """(code, comment, blank): a line with code and a comment counts as code."""
    code = comment = blank = 0
    inside = False
    for line in text.splitlines():
        s = line.strip()
        if inside or s.startswith(("//", "/*")):
            if NAMESPACE.match(s):
                continue
            inside = ("*/" not in s) if (inside or s.startswith("/*")) else False
            comment += 1
        elif not s:
            blank += 1
        elif not NAMESPACE.match(s):
            code += 1
    return code, comment, blank


def files_of(revision):
    git = ["git", "-C", str(ROOT)]
    names = subprocess.run(git + (["ls-tree", "-r", "--name-only", revision] if revision else ["ls-files"]), capture_output=True, text=True, check=True).stdout
    for name in names.split("\n"):
        if name.startswith(tuple(r + "/" for r in ROOMS)) and name.endswith(SUFFIXES):
            if revision:
                yield name, subprocess.run(git + ["show", f"{revision}:{name}"], capture_output=True, check=True).stdout.decode()
            elif (ROOT / name).is_file():
                yield name, (ROOT / name).read_text(encoding="utf-8")


def main(arguments):
    if arguments and arguments[0].startswith("-"):
        print(__doc__)
        return 0
    total = {room: [0, 0, 0] for room in ROOMS}
    for name, text in files_of(arguments[0] if arguments else None):
        for at, n in enumerate(count(text)):
            total[name.split("/")[0]][at] += n
    total["all"] = [sum(t[at] for t in total.values()) for at in range(3)]
    print(f"{'room':<10} {'code':>7} {'comment':>8} {'blank':>7} {'comment/code':>13}")
    for room, (code, comment, blank) in total.items():
        if code:
            print(f"{room:<10} {code:>7} {comment:>8} {blank:>7} {100.0 * comment / code:>11.1f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
