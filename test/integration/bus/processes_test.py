"""A flight as processes: airframe, controller and four ESCs, each a program of its own, with nothing between them but two buses.

In lockstep the airframe waits for every answer, so a busy machine makes a flight longer to wait for and changes nothing in it: no limit here
is one of real time, and the deadlines are reached by a hanging program alone.
usage: processes_test.py PATH_TO_ROTORLOOP
"""
import collections
import os
import pathlib
import re
import signal
import sys
import time

import bus_namespace
import bus_test
from rotorloop_cli import MISSED_LIMIT, SCENARIO, CommandTest, main

DEADLINE_s = 400
BUSES = ("--esc-bus", "mcast:3", "--state-bus", "mcast:4")
PATIENT = ("--pace", "lockstep", "--wait", "300", "--silence", "300")


def frames(path):
    """How many frames of each identifier a recording has."""
    return collections.Counter(line.split()[2].split("#")[0] for line in path.read_text(encoding="utf-8").splitlines())


class FlightProcesses(CommandTest):
    start = bus_test.BusCommand.start

    def escs(self, silence_s=300):
        return [self.start("esc-sim", "--bus", "mcast:3", "--node-id", 21 + i, "--esc-index", i, "--plant", bus_test.PLANT, "--pace", "lockstep",
                           "--silence", silence_s, "--bridge-log", f"bridge{i}.csv") for i in range(4)]

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

    def bench(self, **changes):
        """Writes bench.toml: all local, on multicast, in lockstep."""
        keys = {"pace": "lockstep", "esc": "mcast:5", "state": "mcast:6", "ids": (21, 22, 23, 24), **changes}
        own = f'bus = "{keys["esc_own"]}"\n' if "esc_own" in keys else ""
        escs = "".join(f"[[esc]]\nnode_id = {i}\nsimulated = true\n{own}" for i in keys["ids"])
        return self.write("bench.toml", f"""format = 1
scenario = "s.toml"
pace = "{keys['pace']}"
wait_s = 300
silence_s = 300
[bus]
esc = "{keys['esc']}"
state = "{keys['state']}"
{escs}""")

    def bridge_log(self, node):
        path = self.path / f"runs/bench/esc{node}_bridge.csv"
        rows = path.read_text(encoding="utf-8").split("\n")[1:-1] if path.exists() else []  # whole lines
        return [(row.split(",")[1], float(row.split(",")[2])) for row in rows]

    def member(self, hil, *words):
        """The process of this bench whose command line has these words."""
        children = (pathlib.Path(f"/proc/{hil.pid}/task/{hil.pid}/children").read_text(encoding="ascii")).split()
        return next(int(c) for c in children if set(words) <= set(pathlib.Path(f"/proc/{c}/cmdline").read_text(encoding="utf-8").split("\0")))

    def test_a_bench_file_starts_all_six_and_ends_with_the_figures_of_the_flight(self):
        done = self.run_command("hil", self.bench(ids=(31, 32, 33, 34)), timeout_s=DEADLINE_s)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("flown:    5.800 s of short/climb", done.stdout)
        self.assertEqual([self.bridge_log(n)[-1][0] for n in (31, 32, 33, 34)], ["off"] * 4)
        self.assertGreaterEqual(frames(self.path / "runs/bench/esc.log")["0A0"], 5800)
        self.assert_logs_meet(self.path / "runs/bench")

    def rows(self, path):
        """{t: {column: value}} of a log."""
        lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        names = lines[0].split(",")
        return {row["t[s]"]: row for row in (dict(zip(names, line.split(","))) for line in lines[1:])}

    def assert_logs_meet(self, run):
        """Controller and airframe wrote the same flight: 1000 rows a second with the same times, estimate and truth within 10 cm."""
        flight, truth = self.rows(run / "flight.csv"), self.rows(run / "truth.csv")
        both = flight.keys() & truth.keys()
        self.assertGreaterEqual(len(both), 5800)
        for t in (t for t in both if float(t) > 2.0):
            self.assertAlmostEqual(float(flight[t]["est_p_z[m]"]), float(truth[t]["true_p_z[m]"]), delta=0.1)
        self.assertAlmostEqual(max(float(row["true_p_z[m]"]) for row in truth.values()), 3.0, delta=0.05)

    def test_a_limit_of_the_scenario_that_is_missed_ends_the_bench_with_6(self):
        self.write("s.toml", SCENARIO + MISSED_LIMIT.format(variant="pd_ff"))
        done = self.run_command("hil", self.bench(), timeout_s=DEADLINE_s)
        self.assertEqual(done.returncode, 6, done.stdout + done.stderr)
        self.assertIn("MISSED", done.stdout)

    def killed_in_flight(self, name, *words):
        """kill -9 of one process of a bench during the climb: how the bench ended."""
        hil = self.start("hil", self.bench())
        end = time.monotonic() + DEADLINE_s
        log = self.path / "runs/bench/esc.log"
        while not log.exists() or log.read_text(encoding="utf-8").count(" 0A0#") < 3000:  # set-points: one a ms of flight
            self.assertLess(time.monotonic(), end, "the flight does not go on")
            self.assertIsNone(hil.poll())
            time.sleep(0.02)
        for node in (21, 22, 23, 24):
            self.assertEqual(self.bridge_log(node)[-1][0], "on")
        members = [self.member(hil, *w) for w in (("airframe",), ("fly",), *(("esc-sim", f"{n}") for n in (21, 22, 23, 24)))]
        os.kill(self.member(hil, *words), signal.SIGKILL)
        out, err = hil.communicate(timeout=DEADLINE_s)
        self.assertEqual(hil.returncode, 4, out + err)
        self.assertIn(f"hil: {name} was ended by signal 9: all others were stopped, motors off", err)
        for pid in members:
            self.assertFalse(pathlib.Path(f"/proc/{pid}").exists(), "a process was left behind")

    def assert_motors_off(self, *nodes):
        for node in nodes:
            state, age_ms = self.bridge_log(node)[-1]
            self.assertEqual(state, "off", node)
            self.assertLessEqual(age_ms, 250, node)  # the longest time-out of an order, by the ESC's own clock

    def test_kill_9_of_the_controller_stops_all_motors_within_250_ms_of_the_last_set_point(self):
        self.killed_in_flight("fly", "fly")
        self.assert_motors_off(21, 22, 23, 24)

    def test_kill_9_of_the_airframe_stops_all_motors_within_250_ms_of_the_last_set_point(self):
        self.killed_in_flight("airframe", "airframe")
        self.assert_motors_off(21, 22, 23, 24)

    def test_kill_9_of_one_esc_stops_the_motors_of_the_other_three_within_250_ms_of_the_last_set_point(self):
        self.killed_in_flight("esc22", "esc-sim", "22")
        self.assert_motors_off(21, 23, 24)

    def test_a_set_point_that_stays_away_stops_the_motor_of_an_esc_in_lockstep_by_itself(self):
        """No supervisor, and the controller is killed: after the silence each ESC's time goes on, and its own time-out strikes."""
        escs = self.escs(silence_s=0.5)
        airframe = self.start("airframe", "s.toml", *BUSES, *PATIENT)
        fly = self.start("fly", "s.toml", *BUSES, *PATIENT)
        end = time.monotonic() + DEADLINE_s
        while not all((self.path / f"bridge{i}.csv").exists() and self.bridge(i) for i in range(4)):
            self.assertLess(time.monotonic(), end, "no motor was driven")
            time.sleep(0.02)
        fly.kill()
        while not all(self.bridge(i)[-1][0] == "off" for i in range(4)):
            self.assertLess(time.monotonic(), end, "a motor is still driven")
            time.sleep(0.02)
        self.assertTrue(all(esc.poll() is None for esc in escs))
        self.assertLessEqual(max(self.bridge(i)[-1][1] for i in range(4)), 250)
        airframe.terminate()
        airframe.wait(timeout=DEADLINE_s)

    def test_a_controller_whose_airframe_never_comes_ends_with_3_and_names_the_bus(self):
        done = self.run_command("fly", "s.toml", *BUSES, "--wait", "0.2", timeout_s=DEADLINE_s)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("no airframe on mcast:4: no IMU sample was heard", done.stderr)

    def test_an_airframe_without_its_escs_ends_with_3_and_names_those_missing_and_who_answered(self):
        done = self.run_command("airframe", "s.toml", *BUSES, "--wait", "0.2", timeout_s=DEADLINE_s)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("ESC nodes 21, 22, 23, 24 are missing on mcast:3; nobody answered", done.stderr)

    def test_mistakes_end_with_2_before_anything_is_started(self):
        for words, text in (
                (("fly", "s.toml", "--esc-bus", "mcast:3", "--state-bus", "mcast:3"), '"mcast:3" is the bus of the ESCs too'),
                (("fly", "s.toml", "--esc-bus", "virtual:", "--state-bus", "mcast:3"), "a virtual bus ends at this process"),
                (("fly", "s.toml", "--esc-bus", "socketcan:can0", "--state-bus", "mcast:3"), "motors on socketcan:can0 would run, up to 3000 rpm"),
                (("fly", "s.toml", "--esc-bus", "slcan-server:escs", "--state-bus", "mcast:3", "--props-off"),
                 "3000 rpm is below the 3820 rpm at which this vehicle's rotors idle: no flight can begin"),
                (("fly", "s.toml", *BUSES, "--pace", "fast"), '"fast" is no pace'),
                (("airframe", "s.toml", *BUSES, "--flight", "climbs"), '"climbs" is not a flight'),
                (("airframe", "s.toml", *BUSES, "--esc-nodes", "21,22,22,24"), "a node id stands here twice"),
                (("hil", {"ids": (21, 22, 21, 24)}), "node_id = 21 stands here twice"),
                (("hil", {"state": "mcast:5"}), '"mcast:5" is the bus of the ESCs too'),
                (("hil", {"esc_own": "mcast:6"}), 'bench.toml:12: error: "mcast:6" is the state bus (column 7)'),
                (("hil", {"esc": "virtual:"}), "is a virtual bus, which ends at one process"),
                (("hil", {"esc": "socketcan:can0"}), "motors on socketcan:can0 would run"),
                (("hil", {}, "--seeds", "3"), "is a bench file: of the options only")):
            with self.subTest(text):
                done = self.run_command(*(self.bench(**w) if isinstance(w, dict) else w for w in words))
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(text, done.stderr)


if __name__ == "__main__":
    bus_namespace.enter()
    main(sys.argv)
