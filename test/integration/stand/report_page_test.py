"""report.html of `stand estimate` opened from the disk: its series zoom with the mouse in headless Chromium, and stand there without scripts."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
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

    @unittest.skipUnless(browser.CHROMIUM, "no Chromium")
    def test_plots_fit_a_window_of_500_px(self):
        page = self.open(500)  # a window is at least that wide
        self.assertLessEqual(page.value("document.documentElement.scrollWidth"), 500)
        self.assertLessEqual(page.value("Math.max(...[...document.querySelectorAll('.zoom .uplot')].map((p) => p.getBoundingClientRect().right))"), 500)


if __name__ == "__main__":
    unittest.main()
