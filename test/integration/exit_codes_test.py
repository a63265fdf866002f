"""One table of exit codes: help and manual have the same, and commands end with what it says, in exit code, result.json, text and page.

usage: exit_codes_test.py PATH_TO_ROTORLOOP
"""
import re
import sys
import xml.etree.ElementTree

from rotorloop_cli import FIT, MISSED_LIMIT, SCENARIO, SOURCE, CommandTest, main


class ExitCodes(CommandTest):
    def ends(self, code, *words):
        done = self.run_command(*words)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def test_help_and_manual_have_the_same_table(self):
        help_text = self.ends(0, "--help").stdout
        in_help = {int(c): m for c, m in re.findall(r"^  +(\d+)  (\w+) ", help_text, re.MULTILINE)}
        manual = (SOURCE / "docs/manual.md").read_text(encoding="utf-8")
        section = manual[manual.index("## Exit codes"):manual.index("## Troubleshooting")]
        in_manual = {int(c): n for c, n in re.findall(r"^\| (\d+) \| (\w+) \|", section, re.MULTILINE)}
        self.assertEqual(in_help, in_manual)
        self.assertEqual(set(in_help), {0, 1, 2, 3, 4, 5, 6, 7, 8, 130, 143})

    def test_0_for_a_run_that_passed_and_the_page_says_what_to_do_next(self):
        done = self.ends(0, "hil", "s.toml", "-q", "--junit", "j.xml")
        self.assertRegex(done.stdout, r"verdict: pass\nnext:    \S")
        result = self.result("runs/short")
        self.assertEqual((result["verdict"], result["errors"]), ("pass", []))
        self.assertIn("Next: ", self.page("runs/short"))
        suite = xml.etree.ElementTree.parse(self.path / "j.xml").getroot()
        self.assertEqual((suite.get("tests"), suite.get("failures"), suite.get("errors")), ("1", "0", "0"))

    def test_2_for_a_misspelt_option(self):
        self.ends(2, "hil", "s.toml", "--sedes", "3")

    def test_3_for_a_folder_that_is_not_there(self):
        self.ends(3, "trajectory", "vertical_3p1", "-o", "no/such/folder.toml")

    def test_6_for_a_missed_limit_with_the_limit_in_errors_text_page_and_junit(self):
        self.write("s.toml", SCENARIO + MISSED_LIMIT.format(variant="pd_ff"))
        done = self.ends(6, "hil", "s.toml", "-q", "--junit", "j.xml")
        self.assertIn("error:   limit missed: mean_tracking_error climb pd_ff 3d", done.stdout)
        result = self.result("runs/short")
        self.assertEqual(result["verdict"], "fail")
        self.assertRegex(result["errors"][0], r"limit missed: .* cm, allowed at most 0.001 cm")
        self.assertRegex(self.page("runs/short"), r'class="verdict fail".*limit missed')
        failure = xml.etree.ElementTree.parse(self.path / "j.xml").find(".//testcase/failure")
        self.assertIn("0.001 cm", failure.get("message"))

    def test_7_for_a_limit_whose_controller_was_left_out(self):
        self.write("s.toml", SCENARIO.replace('["pd_ff"]', '["pd_ff", "pd_ff_drag"]') + MISSED_LIMIT.format(variant="pd_ff_drag"))
        self.ends(7, "hil", "s.toml", "-q", "--variants", "pd_ff", "--no-logs")
        result = self.result("runs/short")
        self.assertEqual(result["verdict"], "incomplete")
        self.assertIn("limit not measured", result["errors"][0])
        self.assertIn("--variants", result["next"])

    def test_5_and_8_compare_of_runs_without_logs_says_what_was_compared(self):
        self.ends(0, "hil", "s.toml", "-q", "--no-logs", "--name", "a")
        self.ends(0, "hil", "s.toml", "-q", "--no-logs", "--name", "b", "--seeds", "2,")
        self.assertFalse(list((self.path / "runs/a").glob("**/flight.csv")))
        self.assertIn("--no-logs", self.page("runs/a"))
        done = self.ends(8, "hil", "compare", "runs/a", "runs/b", "--fail-on-diff")
        self.assertIn("logs: not compared", done.stdout)
        self.assertNotIn("logs: 0 differ", done.stdout)
        self.ends(0, "hil", "compare", "runs/a", "runs/a", "--fail-on-diff")
        done = self.ends(5, "hil", "compare", "runs/a", "runs/b", "--verify")
        self.assertIn("nothing can be verified", done.stderr)

    def test_5_for_a_log_that_the_checks_refuse_with_the_fault_in_result_and_page(self):
        self.ends(0, "hil", "s.toml", "-q")
        log = (self.path / "runs/short/climb/pd_ff/1/flight.csv").read_text(encoding="utf-8").splitlines()
        head = next(i for i, line in enumerate(log) if line.startswith("t[s]"))
        rows = [line.split(",") for line in log[head + 1:]]
        self.write("late.csv", "\n".join(log[:head + 1] + [",".join([f"{1000 * float(r[0]):.3f}", *r[1:]]) for r in rows]) + "\n")  # ms, not s
        done = self.ends(5, "diagnose", *FIT, "--flight", "late.csv", "--report", "d", "-q")
        self.assertRegex(done.stdout, r"verdict: faulty\nerror:   .*\nnext:    mend")
        result = self.result("d")
        self.assertEqual(result["verdict"], "faulty")
        self.assertTrue(result["errors"])
        self.assertRegex(self.page("d"), r'class="verdict fail".*faulty')

    def test_0_and_5_of_a_calibration_stand_in_its_result_and_page(self):
        words = ("calibrate", "--plant", SOURCE / "vehicles/reference_plant.toml", "--vehicle", SOURCE / "vehicles/reference_cad.toml", "-o", "v.toml",
                 "--report", "c", "--force")
        self.ends(0, *words, "--trajectory", SOURCE / "scenarios/trajectories/horizontal_8p5.toml")
        result = self.result("c")
        self.assertEqual((result["verdict"], result["errors"]), ("pass", []))
        self.assertGreater(result["figures"]["k1"]["u"], 0)
        self.assertIn('class="verdict pass"', self.page("c"))
        (self.path / "v.toml").unlink()
        self.ends(5, *words, "--trajectory", "climb.toml")
        result = self.result("c")
        self.assertEqual(result["verdict"], "refused")
        self.assertIn("too few points for rotor drag", result["errors"][0])
        self.assertIn('class="verdict fail"', self.page("c"))
        self.assertFalse((self.path / "v.toml").exists())

    def test_2_for_a_loop_in_the_folder_of_another_command(self):
        self.ends(0, "hil", "s.toml", "-q", "--no-logs")
        before = (self.path / "runs/short/result.json").read_bytes()
        done = self.ends(2, "close", SOURCE / "scenarios/close/nothing.toml", "--name", "short", "-q")
        self.assertIn("runs/short: error: is a run of `rotorloop hil`", done.stderr)
        self.assertEqual((self.path / "runs/short/result.json").read_bytes(), before)


if __name__ == "__main__":
    main(sys.argv)
