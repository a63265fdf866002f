"""The command from an empty folder: shipped vehicles, profiles, polars, mappings and scenarios are found beside the program, built or installed.

usage: shipped_files_test.py PATH_TO_ROTORLOOP
"""
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

from rotorloop_cli import SOURCE, CommandTest, main

SIX_INCH = ("--mass-kg", 0.75, "--wheelbase-mm", 265, "--propeller", "6x4.5", "--kv", 1700, "--resistance-mohm", 90, "--cells", 4, "--current-limit-A", 35)
HOVER = "t,x,y,z,qw,qx,qy,qz\n" + "".join(f"{0.01 * i:.2f},0,0,1,1,0,0,0\n" for i in range(200))


class InAnEmptyFolder(unittest.TestCase):
    """Nothing of the source tree is here, and no variable of the environment names it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        self.program = CommandTest.program

    def call(self, *words):
        return subprocess.run([str(self.program), *map(str, words)], cwd=self.path, capture_output=True, text=True, encoding="utf-8", timeout=120,
                              env={"PATH": os.environ["PATH"], "HOME": str(self.path)})

    def succeeds(self, *words):
        done = self.call(*words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def finds_all(self):
        self.succeeds("vehicle", "new", "six_inch", *SIX_INCH)
        self.assertTrue((self.path / "six_inch/polars/naca4410.toml").exists())
        self.assertIn("eagle_ei1000", self.succeeds("stand", "profile", "list"))
        self.succeeds("stand", "profile", "show", "eagle_ei1000")
        self.succeeds("stand", "check", "devices/examples/stand.toml")
        self.succeeds("stand", "run", "devices/virtual/stand.toml", "--virtual", "--dry-run")
        self.assertIn("paper", self.succeeds("hil", "scenarios/paper.toml", "--dry-run"))
        self.succeeds("gains", "--vehicle", "vehicles/calibrated.toml", "--plant", "vehicles/reference_plant.toml")
        (self.path / "mocap.csv").write_text(HOVER, encoding="utf-8")
        refused = self.call("log", "info", "mocap.csv", "-m", "vehicles/measured/imrc_cf21bl_bare.mapping.toml")
        self.assertIn("imrc_cf21bl_bare.mapping.toml", refused.stderr)
        self.assertIn("*_mocap.csv beside the log, which is not there", refused.stderr)  # the mapping was read; it is that of another log


class AsBuilt(InAnEmptyFolder):
    def test_the_command_just_built_finds_every_kind_of_shipped_file(self):
        self.finds_all()

    def test_a_link_to_it_from_another_folder_does_too(self):
        link = self.path / "rotorloop"
        link.symlink_to(self.program)
        self.program = link
        self.succeeds("vehicle", "new", "six_inch", *SIX_INCH)

    def test_an_instrument_is_read_by_the_name_of_its_profile(self):
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        server = subprocess.Popen([str(self.program), "stand", "emulate", "eagle_ei1000", "--tcp", str(port), "--for", "60"], cwd=self.path,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            server.stdout.readline()  # printed when it listens
            self.assertIn("eagle_ei1000", self.succeeds("stand", "read", f"tcp:127.0.0.1:{port}", "eagle_ei1000", "--for", 0.2))
        finally:
            server.terminate()
            server.communicate(timeout=60)

    def test_a_file_of_the_working_folder_goes_before_the_shipped_one_of_that_name(self):
        (self.path / "scenarios").mkdir()
        (self.path / "scenarios/paper.toml").write_text("format = 99\n", encoding="utf-8")
        self.assertIn("99", self.call("hil", "scenarios/paper.toml", "--dry-run").stderr)

    def test_help_names_defaults_as_they_are_shipped(self):
        said = self.succeeds("rotor", "fit", "--help")
        self.assertIn("vehicles/polars", said)
        self.assertNotIn(str(SOURCE), said)


class CopiedAway(InAnEmptyFolder):
    """The program alone in <prefix>/bin."""

    def setUp(self):
        super().setUp()
        prefix = tempfile.TemporaryDirectory()
        self.addCleanup(prefix.cleanup)
        self.prefix = pathlib.Path(prefix.name).resolve()
        (self.prefix / "bin").mkdir()
        self.program = pathlib.Path(shutil.copy(CommandTest.program, self.prefix / "bin/rotorloop"))

    def test_with_its_files_in_share_as_a_package_has_them_it_finds_every_kind(self):
        share = self.prefix / "share/rotorloop"
        share.mkdir(parents=True)
        for folder in ("vehicles", "devices", "scenarios", "effects"):
            (share / folder).symlink_to(SOURCE / folder)
        self.finds_all()

    def test_without_them_it_says_where_it_looked(self):
        for words, name in ((("vehicle", "new", "six_inch", *SIX_INCH), "vehicles/polars/naca4410.toml"),
                            (("stand", "profile", "show", "eagle_ei1000"), "devices/eagle_ei1000.toml"),
                            (("hil", "scenarios/paper.toml", "--dry-run"), "scenarios/paper.toml")):
            done = self.call(*words)
            self.assertNotEqual(done.returncode, 0)
            for folder in (self.path.resolve(), self.prefix / "share/rotorloop"):
                self.assertIn(str(folder / name), done.stderr)
            self.assertIn("no folder of shipped files is beside the program", done.stderr)


if __name__ == "__main__":
    main(sys.argv)
