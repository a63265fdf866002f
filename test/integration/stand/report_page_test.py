"""report.html of `stand estimate` opened from the disk: its series zoom with the mouse in headless Chromium, and stand there without scripts."""
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

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import browser  # noqa: E402

COMMAND = sys.argv.pop(1)
SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
DEADLINE_s = 60
PLOTS = 3  # speed, thrust, torque
RANGES = "JSON.stringify(document.querySelector('.zoom').plots.map((p) => [p.scales.x.min, p.scales.x.max, p.scales.y.min, p.scales.y.max]))"


class ReportPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder, True)
        run, report = os.path.join(cls.folder, "run"), os.path.join(cls.folder, "report")
        subprocess.run([COMMAND, "stand", "run", os.path.join(SOURCE, "devices/virtual/stand.toml"), "--virtual", "--plant", os.path.join(SOURCE, "vehicles/reference_plant.toml"),
                        "--sequence", "staircase", "--rpm", "6000,10000", "--yes", "-q", "-o", run], check=True, capture_output=True, timeout=DEADLINE_s)
        subprocess.run([COMMAND, "stand", "estimate", run, "--report", report], check=True, capture_output=True, timeout=DEADLINE_s)
        cls.run_folder, cls.page = run, os.path.join(report, "report.html")

    def open(self, width):
        page = browser.Page("file://" + self.page, width)
        self.addCleanup(page.close)
        self.assertTrue(page.wait_for("document.readyState == 'complete' && document.querySelectorAll('.zoom canvas').length", DEADLINE_s), "no plots")
        return page

    def mouse(self, page, kind, x, y, clicks=1):
        page.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=0 if kind == "mouseReleased" else 1, clickCount=clicks)

    def test_every_sample_stands_in_the_page_and_a_drawing_of_each_series_for_readers_without_scripts(self):
        with open(self.page) as f:
            page = f.read()
        series = [json.loads(text) for text in re.findall(r'<script type="application/json">(.*?)</script>', page)]
        self.assertEqual([s["y"] for s in series], ["speed, RPM", "thrust, N", "torque, N m"])
        with open(os.path.join(self.run_folder, "samples.csv")) as f:
            samples = sum(1 for line in f if line.strip()) - 1
        self.assertEqual({len(v["x"]) for s in series for v in s["series"]}, {samples})
        self.assertEqual(len(re.findall(r'over the run</figcaption>\n<svg [^>]*class="plot"', page)), PLOTS)

    @unittest.skipUnless(browser.CHROMIUM, "no Chromium")
    def test_a_drag_zooms_all_series_of_the_run_and_a_double_click_shows_all_again(self):
        page = self.open(1280)
        self.assertEqual(page.value("document.querySelectorAll('.zoom canvas').length"), PLOTS)
        self.assertEqual(page.value("[...document.querySelectorAll('.zoom svg')].filter((s) => s.clientHeight > 0).length"), 0, "drawing and plot at once")
        whole = json.loads(page.value(RANGES))
        page.value("document.querySelector('.zoom .u-over').scrollIntoView({ block: 'center' })")
        box = json.loads(page.value("JSON.stringify(document.querySelector('.zoom .u-over').getBoundingClientRect())"))
        y, left, right = box["y"] + box["height"] / 2, box["x"] + 0.25 * box["width"], box["x"] + 0.5 * box["width"]
        self.mouse(page, "mouseMoved", left, y)
        self.mouse(page, "mousePressed", left, y)
        self.mouse(page, "mouseMoved", right, y)
        self.mouse(page, "mouseReleased", right, y)
        self.assertTrue(page.wait_for(f"{RANGES} != {json.dumps(json.dumps(whole, separators=(',', ':')))}", DEADLINE_s))
        zoomed = json.loads(page.value(RANGES))
        span = whole[0][1] - whole[0][0]
        for now, before in zip(zoomed, whole):
            self.assertAlmostEqual(now[0], before[0] + 0.25 * span, delta=0.01 * span)
            self.assertAlmostEqual(now[1], before[0] + 0.5 * span, delta=0.01 * span)
        self.assertNotEqual(zoomed[0][2:], whole[0][2:], "the speed's axis follows what is shown")
        values = page.value("document.querySelector('.zoom .u-legend').innerText")
        self.assertRegex(values, r"\d s")
        self.assertRegex(values, r"[\d.]+ RPM")
        for clicks in (1, 2):
            self.mouse(page, "mousePressed", left, y, clicks)
            self.mouse(page, "mouseReleased", left, y, clicks)
        self.assertTrue(page.wait_for(f"{RANGES} == {json.dumps(json.dumps(whole, separators=(',', ':')))}", DEADLINE_s), page.value(RANGES))

    def test_a_demo_prints_its_result_as_one_document_with_the_operating_points_of_a_data_sheet(self):
        folder = os.path.join(self.folder, "demo")
        done = subprocess.run([COMMAND, "stand", "demo", "--json", "-q", "-o", folder], cwd=SOURCE, capture_output=True, text=True, timeout=DEADLINE_s)
        self.assertEqual(done.returncode, 0, done.stderr)
        document = json.loads(done.stdout)
        with open(os.path.join(folder, "result.json")) as f:
            self.assertEqual(document, json.load(f))
        self.assertTrue(document["files"][0]["simulated"])
        self.assertEqual({i["axis"]: i["evidence"] for i in document["files"][0]["instruments"]}["torque"], "emulated")
        with open(os.path.join(folder, "report.html")) as f:
            page = f.read()
        self.assertIn("Simulated: no motor turned", page)
        self.assertIn("source of its registers", page)
        points = document["files"][0]["operating_points"]
        self.assertGreaterEqual(len(points), 12)
        self.assertEqual([p["rpm"] for p in points], sorted(p["rpm"] for p in points))
        for p in points[4:]:
            self.assertAlmostEqual(p["grams_per_watt"], 1000 * p["thrust_N"] / 9.80665 / (p["supply_V"] * p["current_A"]), delta=0.01 * p["grams_per_watt"])
            self.assertTrue(0.6 < p["drive_efficiency"] < 0.9, p)
            self.assertTrue(0 < p["motor_V"] < p["supply_V"], p)

    def test_a_report_names_the_instruments_whose_profile_was_never_seen_on_hardware(self):
        run = os.path.join(self.folder, "example")
        subprocess.run([COMMAND, "stand", "run", "devices/examples/stand.toml", "--virtual", "--sequence", "staircase", "--levels", "5", "--density", "1.2", "--yes", "-q", "-o", run], cwd=SOURCE,
                       check=True, capture_output=True, timeout=DEADLINE_s)
        done = subprocess.run([COMMAND, "stand", "estimate", run], capture_output=True, text=True, timeout=DEADLINE_s)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"thrust +Laumas .*manual: copied from documents, not seen on hardware")
        self.assertRegex(done.stdout, r"Calibrated on 20\d\d-\d\d-\d\d, until")

    def touch(self, page, kind, *points):
        page.ask("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)])

    @unittest.skipUnless(browser.CHROMIUM, "no Chromium")
    def test_on_a_phone_two_fingers_zoom_all_series_one_moves_them_and_two_taps_show_all_again(self):
        page = self.open(500)
        page.ask("Emulation.setDeviceMetricsOverride", width=390, height=800, deviceScaleFactor=2, mobile=True)
        page.ask("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        whole = json.loads(page.value(RANGES))
        page.value("document.querySelector('.zoom .u-over').scrollIntoView({ block: 'center' })")
        box = json.loads(page.value("JSON.stringify(document.querySelector('.zoom .u-over').getBoundingClientRect())"))
        y, at = box["y"] + box["height"] / 2, lambda share: box["x"] + share * box["width"]
        span = whole[0][1] - whole[0][0]
        self.touch(page, "touchStart", (at(0.4), y), (at(0.6), y))
        self.touch(page, "touchMove", (at(0.3), y), (at(0.7), y))
        self.touch(page, "touchEnd")
        zoomed = json.loads(page.value(RANGES))
        for now, before in zip(zoomed, whole):
            self.assertAlmostEqual(now[0], before[0] + 0.25 * span, delta=0.02 * span)
            self.assertAlmostEqual(now[1], before[0] + 0.75 * span, delta=0.02 * span)
        self.touch(page, "touchStart", (at(0.5), y))
        self.touch(page, "touchMove", (at(0.3), y))
        self.touch(page, "touchEnd")
        moved = json.loads(page.value(RANGES))
        self.assertAlmostEqual(moved[0][0], zoomed[0][0] + 0.1 * span, delta=0.02 * span)
        self.assertAlmostEqual(moved[0][1] - moved[0][0], zoomed[0][1] - zoomed[0][0], delta=1e-6 * span)
        # A machine under load may keep two taps apart for longer than two taps are: then they are made again.
        end = time.monotonic() + DEADLINE_s
        while json.loads(page.value(RANGES)) != whole and time.monotonic() < end:
            for _ in range(2):
                self.touch(page, "touchStart", (at(0.5), y))
                self.touch(page, "touchEnd")
        self.assertEqual(json.loads(page.value(RANGES)), whole)

    @unittest.skipUnless(browser.CHROMIUM, "no Chromium")
    def test_plots_fit_a_window_of_500_px(self):
        page = self.open(500)  # a window is at least that wide
        self.assertLessEqual(page.value("document.documentElement.scrollWidth"), 500)
        self.assertLessEqual(page.value("Math.max(...[...document.querySelectorAll('.zoom .uplot')].map((p) => p.getBoundingClientRect().right))"), 500)


if __name__ == "__main__":
    unittest.main()
