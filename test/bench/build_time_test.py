"""scripts/build_time.py on two made-up projects, whose target rotorloop burns a known CPU time."""
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = Path(__file__).resolve().parents[2] / "scripts" / "build_time.py"
PRESETS = {"version": 6, "configurePresets": [{"name": "release", "generator": "Ninja", "binaryDir": "${sourceDir}/build/release"}]}
BURN = "import time\nwhile time.process_time() < {seconds}: pass\n"
PROJECT = """cmake_minimum_required(VERSION 3.25)
project(made_up LANGUAGES NONE)
file(WRITE ${{CMAKE_BINARY_DIR}}/launcher.txt "$ENV{{CMAKE_CXX_COMPILER_LAUNCHER}}")
add_custom_target(rotorloop COMMAND sh -c "test ! -s launcher.txt && {python} ${{CMAKE_SOURCE_DIR}}/burn.py" VERBATIM)
"""


def project(folder, seconds):
    folder.mkdir()
    (folder / "CMakePresets.json").write_text(json.dumps(PRESETS), encoding="utf-8")
    (folder / "CMakeLists.txt").write_text(PROJECT.format(python=sys.executable), encoding="utf-8")
    (folder / "burn.py").write_text(BURN.format(seconds=seconds), encoding="utf-8")


class BuildTime(unittest.TestCase):
    def run_with(self, here_s, other_s):
        with tempfile.TemporaryDirectory() as name:
            root = Path(name)
            project(root / "here", here_s)
            project(root / "other", other_s)
            done = subprocess.run([sys.executable, "-B", PROGRAM, "--against", root / "other", "--out", root / "out"], cwd=root / "here",
                                  env=os.environ | {"CMAKE_CXX_COMPILER_LAUNCHER": "ccache"}, capture_output=True, text=True)
            self.assertIn(done.returncode, (0, 6), done.stderr)
            left = [path.name for path in (root / "out").iterdir()]
            return done, json.loads((root / "out" / "build_time.json").read_text(encoding="utf-8")), left

    def test_1_s_against_3_s_is_a_ratio_below_half_and_ends_with_0(self):
        done, figures, left = self.run_with(1, 3)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertGreaterEqual(figures["here"]["cpu_s"], 1)
        self.assertGreaterEqual(figures["other"]["cpu_s"], 3)
        self.assertLess(figures["ratio"], 0.5)
        self.assertEqual(left, ["build_time.json"])  # no build folder stays

    def test_2_s_against_1_s_misses_the_limit_and_ends_with_6(self):
        done, figures, _ = self.run_with(2, 1)
        self.assertEqual(done.returncode, 6, done.stdout)
        self.assertGreater(figures["ratio"], 1)
        self.assertIn("limit 0.50: missed", done.stdout)


if __name__ == "__main__":
    unittest.main()
