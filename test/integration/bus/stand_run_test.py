"""`rotorloop stand run` on ports: an ESC in a process of its own, instruments in another, both in real time.

Every wait is for an event, with a deadline that only a hanging program reaches.
usage: stand_run_test.py PATH_TO_ROTORLOOP   (KILLS=200 in the environment for more of them)
"""
import collections
import os
import re
import selectors
import signal
import struct
import sys
import time

import bus_namespace
from answer_relay import AnswerRelay
from bus_test import DEADLINE_s, SOURCE, BusCommand
from rotorloop_cli import main

KILLS = int(os.environ.get("KILLS", "10"))
SAFE_AFTER_s = 0.1        # an answer that the master was given so long before a kill must be readable after it
# From a request whose answer the master refused to the next: late_max_ms of the profile is 100, and else some 6 ms. Either may be off by 44 ms of load.
SILENCE_s = 0.05
MOST_REFUSED = 0.05       # of the answers: more, and this says little of those that were taken
TIME_OUT_ms, MORE_ms = 250, 2


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
        # A force that changes all the time: each answer is known again by its value.
        cell = self.start("stand", "emulate", f"{profile}@1", "--rtu", "instrument", "--sine", "force=2,1,7.3", "--set", "torque=0.01")
        self.line_with(cell.stdout, "")
        self.relay = AnswerRelay(self.path / "instrument", self.path / "cell_bus")
        self.addCleanup(self.relay.close)
        return self.esc("mcast:3", 21, 0, "--bridge-log", self.path / "bridge.csv")

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

    def forces(self, folder):
        """All forces that can be read of a run, as the instrument's registers hold them."""
        lines = (self.path / folder / "readings.csv").read_text().split("\n")[1:-1]
        self.assertTrue(all(line.count(",") == 3 for line in lines))
        return [struct.unpack(">f", struct.pack(">f", float(line.split(",")[3])))[0] for line in lines if ",thrust," in line]

    def switched_off(self):
        """Age of the newest command in ms at each time the bridge was switched off, by the ESC's clock."""
        lines = (self.path / "bridge.csv").read_text().split("\n")[1:-1]
        return [float(line.split(",")[2]) for line in lines if ",off," in line]

    def until_off(self, before):
        end = time.monotonic() + DEADLINE_s
        with selectors.DefaultSelector() as nothing:
            while len(self.switched_off()) == before and time.monotonic() < end:
                nothing.select(0.01)
        self.assertGreater(len(self.switched_off()), before, "the bridge was never switched off")
        return self.switched_off()[before]

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
        answers, refusals, missing, oldest_missing_s, ages_s, silences_s, off_ms = 0, 0, 0, 0.0, [], [], []
        for k in range(KILLS):
            folder = f"run{k}"
            self.relay.forget()
            run = self.run_on_stand(folder)
            self.until_turning(folder, run)
            before, offs = self.last_time(folder), len(self.switched_off())
            killed = time.monotonic()
            run.kill()
            run.wait(timeout=DEADLINE_s)
            self.assertGreaterEqual(self.last_time(folder), before)
            readable = collections.Counter(self.forces(folder))
            given, refused = self.relay.given(killed, SILENCE_s)
            lost = [killed - at for at, force in given if readable[force] == 0]
            answers, refusals = answers + len(given), refusals + len(refused)
            missing += sum(age >= SAFE_AFTER_s for age in lost)
            oldest_missing_s = max([oldest_missing_s, *lost])
            ages_s.append(killed - max(at for at, force in given if readable[force]))
            times = sorted(at for at, _ in given + refused)
            silences_s.append(max(b - a for a, b in zip(times, times[1:])))
            off_ms.append(self.until_off(offs))
            self.assertTrue((self.path / folder / "run.toml").exists())
            monitor = self.start("esc", "monitor", "--bus", "mcast:3", "--json", "--rate", "10")
            self.line_with(monitor.stdout, '"rpm":0,')
            monitor.kill()
        print(f"{KILLS} kills, {answers} answers taken, {refusals} refused; {missing} of those {1e3 * SAFE_AFTER_s:.0f} ms old are not readable, the oldest that is not was {1e3 * oldest_missing_s:.1f} ms old; "
              f"newest readable {1e3 * max(ages_s):.1f} ms old at most; longest time between answers {1e3 * max(silences_s):.1f} ms; "
              f"bridge off {min(off_ms):.2f} to {max(off_ms):.2f} ms after the last command", flush=True)
        self.assertEqual(missing, 0)
        self.assertLessEqual(refusals, MOST_REFUSED * answers)
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
