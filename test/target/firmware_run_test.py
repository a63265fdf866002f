"""The program of the ST B-G431B-ESC1 on the emulated STM32G431 and its board, by `rotorloop mcu run`: nothing on the bus orders anything.

usage: firmware_run_test.py ROTORLOOP ELF
Skipped (77) where the ELF was not built (firmware_test.py builds it).
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

FOR_s = 0.5
SAMPLES_Hz = 24000
START_s = 0.05  # clocks, converters, charge of the high sides: before the first sample
STACK_BOUND_bytes = 5300  # scripts/firmware --check adds up 5212 along the call graph


class ProgramOnTheEmulatedChip(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.runs = [cls.run_once() for _ in range(2)]

    @classmethod
    def run_once(cls):
        with tempfile.TemporaryDirectory() as folder:
            uart = pathlib.Path(folder) / "uart.txt"
            done = subprocess.run([ROTORLOOP, "mcu", "run", ELF, "--for", str(FOR_s), "--json", "--uart", str(uart)],
                                  capture_output=True, text=True, timeout=300)
            assert done.returncode == 0, done.stdout + done.stderr
            return json.loads(done.stdout), uart.read_text()

    def test_starts_without_a_fault_a_reset_or_an_access_that_the_chip_does_not_have(self):
        run, line = self.runs[0]
        self.assertEqual((run["cfsr"], run["hfsr"], run["resets"], run["refused"]), (0, 0, 0, 0))
        self.assertEqual((run["end"], run["hclk_Hz"]), ("time", 170_000_000))
        self.assertRegex(line, r"^rotorloop clocks 0+ adc 0+ can\b")

    def test_samples_24000_times_a_second_within_2700_cycles_in_the_mean_and_3600_at_most(self):
        sample = {i["exception"]: i for i in self.runs[0][0]["interrupts"]}["interrupt 18"]
        self.assertLessEqual(sample["count"], SAMPLES_Hz * FOR_s)
        self.assertGreater(sample["count"], SAMPLES_Hz * (FOR_s - START_s))
        self.assertLess(sample["mean_cycles"], 2700)
        self.assertLess(sample["longest_cycles"], 3600)
        print(f"sample interrupt: {sample['mean_cycles']:.0f} cycles in the mean, {sample['longest_cycles']} at most")

    def test_keeps_the_stack_within_the_bound_of_its_call_graph(self):
        run = self.runs[0][0]
        self.assertGreater(run["stack_bytes"], 1000)
        self.assertLess(run["stack_bytes"], STACK_BOUND_bytes)
        self.assertLess(STACK_BOUND_bytes, run["stack_room_bytes"])

    def test_turns_no_motor_without_a_set_point_and_never_asks_for_both_gates_of_a_leg(self):
        run = self.runs[0][0]
        self.assertLess(run["fastest_rpm"], 10.0)
        self.assertEqual(run["both_gates_on"], 0)

    def test_runs_the_same_twice(self):
        self.assertEqual(self.runs[0], self.runs[1])


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    ELF, ROTORLOOP = sys.argv.pop(), sys.argv.pop()
    if not pathlib.Path(ELF).is_file():
        print("skipped: 5 tests; the program was not built")
        sys.exit(77)
    unittest.main()
