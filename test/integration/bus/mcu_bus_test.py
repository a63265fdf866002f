"""The program that is flashed, on an emulated chip on a bus (`rotorloop mcu run --bus`): found, given an id, configured, turning its motor.

Every wait is for an event, with a deadline that only a hanging program reaches; an answer that a busy machine makes late is asked for again.
usage: mcu_bus_test.py PATH_TO_ROTORLOOP ELF
"""
import json
import pathlib
import sys
import time

import bus_namespace
from bus_test import DEADLINE_s, SOURCE, BusCommand
from rotorloop_cli import main

BUS = ("--bus", "mcast:3")
ELF = None
RPM = 3000
REPORTS = 20  # in a row within 2 %


class ChipOnBus(BusCommand):
    def until(self, what, *words):
        """Asks again until the command ends well and its JSON satisfies `what`."""
        end = time.monotonic() + 4 * DEADLINE_s
        while time.monotonic() < end:
            last = self.run_command("esc", *words, *BUS, "--json")
            if last.returncode == 0 and (found := what(json.loads(last.stdout))) is not None:
                return found
        self.fail(f"{words}: {last.stdout}{last.stderr}")

    def test_a_chip_is_found_given_an_id_takes_a_parameter_and_turns_its_motor(self):
        server = self.start("esc", "serve", *BUS, "--table", "ids.txt", "--json")
        self.line_with(server.stderr, "serving:")
        self.start("mcu", "run", ELF, *BUS, "--for", "600", "--pins", SOURCE / "vehicles/boards/b_g431b_esc1.toml",
                   "--motor", SOURCE / "vehicles/motors/2306_2300kv.toml")
        given = json.loads(self.line_with(server.stdout, '"unique_id"'))
        self.assertTrue(given["new"])
        node = given["node"]
        listed = self.until(lambda nodes: next((n for n in nodes if n["node"] == node), None), "list")
        self.assertEqual(listed["name"], "org.rotorloop.b_g431b_esc1")
        self.until(lambda _: True, "set", "--node", node, "esc_index=0", "status_Hz=77", "--save")
        read = self.until(lambda nodes: {p["name"]: p["value"] for p in nodes[0]["parameters"]}, "get", "--node", node)
        self.assertEqual((read["esc_index"], read["status_Hz"]), (0, 77))
        spin = self.start("esc", "spin", *BUS, "--index", "0", "--rpm", RPM, "--for", "60", "--yes", "--json")
        in_a_row = 0  # a motor that runs through, or swings about it, meets the speed for a report or two
        while in_a_row < REPORTS:
            rpm = json.loads(self.line_with(spin.stdout, f'"set_point":{RPM}'))["rpm"]
            in_a_row = in_a_row + 1 if abs(rpm - RPM) <= 0.02 * RPM else 0


# What the class is built on is tested in its own file.
for name in [n for n in dir(BusCommand) if n.startswith("test_")]:
    if name not in ChipOnBus.__dict__:
        setattr(ChipOnBus, name, None)
del BusCommand

if __name__ == "__main__":
    bus_namespace.enter()
    ELF = pathlib.Path(sys.argv.pop()).resolve()
    if not ELF.exists():
        print("skipped: 1 program; the firmware is not built (no cross compiler)")
        sys.exit(bus_namespace.SKIPPED)
    main(sys.argv)
