"""`stand run --live` on the virtual stand, held to the clock: the page's stream and its stop, by HTTP; in headless Chromium where it is there."""
import http.client
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import browser  # noqa: E402

COMMAND = sys.argv.pop(1)
SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
DEADLINE_s = 120


class LivePage(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder, True)

    def start(self, pace, *more):
        self.out = os.path.join(self.folder, f"run{pace}")
        run = subprocess.Popen([COMMAND, "stand", "run", os.path.join(SOURCE, "devices/virtual/stand.toml"), "--virtual", "--plant", os.path.join(SOURCE, "vehicles/reference_plant.toml"), "--live",
                                "--pace", str(pace), "--rpm", "6000,9000", "-o", self.out, *more], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(run.stdout.close)
        self.addCleanup(run.stderr.close)
        self.addCleanup(run.kill)
        for line in run.stderr:
            if found := re.search(r"page: (\S+)", line):
                self.url = found.group(1)
                return run, urllib.parse.urlparse(self.url)
        self.fail("no page")

    def ask(self, address, method, path, headers=None, body=None):
        connection = http.client.HTTPConnection(address.hostname, address.port, timeout=DEADLINE_s)
        self.addCleanup(connection.close)
        connection.request(method, path, body, headers or {})
        return connection.getresponse()

    def values(self, events, until):
        while line := events.fp.readline().decode():
            if line.startswith("data: ") and until(v := json.loads(line[6:])):
                return v
        self.fail("the stream ended")

    def test_the_stop_of_the_page_ramps_the_motor_down_and_the_page_says_so(self):
        run, address = self.start(5)
        self.assertIn("Run on a stand", self.ask(address, "GET", "/").read().decode())
        self.assertIn("limitRow", self.ask(address, "GET", "/page.js").read().decode())
        events = self.ask(address, "GET", "/events")
        seen = self.values(events, lambda v: v["state"] == "running" and v["omega_rad_s"] > 100)
        self.assertEqual({limit["name"] for limit in seen["limits"] if not limit["watched"]}, set())
        self.assertEqual(self.ask(address, "POST", "/order", {"X-Token": "0" * 32}, "stop").status, 403)
        self.values(events, lambda v: v["state"] == "running")
        answer = self.ask(address, "POST", "/order", {"X-Token": address.fragment}, "stop")
        self.assertEqual((answer.status, answer.read().decode()), (200, "stop asked for: the motor is ramped down and disarmed"))
        self.values(events, lambda v: v["state"] == "stopped")
        run.communicate(timeout=DEADLINE_s)
        with open(os.path.join(self.out, "events.jsonl")) as f:
            happened = [json.loads(line) for line in f]
        self.assertIn(("stop_asked", "page"), [(e["event"], e.get("by")) for e in happened])
        self.assertEqual(happened[-1]["how"], "stopped")

    def test_a_page_that_never_reads_does_not_hold_up_the_run(self):
        run, address = self.start(200, "--sequence", "staircase")
        stuck = http.client.HTTPConnection(address.hostname, address.port, timeout=DEADLINE_s)
        self.addCleanup(stuck.close)
        stuck.request("GET", "/events")
        run.communicate(timeout=DEADLINE_s)
        self.assertEqual(run.returncode, 0)

    @unittest.skipUnless(browser.CHROMIUM, "no Chromium")
    def test_headless_Chromium_shows_curves_limits_and_steps_in_wide_and_narrow_windows_and_its_button_stops(self):
        run, _ = self.start(2, "--levels", "60")  # 200 s: longer than two browsers take to start on a busy machine
        for width in (1300, 500):  # a window is at least that wide
            page = browser.Page(self.url, width, height=1500)
            self.addCleanup(page.close)
            self.assertTrue(page.wait_for("document.querySelectorAll('#steps tbody tr').length > 0", DEADLINE_s), "no steps on the page")
            self.assertEqual(page.value("document.querySelectorAll('canvas').length"), 4)
            self.assertEqual(page.value("document.querySelectorAll('#limits tbody tr').length"), 10)
            self.assertLessEqual(page.value("document.documentElement.scrollWidth"), width)
            self.assertTrue(page.wait_for("state.textContent === 'running'", DEADLINE_s), page.value("state.textContent"))
        page.value("document.getElementById('stop').click()")
        run.communicate(timeout=DEADLINE_s)
        with open(os.path.join(self.out, "events.jsonl")) as f:
            self.assertEqual(json.loads(f.readlines()[-1])["how"], "stopped")


if __name__ == "__main__":
    unittest.main()
