"""The table of flights in README.md is what the program prints.

usage: readme_table_test.py [PATH_TO_ROTORLOOP]
Without a program: README's rows against docs/acceptance/first_flight.txt. With it: that file against the flights themselves, as `scripts/fly`
flies them (27 flights; minutes).
"""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[3]
PRINTED = SOURCE / "docs/acceptance/first_flight.txt"
ROWS = 9  # three flights, three controllers each


def rows_of(text):
    """[[cell]] of the rows with a mean and its standard deviation; cells are separated by two or more spaces."""
    return [re.split(r"\s{2,}", line.strip()) for line in text.splitlines() if re.search(r"PD FF.*±.*…", line)]


def without_columns_that_readme_leaves_out(cells):
    """The error seen from the estimate, and that of the other axis behind it."""
    other_axis = next(at for at, cell in enumerate(cells) if cell.startswith(("|z| ", "3-D ")))
    return cells[:other_axis - 1] + cells[other_axis + 1:]


class Readme(unittest.TestCase):
    program = None

    def test_table_has_the_rows_of_the_printed_one(self):
        printed = [without_columns_that_readme_leaves_out(cells) for cells in rows_of(PRINTED.read_text())]
        self.assertEqual(len(printed), ROWS)
        self.assertEqual(rows_of((SOURCE / "README.md").read_text()), printed)

    def test_printed_table_is_that_of_the_flights(self):
        if not self.program:
            self.skipTest("no program was named: nothing is flown")
        with tempfile.TemporaryDirectory() as folder:
            flown = subprocess.run([self.program, "hil", "scenarios/paper.toml", "--seeds", "3", "--out", folder, "--force", "-q"], cwd=SOURCE,
                                   capture_output=True, text=True, check=True)
        self.assertEqual(rows_of(flown.stdout), rows_of(PRINTED.read_text()))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Readme.program = sys.argv.pop(1)
    unittest.main()
