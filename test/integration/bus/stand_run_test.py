"""`rotorloop stand run` on ports: an ESC in a process of its own, an instrument of this program.

What must be there is judged by the order of events, times of the ESC by its own clock; every wait is for an event, with a deadline that only a
hanging program reaches.
usage: stand_run_test.py PATH_TO_ROTORLOOP   (KILLS=200 in the environment for more of them)
"""
import os
import random
import re
import selectors
import signal
import sys
import time

import bus_namespace
from bus_test import DEADLINE_s, GROUP, PORT, SOURCE, BusCommand
from numbered_instrument import NumberedInstrument, number_of
from rotorloop_cli import main

KILLS = int(os.environ.get("KILLS", "10"))
TIME_OUT_ms, MORE_ms = 250, 2


class StandRun(BusCommand):
    def stand(self):
        """A stand file with one bus of one instrument on a pseudo-terminal, and the ESC."""
        text = (SOURCE / "devices/virtual/stand.toml").read_text()
        # A machine under load holds processes up: what is judged here is not how fast it is.
        cell = (SOURCE / "devices/virtual/force_torque.toml").read_text()
        for key, ms in (("timeout_ms", 10000), ("byte_timeout_ms", 1000), ("late_max_ms", 10000)):
            cell = re.sub(rf"(?m)^{key} = \d+", f"{key} = {ms}", cell)
        self.write("cell.toml", cell)
        bus = '[[bus]]\nport = "rtu:cell_bus"\n[[bus.device]]\nname = "cell"\nprofile = "cell.toml"\nslave = 1\nstale_ms = 60000\n\n'
        axes = '[[axis]]\naxis = "thrust"\nchannel = "cell.force"\n[[axis]]\naxis = "torque"\nchannel = "cell.torque"\n\n'
        text = re.sub(r"(?s)\[\[bus\]\].*?\[calibration\]", lambda _: bus + axes + "[calibration]", text, count=1)
        text = re.sub(r"stale_ms = \{ max = \d+", "stale_ms = { max = 60000", text)
        text = re.sub(r"tracking_error_rad_s = \{ max = \d+", "tracking_error_rad_s = { max = 5000", text)
        self.write("stand.toml", text)
        self.cell = NumberedInstrument(self.path / "cell_bus", GROUP, PORT)
        self.addCleanup(self.cell.close)
        return self.esc("mcast:3", 21, 0, "--bridge-log", self.path / "bridge.csv")

    def run_on_stand(self, folder):
        return self.start("stand", "run", "stand.toml", "--yes", "--bus", "mcast:3", "--sequence", "endurance", "--rpm", "3000,5000", "--zero", "0.5", "--duration", "120",
                          "--density", "1.2", "--listen", "3", "-o", folder, "--jsonl", "-q")

    def readings(self, folder, channel):
        """All values of a channel that can be read of a run."""
        try:
            lines = (self.path / folder / "readings.csv").read_text().split("\n")[1:-1]
        except FileNotFoundError:
            return []
        self.assertTrue(all(line.count(",") == 3 for line in lines))
        return [float(line.split(",")[3]) for line in lines if f",{channel}," in line]

    def switched_off(self):
        """Age of the newest command in ms at each time the bridge was switched off, by the ESC's clock."""
        lines = (self.path / "bridge.csv").read_text().split("\n")[1:-1]
        return [float(line.split(",")[2]) for line in lines if ",off," in line]

    def until(self, come, what, run=None):
        """Waits for an event, and fails where the run ends before it."""
        end = time.monotonic() + DEADLINE_s
        with selectors.DefaultSelector() as selector:
            if run:
                selector.register(run.stdout, selectors.EVENT_READ)
            while not come():
                self.assertTrue(run is None or run.poll() is None, "the run ended: " + (run.stderr.read() if run and run.poll() is not None else ""))
                self.assertLess(time.monotonic(), end, what)
                if selector.select(0.01):
                    os.read(run.stdout.fileno(), 65536)

    def until_turning(self, folder, run):
        self.until(lambda: sum(omega > 300 for omega in self.readings(folder, "esc")) >= 60, "the rotor never turned", run)

    def test_killed_at_any_moment_the_run_keeps_its_readings_and_the_ESC_stops_by_its_own_time_out(self):
        esc = self.stand()
        moments, must, missing, passed_over, more, off_ms = random.Random(1), 0, [], [], 0, []
        for k in range(KILLS):
            folder = f"run{k}"
            self.cell.forget()
            run = self.run_on_stand(folder)
            self.until_turning(folder, run)
            enough = self.cell.must_be_readable() + moments.randrange(60)
            self.until(lambda: self.cell.must_be_readable() >= enough, "no answers any more", run)
            offs, safe = len(self.switched_off()), self.cell.must_be_readable()
            run.kill()
            run.wait(timeout=DEADLINE_s)
            readable = {number_of(force) for force in self.readings(folder, "thrust")}
            # What a kill loses are the newest. One with newer ones behind it was not taken in by the run, whatever its reason, and is counted apart.
            gone = set(range(safe)) - readable
            passed_over += [n for n in gone if n < max(readable, default=-1)]
            missing += sorted(n for n in gone if n > max(readable, default=-1))
            must, more = must + safe, more + len(readable) - safe
            self.until(lambda: len(self.switched_off()) > offs, "the bridge was never switched off")
            off_ms.append(self.switched_off()[offs])
            self.assertTrue((self.path / folder / "run.toml").exists())
            monitor = self.start("esc", "monitor", "--bus", "mcast:3", "--json", "--rate", "10")
            self.line_with(monitor.stdout, '"rpm":0,')
            monitor.kill()
        print(f"{KILLS} kills; of {must} answers before the fifth set-point after them {len(missing)} are not readable and {len(passed_over)} passed over, "
              f"of later ones {more} are; bridge off {min(off_ms):.2f} to {max(off_ms):.2f} ms after the last command", flush=True)
        self.assertGreater(must, 100 * KILLS)
        self.assertEqual(missing, [])
        self.assertLessEqual(len(passed_over), max(1, KILLS // 10))  # one of 11 097 was seen, and none of 82 897 beside three busy loops
        self.assertLessEqual(max(off_ms), TIME_OUT_ms + MORE_ms)
        self.assertGreaterEqual(min(off_ms), TIME_OUT_ms - MORE_ms)
        esc.send_signal(signal.SIGINT)
        _, err = esc.communicate(timeout=DEADLINE_s)
        found = re.search(r"time-outs: (\d+) commands", err)
        self.assertTrue(found, err)
        self.assertGreaterEqual(int(found.group(1)), KILLS, err)

    def test_ctrl_c_ramps_down_disarms_and_writes_how_it_ended(self):
        self.stand()
        run = self.run_on_stand("run")
        self.until_turning("run", run)
        run.send_signal(signal.SIGINT)
        _, err = run.communicate(timeout=DEADLINE_s)
        self.assertEqual(run.returncode, 130, err)
        self.assertIn('end = "stopped"', (self.path / "run/run.toml").read_text())
        self.assertIn('"by":"SIGINT"', (self.path / "run/events.jsonl").read_text())


del BusCommand

if __name__ == "__main__":
    bus_namespace.enter()
    main(sys.argv)
