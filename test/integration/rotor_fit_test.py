"""`rotorloop rotor polar` and `rotor fit` as a user runs them: polars by xfoil, kept, without xfoil, damaged sections, one JSON document.

usage: rotor_fit_test.py PATH_TO_ROTORLOOP
"""
import json
import math
import os
import re
import shlex
import shutil
import stat
import sys
import tomllib
import unittest

from rotorloop_cli import SOURCE, CommandTest, hover_rpm, main

GEOMETRY = "r/R   c/R     beta\n0.15  0.120  41.4\n0.30  0.159  36.4\n0.50  0.178  25.8\n0.75  0.180  18.9\n1.00  0.022  15.5\n"
STATIC = "RPM   CT    CP\n" + "".join(f"{rpm}  {0.118 + 0.001 * i:.3f} {0.055 - 0.0005 * i:.4f}\n" for i, rpm in enumerate(range(2000, 6000, 500)))


def surface(x, sign):
    half = 0.5 * (0.2969 * math.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    return f"{x:.6f} {0.03 * math.sin(math.pi * x) + sign * half:.6f}\n"


def section(n=60):
    xs = [0.5 * (1 - math.cos(math.pi * i / n)) for i in range(n + 1)]
    return "Half sine 10 %\n" + "".join(surface(x, 1) for x in reversed(xs)) + "".join(surface(x, -1) for x in xs[1:])


class RotorFit(CommandTest):
    def setUp(self):
        super().setUp()
        os.symlink(SOURCE / "vehicles", self.path / "vehicles")
        self.write("prop/geom.txt", GEOMETRY)
        self.write("prop/static.txt", STATIC)
        self.write("my.dat", section())
        (self.path / "out/blades").mkdir(parents=True)
        self.environment = {k: v for k, v in os.environ.items() if k != "ROTORLOOP_DATA"}
        self.environment["XDG_CACHE_HOME"] = str(self.path / "cache")

    def call(self, *words, path=None):
        before = dict(os.environ)
        os.environ.clear()
        os.environ.update(self.environment, **({"PATH": path} if path is not None else {}))
        try:
            return self.run_command(*words)
        finally:
            os.environ.clear()
            os.environ.update(before)

    def fit(self, *words, path=None):
        return self.call("rotor", "fit", "prop", "--diameter", 0.2, "-o", "out/blades/p.toml", "--force", *words, path=path)

    def fake_xfoil(self, body):
        (self.path / "bin").mkdir()
        program = self.path / "bin/xfoil"
        program.write_text("#!/bin/sh\necho ' XFOIL Version 6.99'\n" + body, encoding="utf-8")
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        return f"{self.path}/bin:/usr/bin:/bin"

    @unittest.skipUnless(shutil.which("xfoil"), "xfoil is not installed (apt install xfoil)")
    def test_xfoil_gives_the_shipped_polar_within_its_last_digit_where_both_have_the_angle(self):
        done = self.call("rotor", "polar", "4410", "--reynolds", "80000", "-o", "p.toml")
        self.assertEqual(done.returncode, 0, done.stderr)
        made = tomllib.loads((self.path / "p.toml").read_text(encoding="utf-8"))
        shipped = tomllib.loads((SOURCE / "vehicles/polars/naca4410.toml").read_text(encoding="utf-8"))
        tables = {t["reynolds"]: t for t in shipped["table"]}
        compared = 0
        for table in made["table"]:
            for key, digit in (("cl", 1.01e-4), ("cd", 1.01e-5)):
                of = dict(zip(made["alpha_deg"], table[key]))
                for alpha, value in zip(shipped["alpha_deg"], tables[table["reynolds"]][key]):
                    if alpha in of and -12 <= alpha <= 17:
                        self.assertAlmostEqual(of[alpha], value, delta=digit, msg=f"{key} at {alpha} deg, Re {table['reynolds']}")
                        compared += 1
        self.assertGreater(compared, 100)

    @unittest.skipUnless(shutil.which("xfoil"), "xfoil is not installed (apt install xfoil)")
    def test_coordinates_end_in_a_polar_that_is_kept_until_a_point_changes(self):
        call = ("rotor", "polar", "my.dat", "--reynolds", "60000", "-o", "p.toml", "--force")
        first = self.call(*call)
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertIn("Re 60000 (1 of 1)", first.stderr)
        text = (self.path / "p.toml").read_text(encoding="utf-8")
        again = self.call(*call)
        self.assertIn("kept from before", again.stdout)
        self.assertNotIn("Re 60000", again.stderr)
        self.assertEqual((self.path / "p.toml").read_text(encoding="utf-8"), text)
        self.write("my.dat", section().replace(surface(0.5, 1), "0.500000 0.0720\n", 1))
        self.assertNotIn("kept", self.call(*call).stdout)

    def test_without_xfoil_the_nearest_shipped_section_stands_in_and_output_and_files_say_so(self):
        os.remove(self.path / "prop/static.txt")  # nothing to fit: quicker
        done = self.fit("--section", "2409", path="/nonexistent")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = "xfoil is not on PATH (apt install xfoil): polars of the shipped naca4410 stand for NACA 2409"
        self.assertIn(said, done.stdout)
        self.assertIn(said, (self.path / "out/blades/p.toml").read_text(encoding="utf-8"))
        refused = self.fit("--section", "my.dat", path="/nonexistent")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("apt install xfoil", refused.stderr)

    def test_an_xfoil_that_hangs_is_ended_at_the_limit_and_nothing_of_it_is_kept(self):
        path = self.fake_xfoil("read first; [ \"$first\" = QUIT ] && exit 0\nexec sleep 600\n")
        done = self.call("rotor", "polar", "4410", "--reynolds", "100000", "--sweep-limit", "1", "-o", "p.toml", path=path)
        self.assertEqual(done.returncode, 2)
        self.assertIn("XFOIL converges at no Reynolds number", done.stderr)
        self.assertFalse((self.path / "cache").exists())

    def test_an_xfoil_that_crashes_is_named_with_what_to_check(self):
        path = self.fake_xfoil("read first; [ \"$first\" = QUIT ] && exit 0\nkill -FPE $$\n")
        done = self.call("rotor", "polar", "4410", "--reynolds", "100000", "-o", "p.toml", path=path)
        self.assertEqual(done.returncode, 3)
        self.assertIn("floating-point exception", done.stderr)

    def test_a_damaged_section_is_refused_with_line_and_value_before_anything_runs(self):
        self.write("my.dat", section().replace(surface(0.5, 1), "0.500000 0.97\n", 1))
        done = self.fit("--section", "my.dat")
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, r"my\.dat:\d+")
        self.assertIn("0.97", done.stderr)
        self.assertIn("4 % at 40 %", self.fit("--section", "4012").stderr)

    def test_json_is_one_document_with_files_scalars_errors_and_where_polars_are_from(self):
        done = self.fit("--json", path="/nonexistent")
        self.assertEqual(done.returncode, 0, done.stderr)
        d = json.loads(done.stdout)
        self.assertEqual((d["format"], d["kind"], d["name"], d["fitted"]), (1, "blade_fit", "p", True))
        for file in d["files"]:
            self.assertTrue((self.path / file).is_file(), file)
        self.assertIn("out/blades/p.toml", d["files"])
        blade = tomllib.loads((self.path / "out/blades/p.toml").read_text(encoding="utf-8"))
        [geometry] = d["geometries"]
        scalars = {s["name"]: s for s in geometry["scalars"]}
        self.assertEqual(len(scalars), 4)
        for name, key in (("pitch offset", "pitch_offset_deg"), ("lift scale", "lift_scale"), ("drag scale", "drag_scale"), ("stall delay", "stall_delay")):
            match = [s for n, s in scalars.items() if n.startswith(name)]
            self.assertEqual(len(match), 1, scalars.keys())
            self.assertAlmostEqual(match[0]["value"], blade[key], places=6)
            self.assertEqual(match[0]["standard_error"] is None, match[0]["at_bound"])
        parts = {(e["label"], e["part"]): e["fitted"]["rows"] for e in geometry["errors"]}
        self.assertEqual(parts, {("static", "fitted"): 4, ("static", "held_out"): 4})
        self.assertEqual([(p["section"], p["from"]) for p in d["polars"]], [("naca4410", "shipped")])
        os.remove(self.path / "prop/static.txt")
        stand_in = json.loads(self.fit("--json", "--section", "2409", path="/nonexistent").stdout)
        self.assertEqual(stand_in["polars"][0]["from"], "stand_in")
        self.assertIn("xfoil is not on PATH", stand_in["polars"][0]["remarks"][0])
        self.assertEqual((stand_in["fitted"], stand_in["geometries"]), (False, []))

    def test_a_blade_just_fitted_flies_on_a_vehicle_made_from_it_and_hovers_at_its_speed_within_3_percent(self):
        self.assertEqual(self.fit(path="/nonexistent").returncode, 0)
        vehicle = ("--mass-kg", 0.9, "--wheelbase-mm", 330, "--kv", 900, "--resistance-mohm", 90, "--cells", 4, "--current-limit-A", 35)
        new = self.call("vehicle", "new", "my/own", *vehicle, "--blade", "out/blades/p.toml")
        self.assertEqual(new.returncode, 0, new.stderr)
        self.assertEqual((self.path / "my/own/blades/propeller.toml").read_bytes(), (self.path / "out/blades/p.toml").read_bytes())
        predicted = float(re.search(r"hover at (\d+) RPM by the blade", new.stderr).group(1))
        for line in new.stdout.splitlines()[:-1]:
            done = self.call(*shlex.split(line)[1:])
            self.assertEqual(done.returncode, 0, f"{line}: {done.stderr}")
        self.call("hil", "my/own/flights.toml", "--seeds", 1, "--flights", "vertical", "--variants", "pd_ff_thrust_drag")
        [flight] = self.result("runs/own")["flights"]
        self.assertEqual(flight["end"], "completed")
        self.assertLess(flight["error_cm"]["mean_3d"], 5)
        flown = hover_rpm(self.path / "runs/own/vertical/pd_ff_thrust_drag/1/truth.csv")
        self.assertLess(abs(flown / predicted - 1), 0.03)

    def test_vehicle_new_takes_a_blade_or_two_numbers_and_a_blade_that_can_carry_it(self):
        os.remove(self.path / "prop/static.txt")
        self.assertEqual(self.fit(path="/nonexistent").returncode, 0)
        vehicle = ("--wheelbase-mm", 330, "--kv", 900, "--resistance-mohm", 90, "--cells", 4, "--current-limit-A", 35)
        for more, said in (((), "--propeller and --blade: one of them is needed"), (("--blade", "out/blades/p.toml", "--propeller", "8x4"), "one alone")):
            refused = self.call("vehicle", "new", "my/own", "--mass-kg", 0.9, *vehicle, *more)
            self.assertEqual(refused.returncode, 2)
            self.assertIn(said, refused.stderr)
        heavy = self.call("vehicle", "new", "my/own", "--mass-kg", 20, *vehicle, "--blade", "out/blades/p.toml")
        self.assertEqual(heavy.returncode, 2)
        self.assertRegex(heavy.stderr, r"hover asks each rotor for 49.1 N; this blade gives \d+(\.\d+)? N at Mach 0.6")
        self.assertFalse((self.path / "my/own").exists())


if __name__ == "__main__":
    main(sys.argv)
