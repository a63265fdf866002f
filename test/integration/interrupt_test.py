"""SIGINT and SIGTERM end a command early: what was found is kept and marked, and the exit code says which signal came.

Each test waits for a line of progress and sends its signal then; nothing sleeps.
usage: interrupt_test.py PATH_TO_ROTORLOOP
"""
import signal
import subprocess
import sys

from rotorloop_cli import FIT, SOURCE, CommandTest, main


class Interrupt(CommandTest):
    def interrupted(self, which, line_with, *words):
        """Sends `which` when a line with this text came on stderr. Exit code, stdout, and the lines on stderr after it."""
        with subprocess.Popen(self.command_line(*words), cwd=self.path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              encoding="utf-8") as process:
            seen = []
            for line in process.stderr:
                seen.append(line)
                if line_with in line:
                    process.send_signal(which)
                    break
            else:
                self.fail(f"no line with {line_with!r}: {''.join(seen)}")
            out, after = process.communicate(timeout=120)
        return process.returncode, out, after

    def flown(self):
        """A flight of three seconds to fit."""
        self.assertEqual(self.run_command("hil", "s.toml", "-q").returncode, 0)
        return "runs/short/climb/pd_ff/1"

    def marked(self, folder, which, code, expected):
        self.assertEqual(code, expected)
        result = self.result(folder)
        self.assertEqual(result["verdict"], "incomplete")
        self.assertTrue(result["errors"], result)
        self.assertTrue(result["next"])
        self.assertIn('class="verdict incomplete"', self.page(folder))
        return result

    def test_hil_keeps_the_flights_that_were_flown(self):
        for which, expected in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(which=which):
                code, out, _ = self.interrupted(which, "[1/40]", "hil", "s.toml", "--seeds", "40", "-j", "1", "--force", "--no-logs")
                result = self.marked("runs/short", which, code, expected)
                ends = [f["end"] for f in result["flights"]]
                self.assertEqual(ends[0], "completed")
                self.assertLess(ends.count("completed"), 40)
                self.assertIn("of 40 flights were flown", result["errors"][0])
                self.assertIn("verdict: incomplete", out)

    def test_effects_tells_what_it_flew_marked(self):
        effects = ("effects", "--scenario", SOURCE / "scenarios/effects.toml", "--effect", "rotor_speed_noise", "--effect", "weak_rotor",
                   "--seeds", "20", "-j", "1", "-o", "e.md", "--force")
        for which, expected in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(which=which):
                code, _, _ = self.interrupted(which, "[1/", *effects)
                self.assertEqual(code, expected)
                self.assertIn(f"**Incomplete: interrupted by {which.name}.**", (self.path / "e.md").read_text(encoding="utf-8"))

    def test_close_marks_its_folder_and_goes_on_from_there(self):
        plan = SOURCE / "scenarios/close/nothing.toml"
        for which, expected in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(which=which):
                code, _, after = self.interrupted(which, "1-fly", "close", plan, "--name", "loop", "-j", "1")
                self.marked("runs/loop", which, code, expected)
                self.assertIn("the same command goes on from here", after)

    def test_identify_keeps_the_estimates_of_its_last_step(self):
        log = self.flown()
        for which, expected in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(which=which):
                code, out, _ = self.interrupted(which, "iteration 0", "identify", *FIT, "--flight", log, "--rate", "1000", "--report", "r", "--junit", "j.xml",
                                                "-o", "v.toml", "--force")
                result = self.marked("r", which, code, expected)
                self.assertEqual(result["errors"], ["interrupted by " + which.name])
                self.assertIn("verdict: incomplete", out)
                self.assertFalse((self.path / "v.toml").exists(), "an unfinished fit must not become a vehicle")
                self.assertIn("interrupted", (self.path / "j.xml").read_text(encoding="utf-8"))

    def test_diagnose_stops_within_a_round_and_keeps_what_it_had(self):
        log = self.flown()
        for which, expected in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(which=which):
                code, _, after = self.interrupted(which, "screening", "diagnose", *FIT, "--flight", log, "--report", "d", "--placebos", "300", "--force")
                result = self.marked("d", which, code, expected)
                self.assertIn("stopped during: screening", result["errors"][0])
                self.assertNotIn("%", after, "no part began after the signal")


if __name__ == "__main__":
    main(sys.argv)
