"""An independent DroneCAN implementation (pydronecan) against `rotorloop esc-sim` on multicast, in a guest on SocketCAN (test/vm): who is
there, speed commands, silence, parameters, saving, restart, its allocator and its file server.

ROTORLOOP_PYDRONECAN names the folder that holds its package `dronecan` (scripts/check sets it to that of build/venv); without it the test is
skipped (77), counted by ctest.
usage: pydronecan_test.py PATH_TO_ROTORLOOP [INTERFACE]   of SocketCAN; without: multicast, in a network namespace of its own
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

import bus_namespace

CHECKOUT = os.environ.get("ROTORLOOP_PYDRONECAN")
SOURCE = pathlib.Path(__file__).resolve().parents[3]
PLANT = SOURCE / "vehicles/reference_plant.toml"
DEADLINE_s = 60
UNIQUE_ID = "000102030405060708090a0b0c0d0e0f"


class Pydronecan(unittest.TestCase):
    program = None
    bus, interface = "mcast:5", None

    def setUp(self):
        self.start_esc("21")
        # Its choice for an interface where python-can is installed calls what python-can does not have (4.6).
        driver = dronecan.driver.SocketCAN(self.interface) if self.interface else dronecan.driver.make_driver(self.bus)
        self.node = dronecan.node.Node(driver, node_id=127)
        self.addCleanup(self.node.close)
        self.reports = []
        self.node.add_handler(dronecan.uavcan.equipment.esc.Status, lambda e: self.reports.append(e.message))

    def start_esc(self, node_id):
        self.esc = subprocess.Popen([self.program, "esc-sim", "--bus", self.bus, "--node-id", node_id, "--esc-index", "1", "--unique-id", UNIQUE_ID,
                                     "--plant", str(PLANT)], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(self.end, self.esc)

    @staticmethod
    def end(esc):
        esc.kill()
        esc.communicate()

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

    def test_reads_sets_saves_and_restarts(self):
        param = dronecan.uavcan.protocol.param
        self.spin_until("a report", lambda: self.reports)
        read = {}
        for index in range(200):
            response = self.ask(param.GetSet.Request(index=index))
            self.assertIsNotNone(response, f"parameter {index}")
            if not str(response.name):
                break
            read[str(response.name)] = response
        self.assertGreaterEqual(len(read), 40)
        status = read["status_Hz"]
        self.assertEqual((status.value.integer_value, status.default_value.integer_value, status.max_value.integer_value), (50, 50, 200))
        answer = self.ask(param.GetSet.Request(name="status_Hz", value=param.Value(integer_value=77)))
        self.assertEqual(answer.value.integer_value, 77)
        self.assertTrue(self.ask(param.ExecuteOpcode.Request(opcode=param.ExecuteOpcode.Request().OPCODE_SAVE)).ok)
        self.assertFalse(self.ask(dronecan.uavcan.protocol.RestartNode.Request(magic_number=1)).ok)
        magic = dronecan.uavcan.protocol.RestartNode.Request().MAGIC_NUMBER
        self.assertTrue(self.ask(dronecan.uavcan.protocol.RestartNode.Request(magic_number=magic)).ok)
        self.assertEqual(self.ask(param.GetSet.Request(name="status_Hz")).value.integer_value, 77)

    def test_its_allocator_gives_an_id(self):
        self.end(self.esc)
        monitor = dronecan.app.node_monitor.NodeMonitor(self.node)
        allocator = dronecan.app.dynamic_node_id.CentralizedServer(self.node, monitor)
        self.addCleanup(allocator.close)
        self.start_esc("auto")
        own = bytes.fromhex(UNIQUE_ID)

        def table():
            return {bytes(uid): node for uid, node in allocator.get_allocation_table() if uid}
        self.spin_until("an id in its table", lambda: own in table())
        given = table()[own]
        self.spin_until("a node with this id", lambda: monitor.exists(given) and monitor.get(given).info)
        self.assertEqual(bytes(monitor.get(given).info.hardware_version.unique_id).hex(), UNIQUE_ID)

    def test_its_file_server_updates_the_firmware(self):
        with tempfile.TemporaryDirectory() as folder:
            image = pathlib.Path(folder) / "new.bin"
            subprocess.run([sys.executable, SOURCE / "scripts/make_test_image", image, "--version", "3.9", "--size", "20000"], check=True, timeout=120)
            monitor = dronecan.app.node_monitor.NodeMonitor(self.node)
            server = dronecan.app.file_server.FileServer(self.node, path_map={"new.bin": str(image)})
            self.addCleanup(server.close)
            self.spin_until("a report", lambda: self.reports)
            begin = dronecan.uavcan.protocol.file.BeginFirmwareUpdate
            request = begin.Request(source_node_id=127)
            request.image_file_remote_path.path = "new.bin"
            self.assertEqual(self.ask(request).error, begin.Response().ERROR_OK)
            self.spin_until("mode software update", lambda: monitor.exists(21) and monitor.get(21).status.mode == 3)
            self.spin_until("operational again", lambda: monitor.get(21).status.mode == 0)
            info = self.ask(dronecan.uavcan.protocol.GetNodeInfo.Request())
            self.assertEqual((info.software_version.major, info.software_version.minor), (3, 9))


if __name__ == "__main__":
    if not CHECKOUT or not (pathlib.Path(CHECKOUT) / "dronecan").is_dir():
        print("skipped: 1 program; ROTORLOOP_PYDRONECAN names no folder with the package dronecan")
        sys.exit(bus_namespace.SKIPPED)
    if len(sys.argv) > 2:
        Pydronecan.interface = sys.argv.pop(2)
        Pydronecan.bus = "socketcan:" + Pydronecan.interface
    else:
        bus_namespace.enter()
    Pydronecan.program = os.path.abspath(sys.argv.pop(1))
    sys.path.insert(0, CHECKOUT)
    import dronecan  # noqa: E402
    import dronecan.app.dynamic_node_id  # noqa: E402
    import dronecan.app.file_server  # noqa: E402
    import dronecan.app.node_monitor  # noqa: E402
    unittest.main(argv=sys.argv)
