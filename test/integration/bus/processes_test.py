"""A flight as processes: airframe, controller and four ESCs, each a program of its own, with nothing between them but two buses.

In lockstep the airframe waits for every answer, so a busy machine makes a flight longer to wait for and changes nothing in it: no limit here
is one of real time, and the deadlines are reached by a hanging program alone.
usage: processes_test.py PATH_TO_ROTORLOOP
"""
import collections
import re
import sys

import bus_namespace
import bus_test
from rotorloop_cli import CommandTest, main

DEADLINE_s = 400
BUSES = ("--esc-bus", "mcast:3", "--state-bus", "mcast:4")
PATIENT = ("--pace", "lockstep", "--wait", "300", "--silence", "300")


def frames(path):
    """How many frames of each identifier a recording has."""
    return collections.Counter(line.split()[2].split("#")[0] for line in path.read_text(encoding="utf-8").splitlines())


class FlightProcesses(CommandTest):
    start = bus_test.BusCommand.start

    def escs(self, *more):
        return [self.start("esc-sim", "--bus", "mcast:3", "--node-id", 21 + i, "--esc-index", i, "--plant", bus_test.PLANT, "--pace", "lockstep",
                           "--silence", "300", "--bridge-log", f"bridge{i}.csv", *more) for i in range(4)]

    def bridge(self, i):
        """Changes of the bridge of one ESC: (on or off, age of the newest command in ms)."""
        rows = (self.path / f"bridge{i}.csv").read_text(encoding="utf-8").splitlines()[1:]
        return [(row.split(",")[1], float(row.split(",")[2])) for row in rows]

    def error_of_hil_cm(self):
        """Mean tracking error of the same flight in one process."""
        self.assertEqual(self.run_command("hil", "s.toml", "--no-logs", "--name", "one", "-q", timeout_s=DEADLINE_s).returncode, 0)
        return self.result("runs/one")["flights"][0]["error_cm"]["mean_3d"]

    def test_a_climb_of_3_s_by_six_processes_ends_with_the_tracking_error_of_one_process_within_10_percent(self):
        escs = self.escs()
        fly = self.start("fly", "s.toml", *BUSES, *PATIENT, "--record-esc", "esc.log", "--record-state", "state.log")
        airframe = self.start("airframe", "s.toml", *BUSES, *PATIENT)
        flown, airframe_err = airframe.communicate(timeout=DEADLINE_s)
        fly_out, fly_err = fly.communicate(timeout=DEADLINE_s)
        self.assertEqual((airframe.returncode, fly.returncode), (0, 0), flown + airframe_err + fly_out + fly_err)
        self.assertIn("flown:    5.800 s of short/climb", flown)
        error_cm = float(re.search(r"tracking: ([\d.]+) cm mean", flown).group(1))
        alone_cm = self.error_of_hil_cm()
        self.assertAlmostEqual(error_cm, alone_cm, delta=0.1 * alone_cm)
        # A set-point and four answers for each of the 5800 ms; two IMU frames for each; all of them crossed a bus.
        on_esc, on_state = frames(self.path / "esc.log"), frames(self.path / "state.log")
        for identifier in ("0A0", "140", "141", "142", "143"):
            self.assertGreaterEqual(on_esc[identifier], 5800, identifier)
        for identifier, least in (("100", 5800), ("101", 5800), ("110", 1100), ("120", 580), ("130", 580)):
            self.assertGreaterEqual(on_state[identifier], least, identifier)
        for i, esc in enumerate(escs):
            esc.terminate()
            esc.communicate(timeout=DEADLINE_s)
            self.assertEqual(esc.returncode, 0)
            self.assertEqual(self.bridge(i)[-1][0], "off")


if __name__ == "__main__":
    bus_namespace.enter()
    main(sys.argv)
