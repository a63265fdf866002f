"""`rotorloop bus` and `rotorloop esc-sim` on multicast and over an SLCAN terminal: what a user types, what comes out.

Every wait is for an event, with a deadline that only a hanging program reaches.
usage: bus_test.py PATH_TO_ROTORLOOP
"""
import json
import os
import pathlib
import re
import selectors
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time

import bus_namespace

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from rotorloop_cli import SOURCE, CommandTest, main  # noqa: E402

DEADLINE_s = 60
PLANT = SOURCE / "vehicles/reference_plant.toml"
GROUP, PORT = "239.65.82.3", 57732


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021) & 0xFFFF if crc & 0x8000 else crc << 1 & 0xFFFF
    return crc


def packet(identifier, data, extended=True, flags=0):
    body = struct.pack("<HI", flags, identifier | (1 << 31 if extended else 0)) + data
    return struct.pack("<HH", 0x2934, crc16(body)) + body


class BusCommand(CommandTest):
    def setUp(self):
        super().setUp()
        self.unread, self.kept = {}, {}

    def start(self, *words, before=()):
        """`before`: a program that runs it, and its arguments."""
        process = subprocess.Popen([*before, self.program, *map(str, words)], cwd=self.path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

        def end():
            if process.poll() is None:
                process.kill()
            process.communicate()
        self.addCleanup(end)
        return process

    def lines(self, stream, wait_s):
        """Whole lines that have come, after waiting for some for at most this long; None at the end of the stream."""
        rest = self.unread.get(stream, b"")
        with selectors.DefaultSelector() as selector:
            selector.register(stream, selectors.EVENT_READ)
            if selector.select(wait_s):
                new = os.read(stream.fileno(), 65536)
                if not new:
                    return None
                rest += new
        *whole, self.unread[stream] = rest.split(b"\n")
        return [line.decode() for line in whole]

    def line_with(self, stream, text):
        """Reads lines until one has this text, and keeps those behind it for the next call; fails after the deadline."""
        seen, end = [], time.monotonic() + DEADLINE_s
        while time.monotonic() < end:
            new = self.kept.pop(stream, None) or self.lines(stream, max(0, end - time.monotonic()))
            if new is None:
                break
            seen += new
            for i, line in enumerate(new):
                if text in line:
                    self.kept[stream] = new[i + 1:]
                    return line
        self.fail(f"no line with {text!r}: {seen}")

    def send(self, *packets):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for p in packets:
                out.sendto(p, (GROUP, PORT))

    def esc(self, bus="mcast:3", node=21, index=0, *more):
        esc = self.start("esc-sim", "--bus", bus, "--node-id", node, "--esc-index", index, "--plant", PLANT, *more)
        self.line_with(esc.stdout, "operational: node")
        return esc

    def settles_at(self, rpm):
        """Spins ESC 0 until five reports in a row are within one percent, however long that takes, and ends it by Ctrl-C."""
        spin = self.start("esc", "spin", "--bus", "mcast:3", "--index", "0", "--rpm", rpm, "--for", "60", "--ramp", "0.5", "--yes", "--json")
        settled = 0
        while settled < 5:
            settled = settled + 1 if abs(json.loads(self.line_with(spin.stdout, f'"set_point":{rpm}'))["rpm"] - rpm) <= 0.01 * rpm else 0
        spin.send_signal(signal.SIGINT)
        spin.communicate(timeout=DEADLINE_s)

    def test_an_esc_says_that_it_is_operational_and_ends_cleanly_at_ctrl_c(self):
        esc = self.esc()
        esc.send_signal(signal.SIGINT)
        out, err = esc.communicate(timeout=DEADLINE_s)
        self.assertEqual(esc.returncode, 0, err)
        self.assertIn("commands: 0 raw", err)

    def test_dump_names_what_the_esc_sends(self):
        self.esc()
        done = self.run_command("bus", "dump", "mcast:3", "--count", 20, "--frames")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"\n?\d\d:\d\d:\d\d\.\d{6} 10040A15 \w+ +21 -> \* +esc\.Status")
        self.assertRegex(done.stdout, r"14015515 \w+ +21 -> \* +NodeStatus")

    def test_dump_decodes_transfers_field_by_field(self):
        self.esc(index=3)
        done = self.run_command("bus", "dump", "mcast:3", "--count", 12, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        heard = {t["type"]: t["fields"] for t in map(json.loads, done.stdout.splitlines())}
        self.assertEqual(heard["esc.Status"]["esc_index"], 3)
        self.assertAlmostEqual(heard["esc.Status"]["voltage"], 16.3, delta=0.5)
        self.assertEqual(heard["NodeStatus"]["mode"], 0)
        self.assertRegex(self.run_command("bus", "dump", "mcast:3", "--count", 8).stdout, r"21 -> \* +esc\.Status +error_count=0 voltage=16\.\d+ ")

    def test_filters_let_one_type_pass_and_json_has_one_object_a_line(self):
        self.esc()
        done = self.run_command("bus", "dump", "mcast:3", "--filter", "00040A00/00FFFF00", "--count", 6, "--json", "--frames")
        frames = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual([f["type"] for f in frames], ["esc.Status"] * 6)
        self.assertEqual({f["source"] for f in frames}, {21})

    def test_stat_tells_rates_of_an_idle_esc_as_the_wire_document_has_them(self):
        self.esc()
        done = self.run_command("bus", "stat", "mcast:3", "--for", 8, "--json")
        rows = {row["type"]: row for row in json.loads(done.stdout)["ids"]}
        # By the ESC's clock, however long it is held up: 2 Hz of three frames each to 1 Hz of one, and one more when its mode changes.
        self.assertEqual(rows["esc.Status"]["frames"] % 3, 0)
        self.assertIn(rows["esc.Status"]["frames"] // 3 - 2 * rows["NodeStatus"]["frames"], range(-5, 4))

    def test_malformed_packets_are_counted_and_change_nothing(self):
        dump = self.start("bus", "dump", "mcast:3", "--count", 1)
        good = packet(0x14015515, bytes.fromhex("00000000000000c1"))
        bad = [b"", b"\x34\x29", good[:-1], good[:5] + b"\xff" + good[6:], b"\x00" * 74, b"x" * 1400]
        end = time.monotonic() + DEADLINE_s
        while dump.poll() is None and time.monotonic() < end:  # the program joins the group in its own time
            self.send(*bad, good)
            try:
                dump.wait(timeout=0.2)
            except subprocess.TimeoutExpired:
                pass
        out, err = dump.communicate(timeout=DEADLINE_s)
        self.assertEqual(dump.returncode, 0, err)
        self.assertIn("NodeStatus", out)
        self.assertRegex(err, r"mcast:3: \d+ malformed packets passed over")

    def test_a_recorded_bus_plays_again_without_its_commands(self):
        self.write("bench.log", "(1.000000) can0 07040678#0003FDF0080010C0\n(1.010000) can0 14015578#00000000000000C0\n")
        heard = self.start("bus", "dump", "mcast:3", "--count", 2, "--raw")
        end = time.monotonic() + DEADLINE_s
        while heard.poll() is None and time.monotonic() < end:
            done = self.run_command("bus", "replay", "bench.log", "mcast:3")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("1 frames sent", done.stdout)
            self.assertIn("1 commands left out", done.stdout)
        out = heard.communicate(timeout=DEADLINE_s)[0]
        self.assertEqual([line.split()[2] for line in out.splitlines()], ["14015578#00000000000000C0"] * 2)

    def test_a_recording_whose_own_frames_stand_a_little_too_early_plays_in_order_of_time_and_several_joined_ones_are_refused(self):
        self.write("own.log", "(1.000000) can0 123#01\n(1.010020) can0 123#03\n(1.010000) can0 123#02\n")
        heard = self.start("bus", "dump", "mcast:3", "--count", 3, "--raw")
        end = time.monotonic() + DEADLINE_s
        while heard.poll() is None and time.monotonic() < end:
            done = self.run_command("bus", "replay", "own.log", "mcast:3")
            self.assertIn("3 frames sent, 0 not taken", done.stdout + done.stderr)
        lines = heard.communicate(timeout=DEADLINE_s)[0].splitlines()
        data = "".join(line.split("#")[1] for line in lines)
        self.assertIn(data, "010203010203", "in order, from wherever it began to hear")
        self.assertEqual({line.split()[1] for line in lines}, {"mcast3"})
        self.write("joined.log", "(1.000000) can0 123#01\n(1.210000) can0 123#03\n(1.010000) can0 123#02\n")
        for words, frame in (((), "frame 3"), (("--interface", "can0"), "frame 3 of can0")):
            done = self.run_command("bus", "replay", "joined.log", "mcast:3", *words)
            self.assertEqual(done.returncode, 2)
            self.assertIn(f"joined.log: error: {frame} is 200.000 ms older than one before it, beyond the 100 ms that are put in order", done.stderr)

    def test_an_slcan_server_bridges_a_serial_program_to_the_bus_and_back(self):
        bridge = self.start("bus", "bridge", "mcast:3", "slcan-server:tty_esc")
        self.line_with(bridge.stderr, "bridge up")
        self.esc("slcan:" + str(self.path / "tty_esc"), 33, 2)
        done = self.run_command("bus", "dump", "mcast:3", "--count", 8)
        self.assertRegex(done.stdout, r"33 -> \* +esc\.Status")
        bridge.send_signal(signal.SIGTERM)
        out, err = bridge.communicate(timeout=DEADLINE_s)
        self.assertRegex(out, r"slcan-server:tty_esc: [1-9]\d* frames taken from it")
        self.assertFalse(os.path.lexists(self.path / "tty_esc"), "the link is removed")

    def test_a_killed_sender_leaves_no_motor_spinning(self):
        """Commands for a while, then silence: 250 ms later the bridge is off, seen by the ESC's own report."""
        self.esc()
        dump = self.start("bus", "dump", "mcast:3", "--filter", "00040A00/00FFFF00", "--json", "--frames")
        speeds, transfers, end, stopped = [], b"", time.monotonic() + DEADLINE_s, False
        sequence = 0
        while time.monotonic() < end:
            if not stopped:
                tail = bytes([0xC0 | sequence % 32])
                self.send(packet(0x08044C78, b"\xff" + tail), packet(0x07040678, raw_command(2000) + tail))
                sequence += 1
            for line in self.lines(dump.stdout, 0.02) or []:
                frame = json.loads(line)
                data = bytes.fromhex(frame["data"])
                transfers = data[:-1] if data[-1] & 0x80 else transfers + data[:-1]
                if data[-1] & 0x40 and len(transfers) == 16:
                    speeds.append(rpm_of(transfers[2:]))
            if speeds and speeds[-1] > 3000:
                stopped = True
            if stopped and speeds[-1] == 0:
                return
        self.fail(f"speeds {speeds[-20:]}")

    def test_bench_accounts_for_every_frame_even_when_the_receive_buffer_overflows(self):
        for burst in (64, 60_000):
            done = self.run_command("bus", "bench", "mcast:4", "--frames", 60_000, "--burst", burst, "--round-trips", 200, "--json")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            r = json.loads(done.stdout)
            self.assertEqual(r["unexplained"], 0, r)
            self.assertEqual(r["sent"], r["received"] + r["dropped_by_receiver"])
            self.assertEqual((r["damaged"], r["out_of_order"], r["round_trips_lost"]), (0, 0, 0))
        self.assertGreater(r["dropped_by_receiver"], 0, "the burst has to fill the buffer, or nothing was tested")

    def test_wireshark_names_what_a_recording_holds(self):
        if not shutil.which("tshark"):
            self.skipTest("tshark is missing")
        self.esc()
        done = self.run_command("bus", "dump", "mcast:3", "--count", 12, "--frames", "--record", "bench.pcap")
        self.assertEqual(done.returncode, 0, done.stderr)
        fields = ["-T", "fields", "-e", "can.id", "-e", "can.len", "-e", "can.flags.xtd", "-e", "data.data"]
        read = subprocess.run(["tshark", "-r", str(self.path / "bench.pcap"), "-d", "can.subdissector,data", *fields], capture_output=True, text=True, timeout=120)
        rows = [line.split("\t") for line in read.stdout.splitlines()]
        self.assertEqual(len(rows), 12, read.stderr)
        printed = [line.split()[1:3] for line in done.stdout.splitlines()]
        self.assertEqual([int(row[0], 0) & 0x1FFFFFFF for row in rows], [int(identifier, 16) for identifier, _ in printed])
        self.assertEqual([int(row[1]) for row in rows], [len(data) // 2 for _, data in printed])

    def test_mistakes_are_refused_with_what_to_do(self):
        for code, text, words in (
                (2, "names no known backend", ("bus", "dump", "can:0")),
                (2, "multicast group", ("bus", "dump", "mcast:10")),
                (2, "lives within one program", ("bus", "stat", "virtual:")),
                (3, "gsusb:NoSuchSerial: error: ", ("bus", "dump", "gsusb:NoSuchSerial")),
                (2, "out of range: 0 to 15", ("bus", "dump", "gsusb:/99")),
                (2, "is no gs_usb adapter", ("bus", "adapter", "mcast:0")),
                (3, "gsusb:NoSuchSerial: error: ", ("bus", "adapter", "gsusb:NoSuchSerial")),
                (2, "out of range: 10000 to 1000000 bit/s", ("bus", "dump", "socketcan:can0@fast")),
                (3, "socketcan:no_such_if: error: ", ("bus", "dump", "socketcan:no_such_if")),
                (3, "socketcan:no_such_if: error: ", ("esc", "list", "--bus", "socketcan:no_such_if")),
                (3, "cannot open the serial port", ("bus", "dump", "slcan:/dev/no_such_port")),
                (2, "is none that SLCAN has", ("bus", "dump", "slcan:/dev/ttyACM0@12345")),
                (2, "is no ID or ID/MASK", ("bus", "dump", "mcast:3", "--filter", "XYZ")),
                (2, "cannot read the bus log", ("bus", "replay", "no.log", "mcast:3")),
                (2, "out of range: 0.01 to 1000", ("bus", "replay", "s.toml", "mcast:3", "--pace", "0")),
                (2, "needs two buses", ("bus", "bridge", "mcast:3")),
                (2, "stands there twice", ("bus", "bridge", "mcast:3", "mcast:3")),
                (2, "out of range: 1 to 125", ("esc-sim", "--bus", "mcast:3", "--node-id", "126", "--esc-index", "0")),
                (2, "out of range: 0 to 15", ("esc-sim", "--bus", "mcast:3", "--node-id", "21", "--esc-index", "16")),
                (2, "32 hexadecimal digits", ("esc-sim", "--bus", "mcast:3", "--node-id", "21", "--esc-index", "0", "--unique-id", "12")),
                (2, "no_such_plant.toml", ("esc-sim", "--bus", "mcast:3", "--node-id", "21", "--esc-index", "0", "--plant", "no_such_plant.toml")),
                (2, "no.elf", ("esc-sim", "--bus", "mcast:3", "--node-id", "21", "--esc-index", "0", "--elf", "no.elf")),
                (2, "is no ELF file", ("esc-sim", "--bus", "mcast:3", "--node-id", "21", "--esc-index", "0", "--elf", PLANT)),
                (2, "cannot be used with --elf", ("esc-sim", "--bus", "mcast:3", "--node-id", "21", "--esc-index", "0", "--elf", "no.elf", "--store", "s")),
                (2, "out of range: 1 to 1000000000", ("bus", "bench", "mcast:3", "--frames", "-1")),
                (2, "out of range: 1 to 1000000000", ("bus", "bench", "mcast:3", "--burst", "-1")),
                (2, "out of range: 1 to 1000000000", ("bus", "bench", "--frames", "0")),
                (2, "measure virtual:, mcast:0", ("bus", "bench", "slcan-server:"))):
            with self.subTest(words=words):
                done = self.run_command(*words)
                self.assertEqual(done.returncode, code, done.stdout + done.stderr)
                self.assertIn(text, done.stderr)
                self.assertIn("do:", done.stderr)


    def test_image_maker_refuses_with_2(self):
        for text, words in (("may be written", ["no_such_folder/x.bin"]), ("1 to 16777216", ["x.bin", "--size", "0"]),
                            ("MAJOR.MINOR", ["x.bin", "--version", "1"]), ("at most 16 bytes", ["x.bin", "--board", "b" * 17]),
                            ("required: out", [])):
            with self.subTest(words=words):
                done = subprocess.run([sys.executable, SOURCE / "scripts/make_test_image", *words], capture_output=True, text=True, timeout=60)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(text, done.stderr)


def raw_command(value):
    """RawCommand of one ESC: 14 bits, low byte first, then the six upper bits."""
    return bytes([value & 0xFF, (value >> 8 & 0x3F) << 2])


def rpm_of(status):
    """The speed in an esc.Status: 18 bits from bit 80."""
    low, middle, high = status[10], status[11], status[12] >> 6
    value = low | middle << 8 | high << 16
    return value - (1 << 18) if value & 1 << 17 else value


if __name__ == "__main__":
    bus_namespace.enter()
    main(sys.argv)
