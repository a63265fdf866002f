"""An independent DroneCAN implementation (pydronecan) against `rotorloop esc-sim` on multicast: who is there, speed commands, silence.

ROTORLOOP_PYDRONECAN names a checkout of pydronecan with one of DSDL beside it; without it the test is skipped (77), counted by ctest.
usage: pydronecan_test.py PATH_TO_ROTORLOOP
"""
import os
import pathlib
import subprocess
import sys
import time
import unittest

import bus_namespace

CHECKOUT = os.environ.get("ROTORLOOP_PYDRONECAN")
PLANT = pathlib.Path(__file__).resolve().parents[3] / "vehicles/reference_plant.toml"
DEADLINE_s = 60
UNIQUE_ID = "000102030405060708090a0b0c0d0e0f"


class Pydronecan(unittest.TestCase):
    program = None

    def setUp(self):
        self.esc = subprocess.Popen([self.program, "esc-sim", "--bus", "mcast:5", "--node-id", "21", "--esc-index", "1", "--unique-id", UNIQUE_ID,
                                     "--plant", str(PLANT)], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(self.end)
        self.node = dronecan.make_node("mcast:5", node_id=127)
        self.addCleanup(self.node.close)
        self.reports = []
        self.node.add_handler(dronecan.uavcan.equipment.esc.Status, lambda e: self.reports.append(e.message))

    def end(self):
        self.esc.kill()
        self.esc.communicate()

    def spin_until(self, what, condition):
        end = time.monotonic() + DEADLINE_s
        while time.monotonic() < end:
            try:
                self.node.spin(0.05)
            except dronecan.UAVCANException as error:
                self.fail(f"{what}: {error}")
            if condition():
                return
        self.fail(f"{what}: not within {DEADLINE_s} s")

    def command(self, message):
        self.node.broadcast(dronecan.uavcan.equipment.safety.ArmingStatus(status=255))
        self.node.broadcast(message)

    def ask(self, request):
        """The response of node 21, whatever it takes; None when it does not answer (pydronecan gives up after a second)."""
        answers = []
        self.node.request(request, 21, answers.append)
        self.spin_until("an answer or its time-out", lambda: answers)
        return answers[0].response if answers[0] else None

    def test_finds_the_esc_and_reads_who_it_is(self):
        monitor = dronecan.app.node_monitor.NodeMonitor(self.node)
        self.spin_until("GetNodeInfo of node 21", lambda: monitor.exists(21) and monitor.get(21).info)
        info = monitor.get(21).info
        self.assertEqual(str(info.name), "org.rotorloop.esc")
        self.assertEqual(bytes(info.hardware_version.unique_id).hex(), UNIQUE_ID)
        self.spin_until("operational and well", lambda: (monitor.get(21).status.mode, monitor.get(21).status.health) == (0, 0))

    def test_speed_commands_turn_the_motor_within_one_percent_and_silence_stops_it(self):
        self.spin_until("a report", lambda: self.reports)
        self.assertEqual(self.reports[-1].esc_index, 1)
        self.assertAlmostEqual(self.reports[-1].voltage, 16.3, delta=0.5)
        repeated = self.node.periodic(0.02, lambda: self.command(dronecan.uavcan.equipment.esc.RPMCommand(rpm=[0, 6000])))
        self.spin_until("6000 rpm, six reports in a row", lambda: len(self.reports) > 6 and all(abs(r.rpm - 6000) <= 60 for r in self.reports[-6:]))
        self.assertGreater(self.reports[-1].current, 0.1)
        repeated.remove()
        self.spin_until("standstill", lambda: self.reports[-1].rpm == 0)

    def test_raw_commands_turn_the_motor_and_disarming_stops_it(self):
        self.spin_until("a report", lambda: self.reports)
        repeated = self.node.periodic(0.02, lambda: self.command(dronecan.uavcan.equipment.esc.RawCommand(cmd=[0, 2500])))
        self.spin_until("turning", lambda: self.reports[-1].rpm > 2000)
        repeated.remove()
        self.node.broadcast(dronecan.uavcan.equipment.safety.ArmingStatus(status=0))
        self.spin_until("standstill", lambda: self.reports[-1].rpm == 0)


if __name__ == "__main__":
    if not CHECKOUT or not (pathlib.Path(CHECKOUT) / "dronecan").is_dir():
        print("skipped: 1 program; ROTORLOOP_PYDRONECAN names no checkout of pydronecan")
        sys.exit(bus_namespace.SKIPPED)
    bus_namespace.enter()
    Pydronecan.program = os.path.abspath(sys.argv.pop(1))
    sys.path.insert(0, CHECKOUT)
    import dronecan  # noqa: E402
    import dronecan.app.node_monitor  # noqa: E402
    unittest.main(argv=sys.argv)
