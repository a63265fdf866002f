"""`rotorloop stand run` on ports: an ESC in a process of its own, instruments in another, both in real time.

Every wait is for an event, with a deadline that only a hanging program reaches.
usage: stand_run_test.py PATH_TO_ROTORLOOP   (KILLS=200 in the environment for more of them)
"""
import os
import re
import signal
import sys
import time

import bus_namespace
from bus_test import DEADLINE_s, SOURCE, BusCommand
from rotorloop_cli import main

KILLS = int(os.environ.get("KILLS", "5"))


class StandRun(BusCommand):
    def stand(self):
        """A stand file with one bus of one instrument on a pseudo-terminal, and the ESC."""
        text = (SOURCE / "devices/virtual/stand.toml").read_text()
        profile = SOURCE / "devices/virtual/force_torque.toml"
        bus = f'[[bus]]\nport = "rtu:cell_bus"\n[[bus.device]]\nname = "cell"\nprofile = "{profile}"\nslave = 1\nstale_ms = 2000\n\n'
        axes = '[[axis]]\naxis = "thrust"\nchannel = "cell.force"\n[[axis]]\naxis = "torque"\nchannel = "cell.torque"\n\n'
        text = re.sub(r"(?s)\[\[bus\]\].*?\[calibration\]", lambda _: bus + axes + "[calibration]", text, count=1)
        # A machine under load holds processes up: what is judged here is not how fast it is.
        text = re.sub(r"stale_ms = \{ max = \d+", "stale_ms = { max = 5000", text)
        text = re.sub(r"tracking_error_rad_s = \{ max = \d+", "tracking_error_rad_s = { max = 5000", text)
        (self.path / "stand.toml").write_text(text)
        cell = self.start("stand", "emulate", f"{profile}@1", "--rtu", "cell_bus", "--set", "force=0.5", "--set", "torque=0.01")
        self.line_with(cell.stdout, "")
        return self.esc()

    def run_on_stand(self, folder):
        return self.start("stand", "run", "stand.toml", "--yes", "--bus", "mcast:3", "--sequence", "endurance", "--rpm", "3000,5000", "--zero", "0.5", "--duration", "120",
                          "--density", "1.2", "--listen", "1.5", "-o", folder, "--jsonl", "-q")

    def last_time(self, folder):
        """Time of the newest whole reading of the instrument, s; none: no file yet."""
        try:
            lines = (self.path / folder / "readings.csv").read_text().split("\n")[1:-1]
        except FileNotFoundError:
            return None
        times = [float(line.split(",")[0]) for line in lines[-40:] if ",thrust," in line]
        return times[-1] if times else None

    def until_turning(self, folder, run):
        """Waits for a turning rotor."""
        turning, end = 0, time.monotonic() + DEADLINE_s
        while time.monotonic() < end and turning < 60:
            if self.last_time(folder) is not None:
                text = (self.path / folder / "readings.csv").read_text().rsplit(",esc,", 1)
                if len(text) == 2 and re.match(r"[\d.]+\n", text[1]) and float(text[1].split("\n")[0]) > 300:
                    turning += 1
            self.assertIsNone(run.poll(), "the run ended: " + (run.stderr.read() if run.poll() is not None else ""))
            self.lines(run.stdout, 0.02)
        self.assertEqual(turning, 60, "the rotor never turned")

    def test_killed_at_any_moment_the_run_keeps_its_readings_and_the_ESC_stops_by_its_own_time_out(self):
        esc = self.stand()
        for k in range(KILLS):
            folder = f"run{k}"
            run = self.run_on_stand(folder)
            self.until_turning(folder, run)
            before = self.last_time(folder)
            run.kill()
            run.wait(timeout=DEADLINE_s)
            self.assertGreaterEqual(self.last_time(folder), before)  # how old the newest may be is no matter of a busy machine's clock
            lines = (self.path / folder / "readings.csv").read_text().split("\n")[1:-1]
            self.assertTrue(all(line.count(",") == 3 for line in lines))
            self.assertTrue((self.path / folder / "run.toml").exists())
            monitor = self.start("esc", "monitor", "--bus", "mcast:3", "--json", "--rate", "10")
            self.line_with(monitor.stdout, '"rpm":0,')
            monitor.kill()
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
