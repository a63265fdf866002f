"""`rotorloop stand` with emulated instruments in processes of their own, and pymodbus at the other end of two profiles."""
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

ROTORLOOP = pathlib.Path(sys.argv.pop(1)).resolve() if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else None
SOURCE = pathlib.Path(__file__).resolve().parents[3]
# Debian's pymodbus belongs to Debian's Python, whatever Python runs this.
PYMODBUS_PYTHON = next((python for python in (sys.executable, "/usr/bin/python3")
                        if os.path.exists(python) and subprocess.run([python, "-c", "import pymodbus.client, pymodbus.server"], capture_output=True).returncode == 0), None)
NEEDS_PYMODBUS = unittest.skipUnless(PYMODBUS_PYTHON, "python3-pymodbus with python3-serial-asyncio is not installed")
HERE = pathlib.Path(__file__).resolve().parent


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def run(*words, **more):
    return subprocess.run([ROTORLOOP, "stand", *words], cwd=SOURCE, text=True, capture_output=True, timeout=100, **more)


class Process:
    """A server that is there when entered, and gone afterwards."""

    def __init__(self, command):
        self.process = subprocess.Popen(command, cwd=SOURCE, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.first_line = self.process.stdout.readline()  # said when it listens

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.out, self.err = self.process.communicate(timeout=100)


def emulate(*words):
    return Process([ROTORLOOP, "stand", "emulate", *words])


def values(document, device=0):
    return {c["name"]: c.get("value") for c in document[device]["channels"]}


class Instruments(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)

    def tearDown(self):
        self.folder.cleanup()

    def patient(self, profile):
        """A copy of a shipped profile whose device may take 10 s: a machine under load holds it up, and what is judged is not how fast it is."""
        name, at, slave = profile.partition("@")
        text = re.sub(r"(?m)^(byte_timeout_ms|late_max_ms) = .*\n", "", (SOURCE / f"devices/{name}.toml").read_text())
        path = self.path / f"{name}.toml"
        path.write_text(re.sub(r"(?m)^timeout_ms = \d+", "timeout_ms = 10000\nbyte_timeout_ms = 1000\nlate_max_ms = 10000", text))
        return f"{path}{at}{slave}"

    def read(self, port, *words):
        done = run("read", port, *map(self.patient, words), "--for", "1.0", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_two_instruments_on_one_pseudo_terminal_are_read_by_their_profiles(self):
        bus = str(self.path / "bus")
        with emulate("laumas_tlb@1", "seneca_zsg3@2", "--rtu", bus, "--set", "laumas_tlb.net=-12", "--set", "seneca_zsg3.gross=3.25"):
            document = self.read("rtu:" + bus, "laumas_tlb@1", "seneca_zsg3@2")
        self.assertEqual(values(document)["net"], -12.0)
        self.assertEqual(values(document, 1)["gross"], 3.25)
        self.assertEqual(document[0]["evidence"], "manual")
        self.assertFalse(os.path.lexists(bus), "the emulator takes its pseudo-terminal away with it")

    def test_a_device_that_is_not_there_is_named_with_exit_code_3(self):
        bus = str(self.path / "bus")
        with emulate("xy_md02@4", "--rtu", bus, "--json") as server:
            done = run("read", "rtu:" + bus, "xy_md02@5", "--for", "0.5")
        self.assertEqual(done.returncode, 3)
        answers, end = json.loads(server.first_line), json.loads(server.out)
        self.assertEqual((answers["event"], answers["device"], answers["slave"]), ("answers", "xy_md02", 4))
        self.assertEqual((end["event"], end["answered"]), ("end", 0))
        self.assertIn("no answer from xy_md02", done.stderr)

    def test_mistakes_on_the_command_line_say_what_to_do(self):
        for words, says in ((("read", "tcp:127.0.0.1:99999", "laumas_tlb"), "give 1 to 65535"), (("profile", "show", "laumas"), "laumas_tlb"),
                            (("read", "rtu:x", "laumas_tlb@300"), "1 to 247"), (("emulate", "laumas_tlb"), "--rtu"),
                            (("emulate", "laumas_tlb@1", "laumas_tlb@1", "--tcp", "0"), "same address"),
                            (("emulate", "laumas_tlb", "--tcp", "0", "--set", "nett=1"), "net"), (("emulate", "ceybnj_torque", "--tcp", "0", "--set", "torque=2"), "cannot hold"),
                            (("probe", "tcp:127.0.0.1:1", "--load", "1", "--unit", "kg"), "no device listens"),
                            (("probe", "tcp:127.0.0.1:1", "--load", "1", "--unit", "kg", "--json", "-o", "x.toml"), "--pick")):
            done = run(*words)
            self.assertIn(done.returncode, (2, 3), words)
            self.assertIn(says, done.stderr, words)

    def test_profile_list_show_and_check(self):
        names = [row["name"] for row in json.loads(run("profile", "list", "--json").stdout)]
        self.assertGreaterEqual(len(names), 8)
        for name in names:
            shown = run("profile", "show", name)
            self.assertEqual(shown.returncode, 0, shown.stderr)
            self.assertIn("not seen on hardware", shown.stdout)
        broken = self.path / "mine.toml"
        broken.write_text((SOURCE / "devices/xy_md02.toml").read_text().replace('type = "s16"', 'type = "s17"'))
        done = run("profile", "check", str(broken))
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, r"mine.toml:\d+: error: channel\[1\].type = \"s17\" is not known \(column 8\)")
        done = run("profile", "check", "--json", "xy_md02", str(broken))
        self.assertEqual(done.returncode, 2)
        document = json.loads(done.stdout)
        self.assertFalse(document["valid"])
        self.assertEqual([f["valid"] for f in document["files"]], [True, False])
        self.assertGreater(document["files"][0]["channels"], 1)
        self.assertRegex(document["files"][1]["where"], r"mine.toml:\d+")
        self.assertIn('"s17" is not known', document["files"][1]["what"])

    def test_stand_check_shows_calibration_and_refuses_one_that_expired(self):
        example = "devices/examples/stand.toml"
        done = run("check", example, "--today", "2026-12-01")
        self.assertEqual(done.returncode, 0, done.stderr)
        for words in ("axis thrust", "cross-talk from torque", "condition 1.0", "at most, as byte times"):
            self.assertIn(words, done.stdout)
        done = run("check", example, "--today", "2027-12-01")
        self.assertEqual(done.returncode, 5)
        self.assertIn("expired on 2027-05-20", done.stderr)
        broken = self.path / "mine.toml"
        broken.write_text((SOURCE / example).read_text().replace('profile = "laumas_tlb"', 'profile = "laumas"'))
        done = run("check", str(broken))
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, r"mine.toml:\d+: error: .laumas. is neither a file nor an included profile \(column 11\)")

    def test_probe_finds_a_float_with_its_low_word_first(self):
        profile = self.path / "unknown.toml"
        profile.write_text('format = 1\n[device]\nvendor = "x"\nmodel = "y"\nsource = "made up"\nevidence = "emulated"\n[bus]\nbaud = [9600]\nformat = "8N1"\ntcp = true\n'
                           'timeout_ms = 100\nsource = "made up"\n[[channel]]\nname = "w"\nquantity = "force"\nunit = "g"\naddr = 2\ntype = "f32"\nword_order = "CDAB"\n'
                           '[[channel]]\nname = "pad"\nquantity = "raw"\naddr = 0\ntype = "u32"\n')
        port, part = free_port(), self.path / "part.toml"
        with emulate(str(profile), "--tcp", str(port), "--sine", "w=0.3,0.05,0.37"):
            probe = subprocess.Popen([ROTORLOOP, "stand", "probe", f"tcp:127.0.0.1:{port}", "--count", "4", "--load", "500", "--unit", "g", "--pick", "1", "--json", "-o", str(part)], cwd=SOURCE,
                                     text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            probe.stdin.write("\n")
            probe.stdin.flush()
            asked = ""
            while "Put 500" not in asked:
                asked += probe.stderr.read(1)
        with emulate(str(profile), "--tcp", str(port), "--sine", "w=500.3,0.05,0.37"):
            out, err = probe.communicate("\n", timeout=60)
        self.assertEqual(probe.returncode, 0, out + err)
        text = part.read_text()
        for line in ("addr = 2", 'type = "f32"', 'word_order = "CDAB"', "scale = 1"):
            self.assertIn(line, text, out)
        document = json.loads(out)
        self.assertEqual(document["written"], str(part))
        self.assertEqual((document["candidates"][0]["address"], document["candidates"][0]["order"]), (2, "CDAB"))
        self.assertAlmostEqual(document["candidates"][0]["with_load"], 500.3, delta=0.06)
        self.assertEqual(len(document["words_with_load"]), 4)

    @NEEDS_PYMODBUS
    def test_pymodbus_as_server_is_read_by_two_profiles(self):
        port = free_port()
        # Laumas: 12.34 kg in divisions of 0.05 kg, below zero; registers as struct and the manual give them
        weight = struct.unpack(">HH", struct.pack(">I", 1234))
        holding = {6: 1 << 7, 7: weight[0], 8: weight[1], 9: 0, 10: 0, 13: 10}
        with Process([PYMODBUS_PYTHON, HERE / "pymodbus_server.py", str(port), json.dumps({"holding": holding, "input": {}})]):
            document = self.read(f"tcp:127.0.0.1:{port}", "laumas_tlb")
        self.assertAlmostEqual(values(document)["gross"], -12.34, places=12)
        port = free_port()
        net = struct.unpack(">HH", struct.pack(">f", 1.25))
        with Process([PYMODBUS_PYTHON, HERE / "pymodbus_server.py", str(port), json.dumps({"holding": {63: net[0], 64: net[1]}, "input": {}})]):
            document = self.read(f"tcp:127.0.0.1:{port}", "seneca_zsg3")
        self.assertEqual(values(document)["net"], 1.25)
        self.assertEqual(document[0]["failed"], 0)

    @NEEDS_PYMODBUS
    def test_pymodbus_as_client_reads_two_emulated_profiles_over_tcp_and_a_serial_line(self):
        def client(*words):
            done = subprocess.run([PYMODBUS_PYTHON, HERE / "pymodbus_client.py", *map(str, words)], capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 0, done.stderr)
            return json.loads(done.stdout)

        port = free_port()
        with emulate("seneca_zsg3", "--tcp", str(port), "--set", "net=-2.5"):
            words = client(f"tcp:{port}", 1, 63, 2)["registers"]
            self.assertIn("error", client(f"tcp:{port}", 1, 1000, 1))
        self.assertEqual(struct.unpack(">f", struct.pack(">HH", *words))[0], -2.5)
        bus = str(self.path / "bus")
        with emulate("laumas_tlb@7", "--rtu", bus, "--set", "gross=-250", "--baud", "115200"):
            words = client("rtu:" + bus, 7, 6, 3)["registers"]
        self.assertEqual(words[0] >> 7 & 1, 1)
        self.assertEqual(struct.unpack(">I", struct.pack(">HH", *words[1:]))[0], 250)


if __name__ == "__main__":
    unittest.main()
