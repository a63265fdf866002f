"""`stand run` and `stand estimate` as commands on the virtual stand: a run in still air and one in wind, to a vehicle file with c_q(J) and a motor file.

usage: wind_test.py PATH_TO_ROTORLOOP
"""
import json
import pathlib
import sys
import tomllib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from rotorloop_cli import SOURCE, CommandTest, main  # noqa: E402


class WindOnTheStand(CommandTest):
    def stand_run(self, name, *more):
        done = self.run_command("stand", "run", SOURCE / "devices/virtual/stand.toml", "--virtual", "--plant", SOURCE / "vehicles/reference_plant.toml", "--rpm", "4000,11000", "--sequence", "staircase",
                                "-q", "-o", name, *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return tomllib.loads((self.path / name / "run.toml").read_text())

    def test_a_run_in_wind_beside_one_in_still_air_gives_c_q_of_the_advance_ratio_and_a_motor_file_with_R_within_5_and_L_within_5_percent(self):
        self.assertIn("winding", self.stand_run("still"))
        self.assertEqual(self.stand_run("wind", "--wind", "6")["wind"]["airspeed_m_s"], 6.0)
        done = self.run_command("stand", "estimate", "still", "--wind", "wind", "--vehicle", SOURCE / "vehicles/calibrated.toml", "--vehicle-out", "v.toml", "-o", "motor.toml",
                                "--base", SOURCE / "vehicles/motors/2306_2300kv.toml", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads(done.stdout)["files"][0]["torque_in_wind"]
        c_q2 = found["c_q2"]
        self.assertLess(c_q2["value"], -3.0 * c_q2["u"], "wind along the axis relieves the rotor")
        self.assertLess(found["rms_N_m"], 0.6 * found["constant_rms_N_m"])
        vehicle = tomllib.loads((self.path / "v.toml").read_text())
        self.assertEqual(vehicle["format"], 2)
        self.assertEqual(vehicle["torque_model"]["c_q2_N_m_s2"]["origin"], "stand")
        motor, truth = (tomllib.loads(path.read_text()) for path in (self.path / "motor.toml", SOURCE / "vehicles/motors/2306_2300kv.toml"))
        self.assertAlmostEqual(motor["resistance_ohm"] / truth["resistance_ohm"], 1.0, delta=0.05)
        for axis in ("d", "q"):
            self.assertAlmostEqual(motor["inductance_H"][axis] / truth["inductance_H"][axis], 1.0, delta=0.05)

    def test_without_a_commissioning_R_is_of_the_run_and_two_runs_beside_one_in_wind_are_refused(self):
        self.assertNotIn("winding", self.stand_run("still", "--no-commission"))
        done = self.run_command("stand", "estimate", "still", "--json")
        self.assertEqual(json.loads(done.stdout)["files"][0]["motor"]["resistance_from"], "run")
        done = self.run_command("stand", "estimate", "still", "still", "--wind", "still")
        self.assertEqual(done.returncode, 2)
        self.assertIn("belongs to one run in still air, and 2 are given", done.stderr)


del CommandTest

if __name__ == "__main__":
    main(sys.argv)
