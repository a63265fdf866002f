#!/usr/bin/env python3
"""Layout of the C++ sources: as clang-format writes it (.clang-format), no line above 140 columns but those of raw strings that LONG_LINES
names with their reason.

    test/lint/format.py [--root DIR]      prints each finding as file:line; exit 1 when there is one
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

import lint

COLUMNS = 140
SUFFIXES = (".cpp", ".hpp", ".h", ".inc")
# Files whose raw strings have longer lines: the text of a page or a style sheet, which a break would change.
LONG_LINES = {
    "bench/render/page.cpp": "style sheet and scripts of pages",
    "bench/render/svg_plot.cpp": "style sheet of plots",
    "bench/propeller/report/rotor_plot.cpp": "text of a page",
    "test/adapter/adapter_test.cpp": "JSON, an operation a line",
    "test/unit/bench/hil/flight/synthetic_run.hpp": "a list of TOML",
}


def long_lines(root, names):
    for name in names:
        for number, line in enumerate((root / name).read_text(encoding="utf-8").splitlines(), 1):
            if len(line) > COLUMNS and name not in LONG_LINES:
                yield f"{name}:{number}: {len(line)} columns, the limit is {COLUMNS}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parents[2])
    root = parser.parse_args().root
    names = [n for n in lint.list_files(root) if n.endswith(SUFFIXES) and not n.startswith("third_party/")]
    if not shutil.which("clang-format"):
        print("skipped: 1 program; clang-format is missing")
        return 77
    findings = list(long_lines(root, names))
    for first in range(0, len(names), 200):
        done = subprocess.run(["clang-format", "--dry-run", *names[first:first + 200]], cwd=root, capture_output=True, text=True, check=False)
        findings += [line for line in done.stderr.splitlines() if "warning:" in line or "error:" in line]
    print("\n".join(findings + [f"format: {len(names)} files, {len(findings)} findings"]))
    return 1 if findings or not names else 0


if __name__ == "__main__":
    sys.exit(main())
