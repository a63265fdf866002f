"""scripts/test_summary.py: what its last line counts."""
import sys
import unittest
import xml.etree.ElementTree as ET
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
import test_summary  # noqa: E402


def entry(name, status, skip_message=None, output=""):
    e = ET.Element("testcase", name=name, status=status)
    if skip_message:
        ET.SubElement(e, "skipped", message=skip_message)
    ET.SubElement(e, "system-out").text = output
    return e


PROGRAMS = {"test_wing": "test_wing"}


class Count(unittest.TestCase):
    def outcomes(self, cases, entries):
        return [(name, outcome) for name, outcome, _ in test_summary.count(cases, entries, PROGRAMS)]

    def test_a_script_that_fails_is_counted(self):
        self.assertEqual(self.outcomes([], [entry("lint", "fail"), entry("cli", "run")]), [("lint", "failed"), ("cli", "passed")])

    def test_a_googletest_program_counts_by_its_cases(self):
        cases = [("test_wing: Wing.Lifts", "passed", ""), ("test_wing: Wing.Stalls", "failed", "")]
        self.assertEqual(self.outcomes(cases, [entry("test_wing", "fail")]), [(c[0], c[1]) for c in cases])

    def test_a_crash_without_a_failed_case_is_one_failure(self):
        cases = [("test_wing: Wing.Lifts", "passed", "")]
        self.assertIn(("test_wing", "failed"), self.outcomes(cases, [entry("test_wing", "fail")]))

    def test_a_googletest_program_that_ran_no_case_is_a_failure(self):
        self.assertEqual(self.outcomes([], [entry("test_wing", "run")]), [("test_wing", "failed")])

    def test_exit_code_77_is_a_skip_with_its_reason(self):
        results = test_summary.count([], [entry("bus", "notrun", "SKIP_RETURN_CODE=77", "x\nskipped: 1 program; ip is missing\n")], PROGRAMS)
        self.assertEqual(results, [("bus", "skipped", "skipped: 1 program; ip is missing")])

    def test_a_program_that_was_not_built_is_a_failure(self):
        self.assertEqual(self.outcomes([], [entry("cli", "notrun", "Unable to find executable"), entry("test_wing", "notrun", "Unable to find executable")]),
                         [("cli", "failed"), ("test_wing", "failed")])


if __name__ == "__main__":
    unittest.main()
