"""What goes wrong on a first day: each mistake ends with a message that names what and where it is, and what to do, in one style.

usage: mistakes_test.py PATH_TO_ROTORLOOP
"""
import sys

from rotorloop_cli import FIT, SCENARIO, SOURCE, CommandTest, main

VEHICLE = str(SOURCE / "vehicles/calibrated.toml")
FOREIGN = "time,px,py,pz\n" + "".join(f"{0.01 * i:.2f},0,0,1\n" for i in range(100))


class Mistakes(CommandTest):
    def refused(self, *words, says, code=2, never=()):
        done = self.run_command(*words)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertEqual(done.stdout, "")
        for part in says:
            self.assertIn(part, done.stderr)
        for part in never:
            self.assertNotIn(part, done.stderr)
        first = done.stderr.splitlines()[0]
        self.assertRegex(first, r"^\S[^:]*(:\d+)?: error: \S", "one prefix for all: where, then the word error")
        self.assertIn("\n  do:     ", done.stderr)
        self.assertLess(len(done.stderr), 3000, "a message, not a core dump")

    # --- words on the command line ---
    def test_misspelt_command(self):
        self.refused("identfy", says=['rotorloop: error: "identfy" is not a command', 'did you mean "identify"?'])

    def test_misspelt_subcommand(self):
        self.refused("rotor", "plto", says=['rotorloop rotor: error: "plto" is not a command', 'did you mean "plot"?'])

    def test_misspelt_option(self):
        self.refused("hil", "s.toml", "--sedes", "3", says=["rotorloop hil --sedes: error:", 'did you mean "--seeds"?', "see rotorloop hil --help"])

    def test_misspelt_option_is_named_before_a_missing_one(self):
        self.refused("calibrate", "--plnt", "p.toml", says=["rotorloop calibrate --plnt: error:", 'did you mean "--plant"?'], never=["required"])

    def test_option_given_twice(self):
        self.refused("hil", "s.toml", "--name", "a", "--name", "b", says=["rotorloop hil --name: error: is given more than once"])

    def test_missing_option(self):
        self.refused("calibrate", "--plant", "p.toml", "-o", "v.toml", says=["rotorloop calibrate: error:", "--vehicle is required"])

    def test_misspelt_word_of_an_option(self):
        self.refused("identify", *FIT, "--flight", "f.csv", "--noise", "emm", says=["rotorloop identify --noise: error:", 'did you mean "em"?'])

    def test_misspelt_name_of_a_shipped_flight(self):
        self.refused("trajectory", "horizntal_8p5", says=['did you mean "horizontal_8p5"?'])

    def test_misspelt_controller(self):
        self.refused("hil", "s.toml", "--variants", "pd_ff_drg", says=["rotorloop hil --variants: error:", 'did you mean "pd_ff_drag"?'])

    def test_misspelt_flight(self):
        self.refused("hil", "s.toml", "--flights", "clim", says=["rotorloop hil --flights: error:", 'did you mean "climb"?'])

    def test_seeds_that_are_no_numbers(self):
        self.refused("hil", "s.toml", "--seeds", "1..x", says=["rotorloop hil --seeds: error:", "1,4,7..9"])

    def test_misspelt_effect_of_the_plant(self):
        self.refused("effects", "--scenario", SOURCE / "scenarios/effects.toml", "--effect", "wek_rotor", says=['did you mean "weak_rotor"?'])

    def test_misspelt_effect_to_leave_out(self):
        self.refused("diagnose", *FIT, "--flight", "f.csv", "--without", "wind_stedy", says=["rotorloop diagnose --without: error:", 'did you mean "wind_steady"?'])

    def test_misspelt_term_and_parameter(self):
        self.assertEqual(self.run_command("hil", "s.toml", "-q").returncode, 0)
        log = "runs/short/climb/pd_ff/1"
        self.refused("identify", *FIT, "-q", "--flight", log, "--term", "rotor_local_inflw", says=['did you mean "rotor_local_inflow"?'])
        self.refused("identify", *FIT, "-q", "--flight", log, "--free", "torque_model.cq", says=['did you mean "torque_model.c_q"?'])

    # --- options that would do nothing ---
    def test_options_that_do_nothing_are_refused(self):
        plant = ("--plant", SOURCE / "vehicles/reference_plant.toml", "--vehicle", VEHICLE, "-o", "v.toml")
        self.refused("hil", "s.toml", "--dry-run", "--json", says=["rotorloop hil --json: error: does nothing with --dry-run"])
        self.refused("diagnose", *FIT, "--flight", "f.csv", "--wrench-band", "0,5", says=["--wrench-band: error: does nothing without --held-out"])
        self.refused("calibrate", *plant, "--trajectory", "climb.toml", "--variant", "pd_ff", says=["--variant: error: does nothing without --flown"])
        self.refused("identify", "--names", "--vehicle", VEHICLE, says=["rotorloop identify --vehicle: error: does nothing with --names"])
        self.refused("effects", "--probes-only", "--seeds", "3", says=["--seeds: error: does nothing with --probes-only"])

    def test_one_name_for_two_runs(self):
        self.refused("hil", "s.toml", self.write("t.toml", SCENARIO.replace('"short"', '"other"')), "--name", "n", says=["--name: error: names one run, but 2 scenarios"])

    # --- files ---
    def test_file_that_is_not_there(self):
        self.refused("hil", "no/such.toml", says=["no/such.toml: error: no such file", "the folder where the command runs"], never=["file that names"])

    def test_typed_path_is_not_blamed_on_the_scenario(self):
        self.refused("hil", "s.toml", "--vehicle", "none.toml", says=["rotorloop hil --vehicle: error:", "none.toml"], never=["s.toml"])

    def test_misspelt_key_is_named_with_its_line_before_the_missing_one(self):
        self.write("s.toml", SCENARIO.replace("seeds =", "sedes ="))
        self.refused("hil", "s.toml", says=['s.toml:5: error: unknown key "sedes"', '"seeds"'], never=["is missing"])

    def test_misspelt_word_in_a_file(self):
        self.write("s.toml", SCENARIO.replace('["pd_ff"]', '["pd_f"]'))
        self.refused("hil", "s.toml", says=["s.toml:6: error:", 'did you mean "pd_ff"?'])

    def test_misspelt_effect_in_a_plant_file(self):
        plant = (SOURCE / "vehicles/reference_plant.toml").read_text(encoding="utf-8").replace('"blades/', f'"{SOURCE}/vehicles/blades/').replace('"motors/', f'"{SOURCE}/vehicles/motors/')
        self.write("plant.toml", plant + '\n[[effect]]\nid = "wek_rotor"\n')
        self.write("s.toml", SCENARIO.replace(f"{SOURCE}/vehicles/reference_plant.toml", "plant.toml"))
        self.refused("hil", "s.toml", says=["plant.toml:", 'did you mean "weak_rotor"?'])

    def test_key_with_another_unit(self):
        text = (SOURCE / "vehicles/calibrated.toml").read_text(encoding="utf-8")
        self.assertIn("mass", text)
        self.write("v.toml", text.replace("[mass_kg]", "[mass_g]").replace("mass_kg =", "mass_g ="))
        self.refused("hil", "s.toml", "--vehicle", "v.toml", says=["v.toml:", "mass_g", "mass_kg"])

    def test_log_of_another_tool_without_a_mapping(self):
        self.write("f.csv", FOREIGN)
        self.refused("identify", *FIT, "--flight", "f.csv", says=["f.csv", "px", "mapping"])

    def test_log_that_is_no_log(self):
        self.write("f.csv", "hello\n")
        self.refused("log", "info", "f.csv", says=["f.csv"])

    def test_format_that_cannot_be_written(self):
        self.refused("log", "convert", "f.csv", "-o", "f.txt", says=["f.txt", ".ulg"])

    def test_flight_that_is_held_out_and_fitted(self):
        self.assertEqual(self.run_command("hil", "s.toml", "-q").returncode, 0)
        log = "runs/short/climb/pd_ff/1"
        self.refused("identify", *FIT, "-q", "--flight", log, "--held-out", log, says=["is held out and also fitted"])

    def test_no_flight_at_all(self):
        self.refused("identify", *FIT, says=["rotorloop identify: error: no flight is named", "--flight"])

    # --- what would be overwritten ---
    def test_run_that_exists(self):
        self.assertEqual(self.run_command("hil", "s.toml", "-q", "--no-logs").returncode, 0)
        before = (self.path / "runs/short/result.json").read_bytes()
        self.refused("hil", "s.toml", "-q", says=["runs/short: error: this run exists already", "--force", "--name"])
        self.assertEqual((self.path / "runs/short/result.json").read_bytes(), before)

    def test_files_that_exist_are_not_replaced_without_force(self):
        self.write("v.toml", "precious\n")
        self.write("r/result.json", "precious\n")
        for option, name, words in (("-o", "v.toml", ("identify", *FIT, "--flight", "f.csv", "-o", "v.toml")),
                                    ("--report", "r/result.json", ("identify", *FIT, "--flight", "f.csv", "--report", "r")),
                                    ("--report", "r/result.json", ("diagnose", *FIT, "--flight", "f.csv", "--report", "r")),
                                    ("-o", "v.toml", ("trajectory", "vertical_3p1", "-o", "v.toml")),
                                    ("-o", "v.toml", ("rotor", "plot", SOURCE / "vehicles/blades/triblade_5in.toml", "-o", "v.toml"))):
            with self.subTest(words=words):
                self.refused(*words, says=[f"{option}: error: ", f'"{name}" exists already', "--force"])
                self.assertEqual((self.path / name).read_text(encoding="utf-8"), "precious\n")
        self.assertEqual(self.run_command("trajectory", "vertical_3p1", "-o", "v.toml", "--force").returncode, 0)
        self.assertNotEqual((self.path / "v.toml").read_text(encoding="utf-8"), "precious\n")

    def test_folder_where_a_file_is_wanted_and_the_other_way_round(self):
        (self.path / "d").mkdir()
        self.refused("identify", *FIT, "--flight", "f.csv", "-o", "d", says=["-o: error:", "is a folder, and a file is wanted"])
        self.refused("identify", *FIT, "--flight", "f.csv", "--report", "s.toml", says=["--report: error:", "is a file, and a folder is wanted"])

    def test_folder_that_is_not_there_is_found_before_the_work(self):
        self.refused("identify", *FIT, "--flight", "f.csv", "-o", "no/such/v.toml", says=["-o: error:", "there is no folder no/such", "mkdir -p no/such"], code=3)

    def test_what_is_no_run(self):
        self.refused("hil", "report", "nowhere", says=["nowhere: error: is not a run folder"])
        self.refused("hil", "compare", "nowhere", "nowhere", says=["nowhere: error: is not a run folder"])


if __name__ == "__main__":
    main(sys.argv)
