"""A vehicle of one's own, from nine numbers to a flight, by the commands that `vehicle new` prints; and the shipped gains as their command makes them.

usage: vehicle_test.py PATH_TO_ROTORLOOP
"""
import shlex

from rotorloop_cli import SOURCE, CommandTest, main

SIX_INCH = ("--mass-kg", 0.75, "--wheelbase-mm", 265, "--propeller", "6x4.5", "--kv", 1700, "--resistance-mohm", 90, "--cells", 4, "--current-limit-A", 35)


class Vehicle(CommandTest):
    def succeeds(self, *words):
        done = self.run_command(*words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def test_nine_numbers_end_in_a_flight_by_the_commands_that_are_printed(self):
        printed = self.succeeds("vehicle", "new", "my/six_inch", *SIX_INCH).stdout.splitlines()
        self.assertEqual(printed[-1], "rotorloop hil my/six_inch/flights.toml")
        for line in printed[:-1]:
            self.succeeds(*shlex.split(line)[1:])
        done = self.succeeds(*shlex.split(printed[-1])[1:], "--seeds", 1, "--flights", "vertical", "--variants", "pd_ff_thrust_drag", "--no-logs")
        error_cm = self.result("runs/six_inch")["flights"][0]["error_cm"]["mean_3d"]
        self.assertLess(error_cm, 5.0, "within a few centimetres of the set-point, as every shipped vehicle")
        self.assertIn("six_inch", done.stdout)

    def ask_for_45_A(self, plant):
        text = (self.path / plant).read_text(encoding="utf-8")
        (self.path / plant).write_text(text.replace("phase_current_limit_A = 35", "phase_current_limit_A = 45"), encoding="utf-8")

    def not_served(self, *words):
        done = self.run_command(*words)
        self.assertEqual(done.returncode, 2, done.stdout)
        self.assertIn("plant.toml: error: esc.phase_current_limit_A = 45 A cannot be served: the ESC holds at most 40.1 A", done.stderr)
        self.assertIn("give 40.1 A at most", done.stderr)

    def test_a_current_limit_that_the_board_cannot_hold_is_refused_with_the_number_that_it_can(self):
        self.refused(["--current-limit-A = 42 A cannot be served", "40.1 A with 13.9 uH at 16.8 V on b_g431b_esc1", "give 40.1 A at most"], current_limit_A=42)
        self.refused(["holds at most 4.7 A", "1.22 uH at 4.2 V on small_2s_15a"], current_limit_A=15, kv=19500, cells=1)
        made = self.run_command("vehicle", "new", "my/six_inch", *SIX_INCH)
        self.assertIn("phase current limit 35 A; the ESC holds up to 40.1 A with 13.9 uH", made.stderr)
        lab = self.run_command("esc-lab", "--plant", "my/six_inch/plant.toml", "--only", "sag", "--draws", 1, "-q")
        self.assertIn("35 A; the ESC holds up to 40.1 A with 14 uH at 16.8 V", lab.stdout)
        self.ask_for_45_A("my/six_inch/plant.toml")
        self.not_served("esc-lab", "--plant", "my/six_inch/plant.toml", "--only", "sag", "--draws", 1, "-q")
        for name in ("horizontal_8p5", "vertical_3p1"):
            self.succeeds("trajectory", name, "-o", f"my/six_inch/{name.split('_')[0]}.toml")
        flights = (self.path / "my/six_inch/flights.toml").read_text(encoding="utf-8")
        flights = flights.replace("calibrated.toml", "start.toml").replace('"gains.toml"', f'"{SOURCE}/vehicles/gains.toml"')
        (self.path / "my/six_inch/flights.toml").write_text(flights, encoding="utf-8")
        self.not_served("hil", "my/six_inch/flights.toml", "--dry-run")
        self.not_served("hil", "my/six_inch/flights.toml")

    def refused(self, says, **changed):
        numbers = dict(zip(SIX_INCH[::2], SIX_INCH[1::2])) | {"--" + k.replace("_", "-"): v for k, v in changed.items()}
        done = self.run_command("vehicle", "new", "my/wrong", *[w for pair in numbers.items() for w in pair])
        self.assertEqual(done.returncode, 2, done.stdout)
        for part in says:
            self.assertIn(part, done.stderr)
        self.assertFalse((self.path / "my/wrong/plant.toml").exists())

    def test_numbers_that_no_vehicle_has_are_refused_with_range_and_remedy(self):
        self.refused(["--mass-kg is 750 kg", "0.02 to 20 kg", "weigh the vehicle"], mass_kg=750)
        self.refused(["--propeller (diameter) is 9 in", "where blades touch"], propeller="9x4.5")
        self.refused(['--propeller is "six"', "6x4.5 or 5.1x4.6x3"], propeller="six")
        self.refused(["--current-limit-A is 80 A", "0.5 to 45 A", "power stage"], **{"current_limit_A": 80})

    def test_shipped_gains_are_those_that_the_command_makes(self):
        for size in (3, 7, 10, 17):
            folder = SOURCE / f"vehicles/quad_{size}in"
            done = self.succeeds("gains", "--vehicle", folder / "calibrated.toml", "--plant", folder / "plant.toml")
            self.assertEqual(done.stdout, (folder / "gains.toml").read_text(encoding="utf-8"), folder.name)

    def test_gains_want_a_plant_or_the_figures_of_a_stand(self):
        done = self.run_command("gains", "--vehicle", "vehicles/calibrated.toml")
        self.assertEqual(done.returncode, 2)
        self.assertIn("neither --plant nor both of --motor-lag and --max-rpm", done.stderr)
        self.succeeds("gains", "--vehicle", "vehicles/calibrated.toml", "--motor-lag", 10, "--max-rpm", 17000, "-o", "gains.toml")

    def test_a_trajectory_slows_down_to_what_was_asked_for(self):
        done = self.succeeds("trajectory", "horizontal_8p5", "--max-speed", 4, "-o", "slow.toml")
        self.assertIn("2.12 times slower", done.stderr)
        self.assertIn("4.00 m/s horizontally", done.stderr)
        again = self.succeeds("trajectory", "slow.toml", "--max-speed", 4)  # a file, and already slow enough
        self.assertEqual(again.stdout, (self.path / "slow.toml").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main(__import__("sys").argv)
