"""kill -9 of one process of a bench at random times, over and over: how all the others end.

The time is that of the flight, by the set-points in the recording, which is on disk block by block: a kill comes some tenths of a second of
flight behind the time drawn. After each: `hil` ends with 4 and the name, no process is left, each bridge that was on (from take-off on: all of
them) went off at most 250 ms after the newest command by the ESC's own clock, and both recordings and both logs can be read. How long the others
took is printed; it is judged (--within) in a guest alone, whose clock is virtual: a busy machine makes all of them slow.
usage: process_deaths.py ROTORLOOP [--count N] [--seed N] [--esc-bus BUS --state-bus BUS] [--within SECONDS]
"""
import argparse
import os
import pathlib
import random
import signal
import sys
import time
import unittest

import bus_namespace
import processes_test
from rotorloop_cli import CommandTest

NODES = (21, 22, 23, 24)
MEMBERS = {"airframe": ("airframe",), "fly": ("fly",), **{f"esc{n}": ("esc-sim", str(n)) for n in NODES}}
LAST_ms = 4900  # of 5800 flown
TAKE_OFF_ms = 2000
TIMEOUT_ms = 250
given = None


class Deaths(processes_test.FlightProcesses):
    def flown_ms(self):
        """Of the flight, by the newest frame of the recording: one set-point a ms."""
        log = self.path / "runs/bench/esc.log"
        return log.read_bytes().count(b" 0A0#") if log.exists() else -1

    def kill(self, who, at_ms):
        """Flight time that the recording had reached, seconds that all others took to end, and the longest age of a newest command when a
        bridge went off."""
        hil = self.start("hil", self.bench(esc=given.esc_bus, state=given.state_bus))
        while (flown_ms := self.flown_ms()) < at_ms:
            self.assertIsNone(hil.poll(), "the bench ended by itself")
            time.sleep(0.01)
        members = {name: self.member(hil, *words) for name, words in MEMBERS.items()}
        os.kill(members[who], signal.SIGKILL)
        begin_s = time.monotonic()
        out, err = hil.communicate(timeout=processes_test.DEADLINE_s)
        took_s = time.monotonic() - begin_s
        self.assertEqual(hil.returncode, 4, out + err)
        self.assertIn(f"hil: {who} was ended by signal 9: all others were stopped, motors off", err)
        self.assertFalse([name for name, pid in members.items() if pathlib.Path(f"/proc/{pid}").exists()], "left behind")
        return flown_ms, took_s, self.oldest_command_ms(who, flown_ms >= TAKE_OFF_ms)

    def oldest_command_ms(self, killed, in_flight):
        ages = [0.0]
        for node in NODES:
            changes = self.bridge_log(node)
            if f"esc{node}" == killed:
                continue
            if in_flight:
                self.assertIn("on", [state for state, _ in changes], node)
            if not changes:
                continue
            self.assertEqual(changes[-1][0], "off", node)
            self.assertLessEqual(changes[-1][1], TIMEOUT_ms, node)
            ages.append(changes[-1][1])
        return max(ages)

    def assert_readable(self):
        for name in ("esc.log", "state.log"):
            done = self.run_command("bus", "stat", f"runs/bench/{name}")
            self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("flight.csv", "truth.csv"):
            lines = (self.path / "runs/bench" / name).read_text(encoding="utf-8").splitlines()
            columns = next(line for line in lines if not line.startswith("#")).count(",")
            rows = [line for line in lines if line[:1].isdigit()]
            self.assertTrue(all(row.count(",") == columns for row in rows[:-1]), name)

    def test_kill_9_at_random_times(self):
        numbers = random.Random(given.seed)
        longest_s = 0.0
        for i in range(given.count):
            who, at_ms = list(MEMBERS)[i % len(MEMBERS)], numbers.randrange(LAST_ms)
            flown_ms, took_s, age_ms = self.kill(who, at_ms)
            self.assert_readable()
            longest_s = max(longest_s, took_s)
            print(f"{who} killed at {flown_ms / 1000:.3f} s: all others ended within {took_s:.3f} s, newest command {age_ms:.1f} ms old", flush=True)
            if given.within:
                self.assertLessEqual(took_s, given.within)
            (self.path / "runs").rename(self.path / f"runs{i}")
        print(f"{given.count} kills: all others ended within {longest_s:.3f} s", flush=True)


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("program")
    options.add_argument("--count", type=int, default=50)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--esc-bus", default="mcast:5")
    options.add_argument("--state-bus", default="mcast:6")
    options.add_argument("--within", type=float, help="s of a guest's clock in which all others must end")
    given = options.parse_args()
    if given.esc_bus.startswith("mcast:"):
        bus_namespace.enter()
    CommandTest.program = os.path.abspath(given.program)
    suite = unittest.TestSuite([Deaths("test_kill_9_at_random_times")])
    sys.exit(not unittest.TextTestRunner(verbosity=2).run(suite).wasSuccessful())
