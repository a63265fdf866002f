"""`rotorloop esc-sim` turns a motor, and its bus goes: the motor is at rest within its command time-out, the commander ends by name, and the
ESC goes on, at rest, when the bus is there again. In the guest, on vcan0 and on an emulated adapter.

usage: lost_bus_test.py ROTORLOOP CANDLELIGHT
"""
import json
import pathlib
import sys
import tempfile
import unittest

from other_programs_test import OnABus, OnAdapters, ip, wait_for

PLANT = pathlib.Path(__file__).resolve().parents[2] / "vehicles/reference_plant.toml"
TIMEOUT_ms = 250
STEP_ms = 2  # of its log


class EscAtALostBus:
    """`ours` and `theirs`: the bus as the ESC and as the commander name it."""

    def turn_and_lose(self, ours, theirs, lose, find, why):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        log = pathlib.Path(folder.name) / "bridge.csv"
        esc = self.start(self.rotorloop, "esc-sim", "--bus", ours, "--node-id", "21", "--esc-index", "0", "--plant", PLANT, "--bridge-log", log, "--wait")
        spin = self.start(self.rotorloop, "esc", "spin", "--bus", theirs, "--index", "0", "--rpm", "3000", "--for", "600", "--yes", "--json")

        def changes():
            return [line.split(",") for line in log.read_text().splitlines()[1:]] if log.exists() else []
        wait_for("a motor that turns", lambda: spin.poll() is not None or [c for c in changes() if c[1] == "on"])
        self.assertIsNone(spin.poll(), "the commander ended")
        before = len(changes())
        lose()
        wait_for("a bridge that is off", lambda: len(changes()) > before)
        _, state, age_ms = changes()[-1]
        self.assertEqual(state, "off")
        self.assertLessEqual(float(age_ms), TIMEOUT_ms + STEP_ms)
        out, errors = spin.communicate(timeout=1000)
        self.assertEqual(spin.returncode, 3, out + errors)
        self.assertIn(why, errors)
        find()
        dump = self.start(self.rotorloop, "bus", "dump", theirs, "--json", "--filter", "00040A00/00FFFF00", "--count", "5")
        reports, _ = self.ended(dump)
        self.assertEqual([json.loads(line)["fields"]["rpm"] for line in reports.splitlines()], [0] * 5)
        self.assertIsNone(esc.poll(), "the ESC goes on")
        self.assertEqual(changes()[-1][1], "off")
        print(f"{ours} lost: off {float(age_ms):.1f} ms after the newest command, at rest when it was back", flush=True)


class OnVcan(EscAtALostBus, OnABus):
    def test_an_interface_that_is_set_down_leaves_the_motor_at_rest(self):
        self.turn_and_lose("socketcan:vcan0", "socketcan:vcan0", lambda: ip("link", "set", "vcan0", "down"), lambda: ip("link", "set", "vcan0", "up"), "down")


class OnAnAdapter(EscAtALostBus, OnAdapters):
    def test_adapters_that_are_pulled_leave_the_motor_at_rest(self):
        def pull():
            self.tell("unplug FAR")
            self.tell("unplug NEAR")

        def plug():
            for name in ("FAR", "NEAR"):
                self.tell(f"plug {name} 1 0")
            wait_for("the commander's adapter", lambda: self.place("FAR") and self.interface("FAR"))
        self.turn_and_lose("gsusb:NEAR", "gsusb:FAR", pull, plug, "unplugged")


if __name__ == "__main__":
    OnABus.rotorloop, OnABus.candlelight = sys.argv[1:]
    suite = unittest.TestSuite(unittest.defaultTestLoader.loadTestsFromTestCase(case) for case in (OnVcan, OnAnAdapter))
    sys.exit(not unittest.TextTestRunner(verbosity=2).run(suite).wasSuccessful())
