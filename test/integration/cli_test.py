"""The built `rotorloop` command with bad input: exit codes, what goes to which stream, and texts that say what to do.

usage: cli_test.py PATH_TO_ROTORLOOP
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

ROTORLOOP = os.path.abspath(sys.argv.pop(1))

SCENARIO = """format = 1
name = "first"
plant = "plant.toml"
vehicle = "vehicle.toml"
seeds = [1]
variants = ["pd_ff"]
[controller]
gains = "gains.toml"
[[flight]]
name = "h"
trajectory = "h.toml"
"""


class BadInput(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)
        for name in ("plant.toml", "vehicle.toml", "gains.toml", "h.toml"):
            self.write(name, "format = 1\n")

    def write(self, name, text):
        path = self.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return name

    def run_command(self, *words, program=None):
        return subprocess.run([program or ROTORLOOP, *words], cwd=self.path, capture_output=True, text=True, encoding="utf-8", timeout=60)

    def refused(self, *words, says, code=2, program=None):
        """The command ends with `code`, prints nothing on stdout, and its message has every part of `says`."""
        done = self.run_command(*words, program=program)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        for part in says:
            self.assertIn(part, done.stderr)
        self.assertLess(len(done.stderr), 2000, "a message, not a core dump")

    def test_version_and_help_are_data(self):
        done = self.run_command("--version")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stdout, r"^rotorloop \d+\.\d+\.\d+ ")
        done = self.run_command("hil", "--help")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("Examples:", done.stdout)
        self.assertIn("Exit codes:", done.stdout)

    def test_no_command(self):
        self.refused(says=["subcommand"])

    def test_unknown_command_and_option(self):
        self.refused("launch", says=['rotorloop: error: "launch" is not a command', "use one of: hil"])
        self.refused("hil", "--sedes", "3", says=["rotorloop hil --sedes: error:", "see rotorloop hil --help"])

    def test_hil_without_scenario(self):
        self.refused("hil", says=["no scenario given", "do:"])

    def test_missing_scenario(self):
        self.refused("hil", "no/such.toml", says=["no/such.toml: error: no such file"])

    def test_scenario_is_a_folder(self):
        self.refused("hil", ".", says=["error:"])

    def test_scenario_that_is_not_toml(self):
        self.refused("hil", self.write("s.toml", "format = = 1"), says=["s.toml:1: error: not valid TOML"])
        (self.path / "b.toml").write_bytes(bytes(range(256)) * 20)
        self.refused("hil", "b.toml", says=["b.toml:1: error: not valid TOML"])
        self.refused("hil", self.write("empty.toml", ""), says=['key "format" is missing'])

    def test_misspelt_key_names_its_line(self):
        self.refused("hil", self.write("s.toml", SCENARIO.replace("seeds =", "speeds = 3\nseeds =")), says=['s.toml:5: error: unknown key "speeds"', "docs/files.md"])

    def test_backend_that_is_not_built_in(self):
        text = SCENARIO + '[bus]\nesc = "socketcan:can0"\n'
        self.refused("hil", self.write("s.toml", text), says=["s.toml:13: error:", "built in: virtual:"])

    def test_missing_plant_shows_where_it_was_sought(self):
        self.refused("hil", self.write("sub/s.toml", SCENARIO), says=["sub/s.toml:3: error: plant", "sub/plant.toml"])

    def test_bad_inputs_leave_no_run_folder(self):
        self.refused("hil", self.write("s.toml", SCENARIO), says=["plant.toml"])  # the plant file is empty
        self.assertFalse((self.path / "runs").exists())

    def test_bad_seeds_and_variants(self):
        self.write("s.toml", SCENARIO)
        self.refused("hil", "s.toml", "--seeds", "1..x", says=["--seeds: error:", "1,4,7..9"])
        self.refused("hil", "s.toml", "--variants", "mpc", says=["--variants: error:", "pd_ff_thrust_drag"])

    def test_dry_run_reads_every_file_without_flying(self):
        self.refused("hil", self.write("s.toml", SCENARIO), "--dry-run", says=["plant.toml"])  # the plant file is empty
        shipped = pathlib.Path(__file__).resolve().parents[2] / "scenarios" / "paper.toml"
        done = self.run_command("hil", str(shipped), "--seeds", "1", "--dry-run")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("3 flights x 3 variants x 1 seeds = 9 runs", done.stdout)
        self.assertIn("40.0 A phase current limit (it holds up to 40.1 A with 15 uH at 16.8 V on b_g431b_esc1)", done.stdout)
        self.assertFalse((self.path / "runs").exists())

    def test_compare_of_what_is_no_run(self):
        self.refused("hil", "compare", "a", "b", says=["a: error: is not a run folder"])
        self.refused("hil", "compare", "a", says=["B"])
        self.write("a/result.json", json.dumps({"format": 7}))
        self.refused("hil", "compare", "a", "a", says=["a/result.json: error:", "format 7"], code=5)

    def test_report_of_what_is_no_run(self):
        self.refused("hil", "report", "a", says=["a: error: is not a run folder"])

    def test_rotor_validate_needs_measured_data_and_says_how_to_name_them(self):
        data = os.environ.pop("ROTORLOOP_DATA", None)
        try:
            self.refused("rotor", "validate", says=["ROTORLOOP_DATA: error: is not set", "do:"], code=5)
            os.environ["ROTORLOOP_DATA"] = str(self.path)
            self.refused("rotor", "validate", says=["holds no folder propellers", "do:"], code=5)
            (self.path / "propellers").mkdir()
            self.refused("rotor", "validate", says=["propellers/apc_4.2x4: error: not found", "do:"], code=5)
            self.refused("rotor", "validate", "--propeller", "apc_5x5", says=['"apc_5x5" is not a measured propeller', "da4002_5x3.75"])
            self.refused("rotor", "validate", "--stall-drag", "2", says=["--stall-drag", "see rotorloop rotor validate --help"])
        finally:
            os.environ.pop("ROTORLOOP_DATA", None)
            if data is not None:
                os.environ["ROTORLOOP_DATA"] = data

    IDLE = ("--out", "v.toml", "--report", "r", "--held-out", "h.csv", "--without", "linear_drag", "--no-checks")
    IDLE_NAMES = ("--out", "--report", "--held-out", "--without", "--no-checks")

    def test_diagnose_of_stand_files_refuses_by_name_the_options_that_only_flights_have(self):
        self.refused("diagnose", "--stand", "s.csv", "-m", "m.toml", *self.IDLE, "--flight", "f.csv", says=[*self.IDLE_NAMES, "--flight", "thrust stand", "do:"])
        self.refused("diagnose", "--stand", "s.csv", "-m", "m.toml", "--seed", "7", "--json", says=["m.toml: error: no such file"])
        self.assertFalse((self.path / "r").exists())

    def test_diagnose_of_logs_without_rotor_speeds_refuses_by_name_the_options_that_act_on_fits_alone(self):
        rows = "".join(f"{0.01 * i:.2f},0,0,1,{','.join(['0.5'] * 4)}\n" for i in range(1000))
        self.write("f.csv", "t,x,y,z,a,b,c,d\n" + rows)
        self.write("m.toml", '''format = 1
name = "commands"
log = "csv"
[time]
column = "t"
unit = "s"
[[stream]]
quantity = "position"
columns = ["x", "y", "z"]
unit = "m"
[[stream]]
quantity = "motor_command"
columns = ["a", "b", "c", "d"]
full_scale = 1
''')
        vehicle = str(pathlib.Path(__file__).resolve().parents[2] / "vehicles" / "paper.toml")
        words = ("diagnose", "--vehicle", vehicle, "-m", "m.toml", "--flight", "f.csv")
        self.refused(*words, *self.IDLE, "--json", says=[*self.IDLE_NAMES, "--json", "no rotor speeds", "do:"])
        for word in self.IDLE_NAMES:
            self.assertNotIn(word, self.run_command(*words, "--quiet").stderr)
        self.assertFalse((self.path / "r").exists())
        self.refused(*words, "--reference", "f.csv", says=["--reference: error: 1 given, at least 2 needed", "do:"])

    STUDIES = property(lambda self: str(pathlib.Path(ROTORLOOP).with_name("rotorloop-studies")))

    def test_effects_names_the_known_ones_and_writes_no_page(self):
        self.refused("effects", "--effect", "nonsense", "-o", "e.md",
                     says=['--effect: error: "nonsense" is not an effect of the plant', "use one of:", "axial_inflow", "weak_rotor"], program=self.STUDIES)
        self.refused("effects", "--effect", "tether", "--scenario", "no.toml", says=["no.toml: error: no such file"], program=self.STUDIES)
        self.write("s.toml", SCENARIO)
        self.refused("effects", "--scenario", "s.toml", says=["plant.toml"], program=self.STUDIES)
        self.assertFalse((self.path / "e.md").exists())

    def test_effects_measures_what_it_is_asked_for(self):
        shipped = pathlib.Path(__file__).resolve().parents[2] / "scenarios" / "effects.toml"
        done = self.run_command("effects", "--scenario", str(shipped), "--effect", "blockage_strut", "--effect", "gyroscopic",
                                "--probes-only", "--json", program=self.STUDIES)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        probes = json.loads(done.stdout)["probes"]
        self.assertEqual({p["effect"] for p in probes}, {"blockage_strut", "gyroscopic"})
        strut = next(p for p in probes if p["effect"] == "blockage_strut")
        self.assertAlmostEqual(strut["measured"], -8.0, places=6)

    def test_effects_flies_with_15_rad_s_of_noise_on_reported_rotor_speeds_instead_of_never_being_ready(self):
        shipped = pathlib.Path(__file__).resolve().parents[2] / "scenarios" / "effects.toml"
        done = self.run_command("effects", "--scenario", str(shipped), "--effect", "rotor_speed_noise", "--seeds", "1", "-q", program=self.STUDIES)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = [line for line in done.stdout.splitlines() if line.startswith("| `rotor_speed_noise`")]
        self.assertEqual(len(rows), 1, done.stdout)
        self.assertNotIn("safe_state", rows[0])

    def test_rotor_plot_of_bad_blades_names_the_line_and_writes_no_page(self):
        shipped = pathlib.Path(__file__).resolve().parents[2] / "vehicles" / "blades" / "triblade_5in.toml"
        text = shipped.read_text(encoding="utf-8")
        self.refused("rotor", "plot", "no/such.toml", says=["no/such.toml: error: no such file"])
        self.refused("rotor", "plot", self.write("empty.toml", ""), says=['key "format" is missing'])
        radii_in_mm = self.write("mm.toml", text.replace("r_m = 0.0127", "r_m = 12.7"))
        self.refused("rotor", "plot", radii_in_mm, says=["mm.toml:", "r_m = 12.7 m", "do:"])
        self.refused("rotor", "plot", self.write("b.toml", text), says=['polar "naca4410" not found', "do:"])
        self.refused("rotor", "plot", str(shipped), "--rpm", "0", says=["--rpm", "see rotorloop rotor plot --help"])
        self.refused("rotor", "plot", str(shipped), "--rpm", "50", says=["50 RPM", "--rpm"])
        for option in ("--rpm", "--density", "--climb", "--edgewise"):
            self.refused("rotor", "plot", str(shipped), option, "nan", says=[option, "nan"])
        self.refused("rotor", "plot", str(shipped), "--spin", "left", says=["--spin", "ccw"])
        self.refused("rotor", "plot", says=["blade", "required"])
        self.assertFalse((self.path / "rotor.html").exists())

    def test_rotor_plot_writes_one_page_whose_pictures_are_valid_xml(self):
        shipped = pathlib.Path(__file__).resolve().parents[2] / "vehicles" / "blades" / "triblade_5in.toml"
        done = self.run_command("rotor", "plot", str(shipped), "-o", "page.html", "--rpm", "9000", "--climb", "-2")
        self.assertEqual((done.returncode, done.stderr, done.stdout), (0, "", "page.html\n"))
        page = (self.path / "page.html").read_text(encoding="utf-8")
        self.assertLess(len(page), 2_000_000)
        pictures = re.findall(r"<svg class=\"plot\".*?</svg>\n</figure>", page, re.DOTALL)
        self.assertGreaterEqual(len(pictures), 18)
        for picture in pictures:
            xml.etree.ElementTree.fromstring(picture.removesuffix("</figure>"))
        self.refused("rotor", "plot", str(shipped), "-o", "no/folder/page.html", says=["no/folder/page.html", "cannot be written"], code=3)


if __name__ == "__main__":
    unittest.main()
