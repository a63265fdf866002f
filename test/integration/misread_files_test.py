"""Ten mistakes that people make with logs and stands: the message says what was seen, with its number, and offers causes as likely ones.

A cause that is printed as a fact sends people to mend what is not broken. usage: misread_files_test.py PATH_TO_ROTORLOOP
"""
import csv
import io
import math
import socket
import sys

from rotorloop_cli import SOURCE, CommandTest, main

VEHICLE = SOURCE / "vehicles/calibrated.toml"
STAND_HEADER = "Time (s),ESC signal (µs),Thrust (N),Torque (N·m),Voltage (V),Current (A),Motor Electrical Speed (RPM)"
GUESSES = ("?", "probably", "exchanged", "not connected", "tared", "in another unit")  # of causes; not in what was seen


def stand_rows(change=lambda row: row):
    """A made-up 5-inch rotor, 24 steps up: thrust 1.1e-6 N s^2 omega^2, torque 1.4e-8 N m s^2 omega^2; at rest first and last."""
    rows = []
    for i in range(26):
        omega = 0.0 if i in (0, 25) else 500.0 + 70.0 * i
        ripple = 1.0 + 0.004 * math.sin(3.7 * i)
        rows.append(change({"t": i, "pwm": 1000 if omega == 0.0 else 1080 + 35 * i, "thrust": 1.1e-6 * omega**2 * ripple,
                            "torque": 1.4e-8 * omega**2 / ripple, "volt": 16.2 - 0.02 * i, "ampere": 0.1 + 2.2e-9 * omega**3,
                            "rpm": omega * 30.0 / math.pi}))
    lines = [",".join(f"{value:.6g}" for value in row.values()) for row in rows]
    return "\n".join([STAND_HEADER, *lines]) + "\n"


class MisreadFiles(CommandTest):
    def seen_and_likely(self, text):
        """[(what was seen, likely causes)] of each refusal or fault in `text`."""
        found, lines = [], text.splitlines()
        for i, line in enumerate(lines):
            if (": error: " in line or "refused: " in line) and "likely" not in line:
                likely = next((x for x in lines[i + 1:i + 3] if "likely:" in x), "")
                found.append((line, likely))
            elif "; likely: " in line:
                what, _, likely = line.partition("; likely: ")
                found.append((what, likely))
        return found

    def judged(self, done, seen, likely, code):
        text = done.stdout + done.stderr
        self.assertEqual(done.returncode, code, text)
        entry = next((e for e in self.seen_and_likely(text) if seen in e[0]), None)
        self.assertIsNotNone(entry, f"nothing says \"{seen}\":\n{text}")
        self.assertIn(likely, entry[1], text)
        for guess in GUESSES:
            self.assertNotIn(guess, entry[0], "a cause stands where only what was seen belongs")

    # --- logs ---
    def log_with(self, change):
        """The climb's flight.csv with the rows changed: change(names, row of text) for each."""
        self.assertEqual(self.run_command("hil", "s.toml", "-q").returncode, 0)
        lines = (self.path / "runs/short/climb/pd_ff/1/flight.csv").read_text(encoding="utf-8").splitlines()
        first = next(i for i, line in enumerate(lines) if not line.startswith("#"))
        names = lines[first].split(",")
        rows = [change(names, row) for row in csv.reader(io.StringIO("\n".join(lines[first + 1:])))]
        self.write("f.csv", "\n".join([*lines[:first + 1], *(",".join(r) for r in rows)]) + "\n")
        return self.run_command("log", "check", "f.csv", "--vehicle", VEHICLE)

    def log_scaled(self, start_of_name, factor):
        def change(names, row):
            return [f"{float(v) * factor:.9g}" if v and n.startswith(start_of_name) else v for n, v in zip(names, row)]
        return self.log_with(change)

    def test_stamps_in_milliseconds(self):
        self.judged(self.log_scaled(("t[s]", "pose_t[s]"), 1e3), "steps from sample to sample are 5 s (allowed", "ms where it says s (then 5 ms)", 5)

    def test_accelerometer_in_g(self):
        self.judged(self.log_scaled("accel_", 1 / 9.80665), "mean specific force upwards is 0.99", "the accelerometer is in g", 5)

    def test_rotor_speeds_in_revolutions_per_minute(self):
        self.judged(self.log_scaled("omega_", 30.0 / math.pi), "gives a thrust coefficient of 0.00032", "the speeds are in rev/min, read as rad/s", 5)

    def test_position_in_millimetres(self):
        self.judged(self.log_scaled("p_", 1e3), "times as large", "position is in mm, read as m", 5)

    def test_decimal_commas_in_a_table_separated_by_commas(self):
        done = self.log_with(lambda names, row: [v.replace(".", ",") for v in row])
        self.judged(done, "f.csv:12: error: has 67 cells, the header has 57", "decimals with a comma", 5)

    # --- stands ---
    def stand_with(self, column, change):
        self.write("stand.csv", stand_rows(lambda row: {**row, column: change(row[column])}))
        return self.run_command("stand", "estimate", "stand.csv", "--diameter", "0.127", "--density", "1.2")

    def test_stand_whose_speed_sensor_is_dead(self):
        done = self.stand_with("rpm", lambda v: 0.0)
        self.judged(done, "rotor 1 speed reads 0 in 22 of 22 points", "the speed sensor was not connected or lost the rotor, or the load cell was not tared", 5)

    def test_load_cell_that_was_not_tared(self):
        done = self.stand_with("thrust", lambda v: v + 0.3)
        self.judged(done, "thrust has a constant of 0.299 ± 0.0057 N", "the load cell was tared under load, or not at all", 0)
        self.assertNotIn("c_t, N s^2", done.stdout, "no coefficient from a reading with an unknown zero")

    def test_thrust_that_repeats_one_value(self):
        self.judged(self.stand_with("thrust", lambda v: 3.2), "thrust reads 3.2 N in all 24 points", "its instrument repeats one value", 0)

    def test_table_of_another_program(self):
        self.write("stand.csv", "throttle,grams,rpm\n50,120,9000\n")
        self.judged(self.run_command("stand", "estimate", "stand.csv"), "stand.csv:1: error: no header that is known", "another program's file", 2)

    def test_instrument_that_does_not_answer(self):
        silent = socket.create_server(("127.0.0.1", 0))  # accepts, and never answers
        self.addCleanup(silent.close)
        done = self.run_command("stand", "read", f"tcp:127.0.0.1:{silent.getsockname()[1]}", SOURCE / "devices/eagle_ei1000.toml", "--for", "0.05")
        self.judged(done, "no answer from", "another address or rate, no supply, or A and B exchanged", 3)


if __name__ == "__main__":
    main(sys.argv)
