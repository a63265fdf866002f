"""Programs that are not ours beside `rotorloop` on one bus, in the guest: python-can and can-utils on vcan0, python-can with pyusb and the
gs-usb package on emulated adapters. Every frame is compared as a line of `candump -L` without its time.

usage: other_programs_test.py ROTORLOOP CANDLELIGHT   skipped (77) without python-can (build/venv, scripts/lib.sh) or can-utils
"""
import contextlib
import glob
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

SKIPPED = 77
# Of the guest's time, for what takes milliseconds: its clock leaps on while all wait for the host's disk.
LIMIT_s = 1000
BRS, ESI, FDF = 1, 2, 4


def lines_of_every_kind(fd=True, lengths=(*range(9), 12, 16, 20, 24, 32, 48, 64)):
    """Both identifiers, classic and FD with and without a data phase, every length."""
    for identifier in ("140", "7FF", "00000001", "1401552A"):
        for flags in (None, 0, BRS) if fd else (None,):
            for length in (n for n in lengths if flags is not None or n <= 8):
                data = bytes((3 * i + length) & 0xFF for i in range(length)).hex().upper()
                yield f"{identifier}#{data}" if flags is None else f"{identifier}##{flags}{data}"


def message(line):
    identifier, _, rest = line.partition("#")
    fd = rest.startswith("#")
    flags = int(rest[1], 16) if fd else 0
    return can.Message(arbitration_id=int(identifier, 16), is_extended_id=len(identifier) == 8, is_fd=fd, bitrate_switch=bool(flags & BRS),
                       data=bytes.fromhex(rest[2:] if fd else rest))


def line_of(m):
    identifier = f"{m.arbitration_id:08X}" if m.is_extended_id else f"{m.arbitration_id:03X}"
    flags = f"#{BRS * m.bitrate_switch + ESI * m.error_state_indicator:X}" if m.is_fd else "R" if m.is_remote_frame else ""
    return f"{identifier}#{flags}{bytes(m.data).hex().upper()}"


def without_times(text):
    """[frame] of lines "(time) interface frame". Kernels since 6.1 mark every FD frame by a flag, which candump prints (CANFD_FDF, 4)."""
    return [re.sub("##([0-9A-F])", lambda flags: f"##{int(flags[1], 16) & ~FDF:X}", line.split()[2]) for line in text.splitlines()]


def wait_for(what, condition):
    end = time.monotonic() + LIMIT_s
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"{what}: not within {LIMIT_s} s")
        time.sleep(0.02)


def ip(*words):
    subprocess.run(["ip", *words], check=True)


