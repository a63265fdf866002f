"""Installs the built tree and uses it as others do: a project that builds on the library, the command from a foreign folder.

usage: package_test.py BUILD_FOLDER CMAKE
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

CMAKE = sys.argv.pop()
BUILD = pathlib.Path(sys.argv.pop())
HERE = pathlib.Path(__file__).resolve().parent
WORK = BUILD / "package"
PREFIX = WORK / "prefix"
SHARE = PREFIX / "share" / "rotorloop"


def run(*words, cwd=WORK):
    return subprocess.run([str(w) for w in words], cwd=cwd, capture_output=True, text=True, encoding="utf-8", timeout=240)


def configure(folder, source, *options):
    return run(CMAKE, "-S", source, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_PREFIX_PATH={PREFIX}", *options)


def setUpModule():
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir()
    done = run(CMAKE, "--install", BUILD, "--prefix", PREFIX)
    assert done.returncode == 0, done.stderr


class Library(unittest.TestCase):
    def project(self, name, components):
        source = WORK / name
        source.mkdir()
        shutil.copy(HERE / "consumer" / "wire_only.cpp", source)
        (source / "CMakeLists.txt").write_text(
            f"cmake_minimum_required(VERSION 3.25)\nproject({name} CXX)\nfind_package(rotorloop REQUIRED COMPONENTS {components})\n"
            "add_executable(wire wire_only.cpp)\ntarget_link_libraries(wire rotorloop::protocols)\n", encoding="utf-8")
        return source

    def test_a_project_outside_flies_identifies_finds_its_own_effect_and_flies_with_another_gain(self):
        done = configure(WORK / "consumer", HERE / "consumer")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(CMAKE, "--build", WORK / "consumer")
        self.assertEqual(done.returncode, 0, done.stdout)
        done = run(WORK / "consumer" / "consumer", WORK / "flown")
        print(done.stdout, done.stderr)
        self.assertEqual(done.returncode, 0)
        self.assertIn("all as promised", done.stdout)
        self.same_as_the_command([line.split(" ", 1)[1].rsplit(" ", 2) for line in done.stdout.splitlines() if line.startswith("estimate ")])

    def same_as_the_command(self, estimates):
        """Names, values and uncertainties that the library found in the flights, to the last digit."""
        flights = [WORK / "flown" / name for name in ("vertical", "horizontal", "rotation")]
        done = run(PREFIX / "bin" / "rotorloop", "identify", "--vehicle", SHARE / "vehicles" / "hil_baseline.toml", "--flight", *flights,
                   "--rate", "50", "--term", "sideslip_yaw_moment", "--json", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        figures = json.loads(done.stdout)["figures"]
        self.assertGreater(len(estimates), 15)
        for name, value, u in estimates:
            self.assertEqual((float(value), float(u)), (figures[name]["value"], figures[name]["u"]), name)

    def test_a_repository_of_a_user_builds_its_controller_and_flies_it_within_its_own_limits(self):
        source = WORK / "own_repository"  # outside the source tree, as a user has it
        shutil.copytree(HERE.parent.parent / "docs" / "examples" / "own_controller", source)
        build = WORK / "own_repository_build"
        done = configure(build, source)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(CMAKE, "--build", build)
        self.assertEqual(done.returncode, 0, done.stdout)
        done = run(pathlib.Path(CMAKE).with_name("ctest"), "--test-dir", build, "--output-on-failure")
        self.assertEqual(done.returncode, 0, done.stdout)
        flown = json.loads((build / "runs" / "own-controller" / "result.json").read_text(encoding="utf-8"))
        self.assertEqual([(f["variant"], f["end"]) for f in flown["flights"]],
                         [(name, "completed") for name in ("pd_ff_thrust_drag", "my_controller", "python")])

    def test_the_wire_alone_needs_no_other_package(self):
        absent = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{p}=ON" for p in ("Eigen3", "fmt", "nlohmann_json", "tomlplusplus", "Ceres", "Threads")]
        source = self.project("wire_alone", "protocols")
        done = configure(WORK / "wire_build", source, *absent)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(CMAKE, "--build", WORK / "wire_build")
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_the_simulation_needs_no_ceres(self):
        done = configure(WORK / "sim_build", self.project("simulation_alone", "sim"), "-DCMAKE_DISABLE_FIND_PACKAGE_Ceres=ON")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_an_unknown_component_is_named_with_those_that_exist(self):
        done = configure(WORK / "unknown_build", self.project("unknown", "protocols controll"))
        self.assertNotEqual(done.returncode, 0)
        text = " ".join(done.stderr.split())
        self.assertIn("rotorloop has no component controll; use some of: protocols, control, log, estimate, identify, diagnose, sim", text)

    def test_nothing_installed_points_into_the_source_or_build_folder(self):
        for path in [*(PREFIX / "lib").rglob("*.cmake"), *SHARE.rglob("*.toml")]:
            text = path.read_text(encoding="utf-8")
            self.assertNotIn(str(HERE.parent.parent), text, path)


class Command(unittest.TestCase):
    program = PREFIX / "bin" / "rotorloop"

    def test_it_is_stripped(self):
        self.assertNotIn(b".symtab", self.program.read_bytes())

    def test_shipped_files_are_found_from_any_folder(self):
        done = run(self.program, "hil", "scenarios/paper.toml", "--dry-run")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(str(SHARE / "vehicles" / "gains.toml"), done.stdout)

    def test_a_file_of_the_working_folder_comes_before_the_shipped_one(self):
        (WORK / "scenarios").mkdir(exist_ok=True)
        self.addCleanup(shutil.rmtree, WORK / "scenarios")
        (WORK / "scenarios" / "paper.toml").write_text("format = 99\n", encoding="utf-8")
        done = run(self.program, "hil", "scenarios/paper.toml", "--dry-run")
        self.assertEqual(done.returncode, 2)
        self.assertIn("scenarios/paper.toml:1", done.stderr)

    def test_an_error_says_where_a_file_was_looked_for(self):
        done = run(self.program, "hil", "scenarios/papr.toml")
        self.assertEqual(done.returncode, 2)
        self.assertIn(f'"scenarios/papr.toml": looked for {WORK}/scenarios/papr.toml and {SHARE}/scenarios/papr.toml', done.stderr)

    def test_what_is_written_is_never_looked_for_among_shipped_files(self):
        done = run(self.program, "trajectory", "vertical_3p1", "-o", "vertical_3p1.toml")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((WORK / "vertical_3p1.toml").is_file())

    def test_docs_catalogue_manual_and_completion_are_there(self):
        for name in ("docs/manual.md", "docs/library.md", "effects/catalogue.toml", "README.md"):
            self.assertTrue((SHARE / name).is_file(), name)
        manual = (PREFIX / "share/man/man1/rotorloop.1").read_text(encoding="utf-8")
        self.assertTrue(manual.startswith(".TH ROTORLOOP 1"))
        for words in ("rotorloop hil compare", "rotorloop diagnose"):
            self.assertIn(f'.SH "{words}"', manual)

    def test_bash_completes_commands_and_options(self):
        code = (PREFIX / "share/bash-completion/completions/rotorloop").read_text(encoding="utf-8")

        def completed(*words):
            script = f'{code}\nCOMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _rotorloop; echo "${{COMPREPLY[*]}}"'
            return run("bash", "-c", script, "bash", *words).stdout.split()

        self.assertEqual(completed("rotorloop", "di"), ["diagnose"])
        self.assertEqual(completed("rotorloop", "hil", "comp"), ["compare"])
        self.assertEqual(completed("rotorloop", "hil", "compare", "--fail"), ["--fail-on-diff"])
        self.assertNotIn("completion", completed("rotorloop", ""))


if __name__ == "__main__":
    unittest.main()
