"""What tests of the built command share: run it in a folder of its own, with small files that it can read."""
import json
import math
import os
import pathlib
import subprocess
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]

CLIMB = """format = 1
name = "short climb"
[[segment]]
duration_s = 0.5
x_m = [0]
y_m = [0]
z_m = [2]
yaw_rad = [0]
[[segment]]
duration_s = 2
x_m = [0]
y_m = [0]
z_m = [2, 0, 0, 0, 2.1875, -2.625, 1.09375, -0.15625]
yaw_rad = [0]
[[segment]]
duration_s = 0.5
x_m = [0]
y_m = [0]
z_m = [3]
yaw_rad = [0]
"""

SCENARIO = f"""format = 1
name = "short"
plant = "{SOURCE}/vehicles/reference_plant.toml"
vehicle = "{SOURCE}/vehicles/calibrated.toml"
seeds = [1]
variants = ["pd_ff"]
[controller]
gains = "{SOURCE}/vehicles/gains.toml"
[[flight]]
name = "climb"
trajectory = "climb.toml"
"""

MISSED_LIMIT = """[limits]
mean_tracking_error_cm = {{ flight = "climb", variant = "{variant}", max = 0.001 }}
"""

# Two seconds of climbing determine few numbers: the rest is held.
FIT = ("--vehicle", SOURCE / "vehicles/calibrated.toml", "--use", "gyro,accel", "--hold", "body", "--hold", "thrust_model",
       "--hold", "torque_model", "--hold", "drag", "--hold", "pose_sensor", "--hold", "pose_delay")


STUDIES = ("effects", "nanodrone", "oracles")


class CommandTest(unittest.TestCase):
    program = None  # set by main()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        self.write("climb.toml", CLIMB)
        self.write("s.toml", SCENARIO)

    def write(self, name, text):
        path = self.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return name

    def command_line(self, *words):
        """What starts with the name of a study is one of the program beside the command."""
        program = self.program if str(words[0]) not in STUDIES else str(pathlib.Path(self.program).with_name("rotorloop-studies"))
        return [program, *map(str, words)]

    def run_command(self, *words, timeout_s=120):
        return subprocess.run(self.command_line(*words), cwd=self.path, capture_output=True, text=True, encoding="utf-8", timeout=timeout_s)

    def result(self, folder):
        return json.loads((self.path / folder / "result.json").read_text(encoding="utf-8"))

    def page(self, folder):
        return (self.path / folder / "report.html").read_text(encoding="utf-8")


HOVER_S = (2.5, 3.5)  # the shipped flights rest there, and begin to move at 4 s


def hover_rpm(truth):
    """Mean of the four rotors while the vehicle hovers, from the plant's own log (truth.csv)."""
    lines = [line for line in truth.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    names = lines[0].split(",")
    time = names.index("t[s]")
    rotors = [i for i, name in enumerate(names) if name.startswith("true_omega_")]
    rows = [line.split(",") for line in lines[1:]]
    values = [float(row[i]) for row in rows if HOVER_S[0] <= float(row[time]) <= HOVER_S[1] for i in rotors if row[i]]
    return sum(values) / len(values) * 30 / math.pi


def main(argv):
    CommandTest.program = os.path.abspath(argv.pop(1))
    unittest.main(module="__main__", argv=argv)