class OnABus(unittest.TestCase):
    rotorloop = candlelight = None

    def start(self, *words, **streams):
        process = subprocess.Popen([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **streams)
        self.addCleanup(lambda: (process.kill(), process.communicate()))
        return process

    def dump(self, bus, count):
        return self.start(self.rotorloop, "bus", "dump", bus, "--raw", "--count", count)

    def ended(self, process):
        out, errors = process.communicate(timeout=LIMIT_s)
        self.assertEqual(process.returncode, 0, errors)
        return out, errors

    def replay(self, lines, bus):
        """`rotorloop bus replay` sends them, one each millisecond."""
        with tempfile.NamedTemporaryFile("w", suffix=".log") as log:
            log.writelines(f"(0.{i:06}) can0 {line}\n" for i, line in zip(range(0, 1_000_000, 1000), lines))
            log.flush()
            out, _ = self.ended(self.start(self.rotorloop, "bus", "replay", log.name, bus, "--with-commands"))
        self.assertIn(f"{len(lines)} frames sent, 0 not taken", out)

    def heard(self, bus, count):
        """Of python-can. Its gs_usb gives echoes of its own frames too; its SocketCAN calls all frames of this machine sent (is_rx)."""
        lines = []
        while len(lines) < count:
            m = bus.recv(LIMIT_s)
            self.assertIsNotNone(m, f"{len(lines)} of {count} frames")
            if not m.is_error_frame and (m.is_rx or not hasattr(bus, "gs_usb")):
                lines.append(line_of(m))
        return lines

    def exchange(self, python, bus, lines, listening):
        dump = self.dump(bus, len(lines))
        listening()
        for line in lines:
            python.send(message(line))
        out, _ = self.ended(dump)
        self.assertEqual(without_times(out), lines, "from python-can")
        self.replay(lines, bus)
        self.assertEqual(self.heard(python, len(lines)), lines, "to python-can")
        print(f"python-can and {bus}: {len(lines)} frames each way", flush=True)


def receivers(interface):
    lists = pathlib.Path("/proc/net/can").glob("rcvlist_*")
    return sum(line.split()[:1] == [interface] for path in lists for line in path.read_text().splitlines())


class Vcan(OnABus):
    def listening(self, before):
        wait_for("a receiver of vcan0", lambda: receivers("vcan0") > before)

    def test_python_can_exchanges_every_kind_of_frame(self):
        with can.Bus(interface="socketcan", channel="vcan0", fd=True) as python:
            before = receivers("vcan0")
            self.exchange(python, "socketcan:vcan0", list(lines_of_every_kind()), lambda: self.listening(before))

    def test_remote_frames_and_error_frames_of_python_can_are_no_frames_of_nodes_and_are_told(self):
        with can.Bus(interface="socketcan", channel="vcan0", fd=True) as python:
            before = receivers("vcan0")
            dump = self.dump("socketcan:vcan0", 1)
            self.listening(before)
            for extended in (False, True):
                python.send(can.Message(arbitration_id=0x123, is_extended_id=extended, is_remote_frame=True, dlc=4))
            bus_off = 0x40  # CAN_ERR_BUSOFF of linux/can/error.h
            python.send(can.Message(arbitration_id=bus_off, is_extended_id=False, is_error_frame=True, data=bytes(8)))
            python.send(message("140#11"))
            out, errors = self.ended(dump)
        self.assertEqual(without_times(out), ["140#11"])
        self.assertIn("2 remote frames passed over", errors)
        self.assertIn("bus-off", errors)

    def test_candump_sees_the_same_frames_as_bus_dump_of_cansend_and_cangen(self):
        kinds = [*lines_of_every_kind(lengths=(0, 1, 8, 64)), "123#R", "00000123#R4"]
        generated = 100
        data_frames = len(kinds) - 2 + 2 * generated
        before = receivers("vcan0")
        candump = self.start("candump", "-L", "-n", len(kinds) + 2 * generated, "vcan0")
        dump = self.dump("socketcan:vcan0", data_frames)
        self.listening(before + 1)
        for line in kinds:
            subprocess.run(["cansend", "vcan0", line], check=True)
        for options in (["-e"], ["-f", "-b"]):
            subprocess.run(["cangen", "vcan0", "-g", "1", "-n", str(generated), "-I", "r", "-L", "r", "-D", "r", *options], check=True)
        texts = [self.ended(process)[0] for process in (candump, dump)]
        self.assertEqual({line.split()[1] for text in texts for line in text.splitlines()}, {"vcan0"}, "both name the interface")
        theirs, ours = map(without_times, texts)
        self.assertEqual(theirs[:len(kinds)], kinds)
        self.assertEqual([line for line in theirs if "#R" not in line], ours)
        print(f"candump and bus dump: {len(ours)} equal frames", flush=True)

    def test_candump_sees_what_bus_replay_sends(self):
        lines = list(lines_of_every_kind())
        before = receivers("vcan0")
        candump = self.start("candump", "-L", "-n", len(lines), "vcan0")
        self.listening(before)
        self.replay(lines, "socketcan:vcan0")
        self.assertEqual(without_times(self.ended(candump)[0]), lines)


class OnAdapters(OnABus):
    """Two of them, FAR and NEAR, on one bus."""

    def setUp(self):
        self.addCleanup(lambda: wait_for("adapters pulled", lambda: not self.place("FAR") and not self.place("NEAR")))
        self.adapters = self.start(self.candlelight, stdin=subprocess.PIPE)
        self.addCleanup(self.adapters.communicate)  # ends it
        for name in ("FAR", "NEAR"):
            self.tell(f"plug {name} 1 0")
        wait_for("the kernel's interfaces", lambda: self.interface("FAR") and self.interface("NEAR"))

    def tell(self, command):
        self.adapters.stdin.write(command + "\n")
        self.adapters.stdin.flush()
        self.assertEqual(self.adapters.stdout.readline(), "done\n")

    @staticmethod
    def place(name):
        for serial in glob.glob("/sys/bus/usb/devices/*/serial"):
            with contextlib.suppress(OSError):  # pulled meanwhile
                if pathlib.Path(serial).read_text().strip() == name:
                    return pathlib.Path(serial).parent
        return None

    def interfaces(self, name):
        return sorted(pathlib.Path(path).name for path in glob.glob(f"{self.place(name)}/*:1.0/net/*"))

    def interface(self, name):
        return next(iter(self.interfaces(name)), None)

    def up(self, name, *settings):
        interface = self.interface(name)
        ip("link", "set", interface, "type", "can", "bitrate", "1000000", *settings)
        # python-can gives up where the queue is full.
        ip("link", "set", interface, "txqueuelen", "1000", "up")
        self.addCleanup(ip, "link", "set", interface, "down")
        return interface

    def taken(self, name):
        wait_for(f"{name} in use by libusb", lambda: next(self.place(name).glob("*:1.0/driver")).resolve().name == "usbfs")


class Adapters(OnAdapters):
    """FAR is python-can's, NEAR is ours."""

    def by_pyusb(self):
        number = {what: int((self.place("FAR") / what).read_text()) for what in ("busnum", "devnum")}
        return can.Bus(interface="gs_usb", channel=0, bus=number["busnum"], address=number["devnum"], bitrate=1_000_000)

    def test_python_can_on_the_kernels_driver_and_our_gs_usb_exchange_every_kind_of_frame(self):
        interface = self.up("FAR", "dbitrate", "4000000", "fd", "on")
        with can.Bus(interface="socketcan", channel=interface, fd=True) as python:
            self.exchange(python, "gsusb:NEAR@1000000,4000000", list(lines_of_every_kind()), lambda: self.taken("NEAR"))

    def test_python_can_on_pyusb_exchanges_every_classic_frame_with_our_gs_usb_and_with_our_socketcan(self):
        lines = list(lines_of_every_kind(fd=False))
        with self.by_pyusb() as python:
            self.exchange(python, "gsusb:NEAR", lines, lambda: self.taken("NEAR"))
            wait_for("the kernel's interface", lambda: self.interface("NEAR"))
            near = self.up("NEAR")
            before = receivers(near)
            self.exchange(python, f"socketcan:{near}", lines, lambda: wait_for(f"a receiver of {near}", lambda: receivers(near) > before))

    def test_bus_adapter_tells_the_bit_rate_at_which_cangen_talks(self):
        self.tell("plug TALK 2 0")
        wait_for("two channels", lambda: self.place("TALK") and len(self.interfaces("TALK")) == 2)
        channels = self.interfaces("TALK")
        for bit_rate_Hz in (500_000, 125_000):
            for channel in channels:
                ip("link", "set", channel, "type", "can", "bitrate", str(bit_rate_Hz))
                ip("link", "set", channel, "up")
            cangen = self.start("cangen", channels[0], "-g", "20", "-i")
            out, _ = self.ended(self.start(self.rotorloop, "bus", "adapter", "gsusb:NEAR", "--listen", "--json"))
            cangen.kill()
            self.assertEqual(json.loads(out)["bus_bit_rate_Hz"], bit_rate_Hz)
            for channel in channels:
                state = json.loads(subprocess.run(["ip", "-j", "-d", "link", "show", channel], check=True, stdout=subprocess.PIPE).stdout)
                self.assertEqual(state[0]["linkinfo"]["info_data"]["state"], "ERROR-ACTIVE", "nobody was disturbed")
                ip("link", "set", channel, "down")
        print("bus adapter --listen: 500 and 125 kbit/s told", flush=True)


if __name__ == "__main__":
    OnABus.rotorloop, OnABus.candlelight = sys.argv[1:]
    try:
        import can
        import gs_usb  # noqa: F401
    except ImportError as missing:
        print(f"skipped: 1 program; {missing} (scripts/lib.sh: test_venv)")
        sys.exit(SKIPPED)
    if not shutil.which("candump"):
        print("skipped: 1 program; candump is missing (scripts/packages-check.txt)")
        sys.exit(SKIPPED)
    unittest.main(argv=[sys.argv[0], "-v"])
