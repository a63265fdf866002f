"""scripts/stats paper-questions: what is done to a log, and how an answer is judged."""

import math
import pathlib
import random
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import alter_log  # noqa: E402
import paper_questions as study  # noqa: E402
import paper_questions_table as table  # noqa: E402
import torque_regression as regression  # noqa: E402
from diagnose_study import toml  # noqa: E402

STUDY = toml(study.STUDY)


class Logs(unittest.TestCase):
    t = [0.001 * i for i in range(4001)]

    def ramp_error(self, y):
        """Of a ramp of 1 per second, at its end: the delay in seconds."""
        return self.t[-1] - y[-1]

    def test_a_log_that_is_30_ms_late_shows_a_ramp_30_ms_late(self):
        self.assertAlmostEqual(self.ramp_error(alter_log.late(self.t, self.t, 0.03)), 0.03, places=9)

    def test_a_low_pass_of_10_ms_shows_a_ramp_10_ms_late_within_half_a_sample(self):
        self.assertAlmostEqual(self.ramp_error(alter_log.low_pass(self.t, self.t, 0.01)), 0.01, delta=0.0005)

    def test_a_soft_mount_overshoots_at_its_frequency_by_one_over_twice_its_damping(self):
        w = 2 * math.pi * 6.0
        y = alter_log.mounted(self.t, [math.sin(w * s) for s in self.t], 6.0, 0.2)
        # |(1 + 2id) / 2id| at resonance
        self.assertAlmostEqual(max(y[-500:]), math.hypot(1.0, 0.4) / 0.4, delta=0.02)

    def test_rows_without_a_pose_stay_without_and_quaternions_stay_of_length_one(self):
        head = "t[s],pose_t[s]," + ",".join(alter_log.POSE + alter_log.ROTORS)
        rows = [f"{0.001 * i},{'' if i % 5 else 0.001 * i}," + ("," * 6 if i % 5 else f"{i},0,0,{math.cos(i / 50)},0,0,{math.sin(i / 50)}") + ",1,2,3,4"
                for i in range(100)]
        with tempfile.TemporaryDirectory() as folder:
            source, target = pathlib.Path(folder, "a.csv"), pathlib.Path(folder, "b.csv")
            source.write_text("# rotorloop flight log 1\n" + head + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
            alter_log.alter(source, target, {"pose": {"low_pass": 0.03}, "rotors": {"gain": 1.04}})
            lines = target.read_text(encoding="utf-8").splitlines()
        self.assertEqual(lines[:2], ["# rotorloop flight log 1", head])
        self.assertEqual(lines[3].split(",")[1:9], [""] * 8)
        for line in lines[2::5]:
            cells = [float(c) for c in line.split(",")]
            self.assertAlmostEqual(math.hypot(*cells[5:9]), 1.0, places=6)
            self.assertAlmostEqual(cells[12], 4.16, places=9)


class Regression(unittest.TestCase):
    """Torques made up by Euler's equations for rates and accelerations drawn at random: no flight, but the equations hold."""

    def samples(self, reaction=0.0):
        draw, i, out = random.Random(1), regression.TRUE, []
        for _ in range(400):
            p, q, r, dp, dq = (draw.gauss(0.0, s) for s in (3.0, 3.0, 3.0, 20.0, 20.0))
            yaw, spin_rate = draw.gauss(0.0, 2e6), draw.gauss(0.0, 3e3)
            dr = (i["c_q"] * yaw + reaction * spin_rate - (i["I_yy"] - i["I_xx"]) * p * q) / i["I_zz"]
            out.append({"rate": (p, q, r), "acceleration": (dp, dq, dr), "thrust": 6.7 + draw.gauss(0.0, 1.0), "yaw": yaw, "spin_rate": -spin_rate,
                        "spin": 0.0, "velocity": (0.0, 0.0, 0.0), "roll": i["I_xx"] * dp + (i["I_zz"] - i["I_yy"]) * q * r,
                        "pitch": i["I_yy"] * dq + (i["I_xx"] - i["I_zz"]) * p * r})
        return out

    def test_inertia_and_torque_coefficient_come_out_of_motion_that_obeys_the_equations(self):
        found = regression.regress(self.samples())
        for name, value in regression.TRUE.items():
            self.assertAlmostEqual(found[name] / value, 1.0, places=6, msg=name)

    def test_rotor_inertia_is_found_when_it_is_there_and_asked_for(self):
        found = regression.regress(self.samples(reaction=9.4e-6), ("reaction",))
        self.assertAlmostEqual(found["reaction"] / 9.4e-6, 1.0, places=6)
        self.assertAlmostEqual(found["c_q"] / regression.TRUE["c_q"], 1.0, places=6)


class Cases(unittest.TestCase):
    def test_names_are_unique_and_parts_of_a_mix_are_cases(self):
        names = [c["name"] for c in STUDY["case"]]
        self.assertEqual(len(names), len(set(names)))
        for case in STUDY["case"]:
            self.assertLessEqual(set(case.get("parts", [])), set(names), case["name"])

    def test_every_effect_is_one_of_the_plant(self):
        plant = {e["id"] for e in toml(ROOT / "effects/catalogue.toml")["effect"] if e["plant"]}
        for case in STUDY["case"]:
            self.assertLessEqual({e["id"] for e in case.get("effect", [])} | set(case.get("without", [])), plant, case["name"])

    def test_a_plant_loses_and_gains_what_its_case_says(self):
        case = {"name": "x", "without": ["gyroscopic"], "effect": [{"id": "blockage_strut", "loss": 0.08}]}
        text = study.plant_text(case, STUDY["plant"])
        self.assertNotIn("gyroscopic", text)
        self.assertIn("loss = 0.08", text)
        self.assertIn("rotor_inertia_reaction", text)

    def test_arms_that_are_nominally_longer_move_all_four_hubs(self):
        text = study.vehicle_text({"believed": {"arms": 1.2}}, STUDY)
        self.assertEqual(text.count("0.106200"), 8)


class Judge(unittest.TestCase):
    def test_figures_of_the_paper_itself_have_no_distance_from_it(self):
        true = STUDY["true"]
        values = {n: true[n] * (1 + table.PAPER[n]) for n in ("I_xx", "I_yy", "I_zz", "c_q")} | {"c_t": true["c_t"] / 1.08}
        e = table.errors(values, STUDY)
        self.assertAlmostEqual(table.chi2(e, table.NAMES), 0.0, places=9)
        self.assertEqual(table.signs(e), 4)

    def test_a_lever_takes_a_common_factor_out_of_inertia_and_torque_and_leaves_thrust_alone(self):
        e = {n: (1 + table.PAPER[n]) / 1.2 - 1 for n in table.NAMES} | {"c_t": 0.01}
        at, s = table.levered(e)
        self.assertAlmostEqual(s, 1.2, places=9)
        self.assertAlmostEqual(at["I_zz"], table.PAPER["I_zz"], places=9)
        self.assertEqual(at["c_t"], 0.01)

    def test_static_c_t_of_table_one_is_that_of_the_vehicle_file(self):
        self.assertAlmostEqual(table.static_c_t(3.119e-6, -1.547e-4) / 1.897e-6, 1.0, delta=0.002)

    def test_the_truth_is_far_from_the_paper(self):
        e = table.errors({n: STUDY["true"][n] for n in table.NAMES}, STUDY)
        self.assertGreater(table.chi2(e, table.ASKED), table.LIMIT[4])
        self.assertEqual(table.signs(e), 0)


if __name__ == "__main__":
    unittest.main()
