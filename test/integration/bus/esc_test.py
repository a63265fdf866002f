"""`rotorloop esc` against `rotorloop esc-sim` on multicast: what an integrator types, what happens.

Every wait is for an event, with a deadline that only a hanging program reaches.
usage: esc_test.py PATH_TO_ROTORLOOP
"""
import http.client
import json
import re
import signal
import sys
import threading
import time
import urllib.parse

import bus_namespace
from bus_test import DEADLINE_s, BusCommand, packet, raw_command
import browser  # noqa: E402, in the folder that bus_test adds to the path
from rotorloop_cli import main

BUS = ("--bus", "mcast:3")


class EscCommand(BusCommand):
    def esc_command(self, *words):
        return self.run_command("esc", *words, *BUS)

    def test_list_names_every_node_and_marks_an_index_that_two_have(self):
        self.esc(node=21, index=0)
        self.esc("mcast:3", 22, 0)
        done = self.esc_command("list", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        nodes = {n["node"]: n for n in json.loads(done.stdout)}
        self.assertEqual(set(nodes), {21, 22})
        self.assertEqual(nodes[21]["name"], "org.rotorloop.esc")
        self.assertEqual((nodes[21]["mode"], nodes[21]["health"], nodes[21]["esc_index"]), ("operational", "error", "0!"))  # the ESCs hear each other's reports
        text = self.esc_command("list")
        self.assertRegex(text.stdout, r" 21 +0! +operational")
        self.assertIn("give each ESC its own", text.stderr)

    def test_spin_reaches_its_speed_within_one_percent_and_ends_with_a_stop(self):
        self.esc()
        self.settles_at(4000)
        done = self.esc_command("spin", "--index", "0", "--rpm", "4000", "--for", "1", "--ramp", "0.5", "--yes")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("stopped and disarmed: time over", done.stderr)
        self.assert_stands_still()

    def assert_stands_still(self):
        """The next report of an idle ESC: speed zero."""
        monitor = self.start("esc", "monitor", *BUS, "--json", "--rate", "10")
        end = time.monotonic() + DEADLINE_s
        while time.monotonic() < end:
            for line in self.lines(monitor.stdout, 0.5) or []:
                escs = json.loads(line)["escs"]
                if escs and escs[0]["rpm"] == 0:
                    return
        self.fail("still turning")

    def test_ctrl_c_stops_the_motor_before_the_tool_ends(self):
        self.esc()
        spin = self.start("esc", "spin", *BUS, "--index", "0", "--rpm", "4000", "--for", "60", "--yes", "--json")
        self.line_with(spin.stdout, '"set_point":4000')
        spin.send_signal(signal.SIGINT)
        _, err = spin.communicate(timeout=DEADLINE_s)
        self.assertEqual(spin.returncode, 130, err)
        self.assertIn("stopped and disarmed: released", err)
        self.assert_stands_still()

    def test_a_killed_spin_leaves_no_motor_turning(self):
        self.esc()
        spin = self.start("esc", "spin", *BUS, "--index", "0", "--rpm", "4000", "--for", "60", "--yes", "--json")
        self.line_with(spin.stdout, '"set_point":4000')
        spin.kill()
        self.assert_stands_still()

    def test_a_limit_stops_the_motor_with_exit_code_4(self):
        self.esc()
        done = self.esc_command("spin", "--index", "0", "--rpm", "8000", "--for", "20", "--yes", "--max-rpm", "3000")
        self.assertEqual(done.returncode, 4, done.stdout + done.stderr)
        self.assertIn("stopped and disarmed: speed above 3000 rpm", done.stderr)
        self.assert_stands_still()

    def test_nothing_is_armed_while_another_node_commands_or_when_the_esc_is_not_there(self):
        done = self.esc_command("spin", "--index", "5", "--rpm", "3000", "--for", "2", "--yes")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("nothing was armed: ESC 5 does not report", done.stderr)
        self.esc()
        stop = threading.Event()

        def autopilot():
            number = 0
            while not stop.wait(0.05):
                self.send(packet(0x07040678, raw_command(0) + bytes([0xC0 | number % 32])))
                number += 1
        thread = threading.Thread(target=autopilot)
        thread.start()
        try:
            done = self.esc_command("spin", "--index", "0", "--rpm", "3000", "--for", "2", "--yes")
        finally:
            stop.set()
            thread.join()
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn("nothing was armed: another node sends commands", done.stderr)

    def test_the_live_page_streams_values_and_takes_orders_with_its_token_alone(self):
        self.esc(index=2)
        monitor = self.start("esc", "monitor", *BUS, "--web")
        address = urllib.parse.urlparse(self.line_with(monitor.stdout, "http://127.0.0.1:").strip())

        def ask(method, path, headers=None, body=None):
            connection = http.client.HTTPConnection(address.hostname, address.port, timeout=DEADLINE_s)
            self.addCleanup(connection.close)
            connection.request(method, path, body, headers or {})
            return connection.getresponse()
        self.assertIn("ESCs on a bus", ask("GET", "/").read().decode())
        for path in ("/uplot.js", "/uplot.css", "/live.js", "/live.css"):
            self.assertEqual(ask("GET", path).status, 200, path)
        self.assertEqual(ask("GET", "/", {"Host": "evil.example"}).status, 403)
        self.assertEqual(ask("POST", "/order", body="stop").status, 403)
        self.assertEqual(ask("POST", "/order", {"X-Token": "0" * 32}, "stop").status, 403)
        answer = ask("POST", "/order", {"X-Token": address.fragment}, "stop")
        self.assertEqual((answer.status, answer.read().decode()), (200, "ArmingStatus 0 is sent to all"))
        events, end = ask("GET", "/events"), time.monotonic() + DEADLINE_s
        while time.monotonic() < end:
            line = events.fp.readline().decode()
            found = re.match(r"data: (.*)", line)
            if found and json.loads(found.group(1))["escs"]:
                self.assertEqual(json.loads(found.group(1))["escs"][0]["esc_index"], 2)
                break
        else:
            self.fail("no values")
        monitor.send_signal(signal.SIGINT)
        monitor.communicate(timeout=DEADLINE_s)
        self.assertEqual(monitor.returncode, 0)

    def test_the_live_page_is_drawn_by_a_browser(self):
        """Headless Chromium, where there is one: a row with the ESC's figures and its state without scrolling, three plots with
        their newest values, the stop button; nothing wider than the window."""
        if not browser.CHROMIUM:
            self.skipTest("1 page: no Chromium on this machine")
        self.esc(index=2)
        monitor = self.start("esc", "monitor", *BUS, "--web")
        address = self.line_with(monitor.stdout, "http://127.0.0.1:").strip()
        for width in (1280, 390):
            page = browser.Page(address, width)
            self.addCleanup(page.close)
            if width < 500:  # a window of Chromium is wider; a telephone's page is not
                page.ask("Emulation.setDeviceMetricsOverride", width=width, height=844, deviceScaleFactor=2, mobile=True)
            row = r"/^2\s+(21\s+)?0\s+1\d\.\d\d\s.*operational, ok$/"  # its first figures come later than the row itself
            self.assertTrue(page.wait_for(f'{row}.test(document.querySelector("#escs tbody tr").innerText)', DEADLINE_s),
                            page.value("document.body.innerText"))
            self.assertEqual(page.wait_for('document.querySelectorAll(".plot canvas").length', DEADLINE_s), 3)
            self.assertTrue(page.value('document.getElementById("stop").offsetWidth > 0'))
            self.assertTrue(page.value("document.documentElement.scrollWidth <= innerWidth"), width)
            self.assertTrue(page.value('document.querySelector("#escs tbody td:last-child").getBoundingClientRect().right <= innerWidth'), width)
            newest = 'document.querySelector(".u-legend .u-series:nth-child(2) .u-value").textContent'
            self.assertTrue(page.wait_for(f'{newest} === "0"', DEADLINE_s), page.value(newest))
        monitor.send_signal(signal.SIGINT)
        monitor.communicate(timeout=DEADLINE_s)

    def test_a_commissioning_measures_the_motor_says_what_it_did_not_and_is_kept(self):
        esc = self.esc()
        self.assertEqual(self.esc_command("set", "--node", "21", "resistance=0.085", "flux_linkage=0.00046").returncode, 0)
        done = self.esc_command("commission", "--node", "21", "--kv", "2300", "--yes", "--save", "--json")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        report = json.loads(done.stdout)
        found = {m["name"]: m["value"] for m in report["measured"]}
        self.assertEqual((report["end"], report["saved"], report["not_measured"]), ("done", True, ["pole_pairs", "dir_reversed"]))
        self.assertEqual(set(found), {"resistance", "inductance", "inductance_ratio", "flux_linkage", "inertia", "load"})
        self.assertAlmostEqual(found["flux_linkage"], 3.42e-4, delta=0.05 * 3.42e-4)
        self.assertIn("pole pairs 7 as entered, not measured; direction not measured", done.stderr)
        self.esc_command("restart", "--node", "21")
        self.line_with(esc.stdout, "operational: node 21")
        read = json.loads(self.esc_command("get", "--node", "21", "flux_linkage", "--json").stdout)[0]["parameters"][0]
        self.assertEqual(read["value"], found["flux_linkage"])

    def test_a_commissioning_is_refused_by_name_and_ends_with_its_tool(self):
        self.esc()
        done = self.esc_command("commission", "--node", "21")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("no terminal to ask", done.stderr)
        for words, text in ((("--bell-inertia", "1"), "--bell-inertia: error: 1 kg m2 is out of range"), (("--kv", "-1"), "out of range: 0 to 60000 rpm/V"),
                            (("--rest-only", "--count"), "nothing turns in a commissioning at rest")):
            done = self.esc_command("commission", "--node", "21", "--yes", *words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(text, done.stderr)
        commission = self.start("esc", "commission", *BUS, "--node", "21", "--yes")
        self.line_with(commission.stderr, "mohm with switches")
        commission.send_signal(signal.SIGINT)
        _, err = commission.communicate(timeout=DEADLINE_s)
        self.assertEqual(commission.returncode, 130, err)
        self.assertIn("ended: disarmed", err)
        self.assert_stands_still()

    def test_mistakes_are_refused_with_what_to_do(self):
        for code, text, words in (
                (3, "mcast:3: error: nobody is on this bus", ("get",)),
                (3, "node 99 is not on mcast:3", ("info", "--node", "99")),
                (2, "out of range: 1 to 127", ("get", "--node", "300")),
                (2, "is not NAME=VALUE", ("set", "--node", "21", "esc_index")),
                (2, "give either --rpm or --duty", ("spin", "--index", "0", "--for", "2", "--yes")),
                (2, "standard input is no terminal", ("spin", "--index", "0", "--rpm", "3000", "--for", "2")),
                (2, "--duty: error: 2 of full duty is out of range: -1 to 1 of full duty", ("spin", "--index", "0", "--duty", "2", "--yes")),
                (2, "--index: error: 16 is out of range: 0 to 15", ("spin", "--index", "16", "--rpm", "3000")),
                (2, "--max-current: error: nan A is out of range", ("spin", "--index", "0", "--rpm", "3000", "--max-current", "nan")),
                (2, "--for: error: the duration is not given", ("spin", "--index", "0", "--rpm", "3000", "--yes")),
                (2, "--index: error: which motor is to turn was not given", ("spin", "--rpm", "3000", "--for", "2", "--yes")),
                (2, "cannot read the parameter file", ("restore", "no.toml", "--node", "21")),
                (2, "--for: error: 0 s is out of range: above 0", ("monitor", "--for", "0")),
                (3, "there is no folder missing", ("serve", "--table", "missing/ids.txt")),
                (2, "out of range: 0.1 to 60", ("list", "--listen", "0"))):
            with self.subTest(words=words):
                done = self.esc_command(*words)
                self.assertEqual(done.returncode, code, done.stdout + done.stderr)
                self.assertIn(text, done.stderr)
                self.assertIn("do:", done.stderr)


# Of the tests of bus_test.py only its helpers are wanted here.
for name in [n for n in dir(BusCommand) if n.startswith("test_")]:
    if name not in EscCommand.__dict__:
        setattr(EscCommand, name, None)
del BusCommand

if __name__ == "__main__":
    bus_namespace.enter()
    main(sys.argv)
