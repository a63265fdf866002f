"""Every file of the data folder's thrust stands through `rotorloop stand estimate`: coefficients as published, faulty files named and no other.

usage: measured_stands_test.py PATH_TO_ROTORLOOP   (ROTORLOOP_DATA set; else skipped)
"""
import json
import os
import pathlib
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from rotorloop_cli import SOURCE, CommandTest, main  # noqa: E402

DATA = os.environ.get("ROTORLOOP_DATA")

# c ω² alone: N s², N m s². As docs/acceptance/diagnose_measured.md and the data folder's PROVENANCE files have them.
PUBLISHED = {
    "motor_10inch_prop.txt": (9.158e-6, 1.343e-7),
    "Log_2019-11-05_171350.csv": (4.418e-6, 5.870e-8),
    "Log_2019-11-07_174807.csv": (4.311e-6, 5.852e-8),
    "Log_2019-11-07_175456.csv": (4.295e-6, 5.828e-8),
    "Log_2019-11-07_184325.csv": (4.562e-6, 5.953e-8),
    "cf2.1-stock-prop.csv": (2.023e-8, None),
    "cf21bl_guards__feb25_2026_0.csv": (3.910e-8, None),
    "cf21_eckart1__data.csv": (2.019e-8, None),
    "cf21plus__data_feb_24_2026_250mah_battery0.csv": (1.435e-8, None),
    "cf21plus__data_feb_24_2026_350mah_battery0.csv": (1.426e-8, None),
}
FAULTY = {
    "xNova-SR-ramp.csv", "xNova-SR-steps.csv", "xNova-SR-steps-up.csv", "xNova-MR-steps.csv", "StepsTest_2020-06-16_214711.csv", "b4_7.csv", "b4_11.csv", "b7_7.csv",
    "b7_11.csv", "brushless_calibration__data_calib_brushless.csv", "cf21_imrc2025__data4.csv",
}
# Files whose columns another mapping than the folder's has; none: files that are no samples of a stand.
MAPPING = {"bitcraze_cf21_2021": "imrc_crazyflie"}
NO_SAMPLES = {"esc32v3_f60-1.csv", "f40_steps_5-2.csv", "cf20_2015_table.csv", "brushless_calibration__manual_data_calib_brushless.csv"}


@unittest.skipUnless(DATA, "ROTORLOOP_DATA is not set: measured stands are not estimated")
class MeasuredStands(CommandTest):
    def estimate(self, folder):
        mapping = MAPPING.get(folder.name, folder.name)
        files = sorted(f for f in folder.iterdir() if f.suffix != ".md" and f.name not in NO_SAMPLES)
        done = subprocess.run([self.program, "stand", "estimate", *files, "-m", SOURCE / f"vehicles/measured/stands/{mapping}.mapping.toml", "--draws", "100", "--json"],
                              capture_output=True, text=True, cwd=self.path)
        self.assertIn(done.returncode, (0, 5), done.stderr)
        return json.loads(done.stdout)["files"]

    def test_coefficients_within_1_percent_of_the_published_each_with_a_budget_and_11_faulty_files_named(self):
        files = [f for folder in sorted(pathlib.Path(DATA, "thrust_stand").iterdir()) if folder.is_dir() for f in self.estimate(folder)]
        self.assertEqual({f["file"] for f in files if f["verdict"] == "faulty"}, FAULTY)
        estimated, worst = 0, 0.0
        for f in files:
            for key in ("c_t", "c_q"):
                if key in f:
                    estimated += 1
                    squares = sum(term["u_relative"] ** 2 for term in f[key]["budget"])
                    self.assertAlmostEqual(squares ** 0.5, f[key]["u"] / f[key]["value"], delta=1e-6, msg=f["file"])
        found = {f["file"]: f for f in files}
        for name, values in PUBLISHED.items():
            for key, value in zip(("c_t", "c_q"), values):
                if value is None:
                    continue
                away = found[name][key]["proportional"] / value - 1.0
                print(f"[ measured ] {name} {key} {found[name][key]['proportional']:.4g}, published {value:.4g}: {100 * away:+.2f} %")
                worst = max(worst, abs(away))
                self.assertLess(abs(away), 0.01, f"{name} {key}")
        print(f"[ measured ] {len(files)} files, {estimated} coefficients with a budget, {len(PUBLISHED)} published files, farthest {100 * worst:.2f} %")

    def test_stand_of_two_crazyflies_against_their_identified_flights_as_published_and_not_decided(self):
        data = pathlib.Path(DATA)
        for vehicle, flights, stand, stand_c_t, flight_c_t in (
            ("imrc_cf21bl_bare", ("eckart00", "eckart06", "eckart12", "eckart17"), "cf21bl_guards__feb25_2026_0.csv", 3.81e-8, 3.71e-8),
            ("imrc_cf21_brushed", ("jana00", "jana02", "jana03", "jana06"), "cf21_eckart1__data.csv", 2.02e-8, 1.99e-8),
        ):
            files = SOURCE / "vehicles/measured"
            words = [word for f in flights for word in ("--flight", data / f"flights/{vehicle}/{f}.csv")]
            done = self.run_command("identify", *words, "-m", files / f"{vehicle}.mapping.toml", "--vehicle", files / f"{vehicle}.toml", "--use", "gyro,accel", "--rate", "100", "-q", "-o", f"{vehicle}.toml", timeout_s=600)
            self.assertEqual(done.returncode, 0, done.stderr)
            done = self.run_command("stand", "compare", data / "thrust_stand/imrc_crazyflie" / stand, "-m", files / "stands/imrc_crazyflie.mapping.toml", "--vehicle", f"{vehicle}.toml", "--density", "1.2", "--rotors-on-stand", "4", "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            found = json.loads(done.stdout)
            on_stand, in_flight = found["values"]
            print(f"[ measured ] {vehicle}: stand {on_stand['c_t_N_s2']:.4g}, flight {in_flight['c_t_N_s2']:.4g} N s^2: {found['verdict']}")
            self.assertLess(abs(on_stand["c_t_N_s2"] / stand_c_t - 1.0), 0.01)
            self.assertLess(abs(in_flight["c_t_N_s2"] / flight_c_t - 1.0), 0.01)
            self.assertEqual(found["pairs"][0]["verdict"], "cannot_tell")


del CommandTest

if __name__ == "__main__":
    main(sys.argv)
