"""The ESC laboratory as a user calls it: short batteries, tables, JSON, page, limits, and what it refuses.

usage: esc_lab_test.py PATH_TO_ROTORLOOP
"""
import json
import re
import xml.etree.ElementTree as ElementTree

from rotorloop_cli import SOURCE, CommandTest, main

SHORT = ("--draws", 1, "--schedules", 12, "--quiet")
ALL = ["step", "chirp", "start", "catch", "sag", "commission", "fault"]


class EscLab(CommandTest):
    def lab(self, *words, code=0):
        done = self.run_command("esc-lab", *words)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def test_every_battery_of_one_5_inch_draw_is_judged_and_drawn(self):
        done = self.lab(*SHORT, "--seed", 3, "--json", "--out", "lab")
        result = json.loads(done.stdout)
        self.assertEqual(result, json.loads((self.path / "lab/result.json").read_text(encoding="utf-8")))
        self.assertEqual(result["verdict"], "pass")
        self.assertEqual(list(dict.fromkeys(row["battery"] for row in result["rows"])), ALL)
        for row in result["rows"]:
            self.assertTrue(row["met"], row)
        figures = {row["what"]: row["value"] for row in result["rows"]}
        self.assertEqual([v for what, v in figures.items() if "never started" in what], [0, 0], "counted apart, in step and in start")
        bandwidth_Hz = next(v for what, v in figures.items() if what.startswith("-3 dB"))
        self.assertTrue(40 < bandwidth_Hz < 250, "the loop of the reference has 120 Hz")
        page = (self.path / "lab/report.html").read_text(encoding="utf-8")
        for battery in ALL:
            self.assertIn(f'id="{battery}"', page)
        drawings = re.findall(r'<svg class="plot".*?</svg>(?=\s*(?:<figcaption|</figure))', page, re.DOTALL)
        self.assertGreater(len(drawings), 12)
        for drawing in drawings:
            ElementTree.fromstring(drawing)
        self.assertNotIn("http://", page.replace("http://www.w3.org", ""), "self-contained")

    def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(self):
        first, again, other = (self.lab(*SHORT, "--only", "start,sag", "--seed", seed, "--json").stdout for seed in (3, 3, 4))
        self.assertEqual(first, again)
        self.assertNotEqual(first, other)

    def test_a_plant_of_ones_own_7_inch_6s_and_a_high_voltage_17_inch_are_tried_with_their_limits(self):
        for size, limit_ms, board in ((7, 600, "b_g431b_esc1"), (17, 1500, "high_voltage_14s_120a")):
            done = self.lab(*SHORT, "--only", "start", "--plant", SOURCE / f"vehicles/quad_{size}in/plant.toml", "--json")
            result = json.loads(done.stdout)
            self.assertEqual(result["rows"][0]["limit"], limit_ms)
            self.assertEqual(result["facts"]["power stage"], board)

    def test_a_motor_that_the_board_cannot_start_misses_limits_and_ends_with_6(self):
        done = self.lab(*SHORT, "--motor", "gimbal", "--only", "step", code=6)
        self.assertIn("missed", done.stdout)
        self.assertIn("verdict: fail", done.stdout)

    def test_progress_is_a_line_for_each_battery_where_stderr_is_no_terminal(self):
        done = self.lab("--draws", 1, "--only", "sag,step")
        self.assertEqual(done.stderr.splitlines(), ["step 1/1", "sag 1/1"])

    def test_mistakes_are_refused_with_what_can_be_said_instead(self):
        for words, says in (((*SHORT, "--only", "spin"), "step, chirp, start, catch, sag, commission, fault"),
                            ((*SHORT, "--motor", "9in"), "--motor"),
                            ((*SHORT, "--plant", "nowhere.toml"), "nowhere.toml"),
                            (("--draws", 0), "--draws"),
                            ((*SHORT, "--motor", "7in", "--plant", SOURCE / "vehicles/reference_plant.toml"), "--plant")):
            self.assertIn(says, self.lab(*words, code=2).stderr)

    def test_a_report_is_not_overwritten_without_force(self):
        self.lab("--draws", 1, "--only", "sag", "--quiet", "--out", "lab")
        self.lab("--draws", 1, "--only", "sag", "--quiet", "--out", "lab", code=2)
        self.lab("--draws", 1, "--only", "sag", "--quiet", "--out", "lab", "--force")


if __name__ == "__main__":
    main(__import__("sys").argv)
