"""Files of other programs read, and files for other programs written, with the readers of those programs at the other end: pymavlink for DataFlash logs,
mcap for MCAP. Both come from scripts/requirements-test.txt; without them the tests are skipped and counted.

usage: other_readers_test.py PATH_TO_ROTORLOOP
"""
import csv
import json
import math
import pathlib
import struct
import sys

from rotorloop_cli import SOURCE, CommandTest, main

for folder in sorted(SOURCE.glob("build/venv/lib/python3*/site-packages")):
    sys.path.insert(0, str(folder))
try:
    from mcap.reader import make_reader
    from pymavlink.DFReader import DFReader_binary
except ImportError as missing:
    print(f"skipped: 4 tests; {missing} (scripts/requirements-test.txt)")
    sys.exit(77)

MAPPING = SOURCE / "vehicles/measured/ardupilot_bin.mapping.toml"
SIZES = {"b": "b", "B": "B", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d", "Q": "Q", "q": "q", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i",
         "n": "4s", "N": "16s", "Z": "64s", "M": "B"}
# Of each kind of message: type, letters, labels, units, multipliers, as ArduPilot 4.5 has them.
KINDS = {
    "UNIT": (1, "QbZ", "TimeUS,Id,Label", "s--", "F--"),
    "MULT": (2, "Qbd", "TimeUS,Id,Mult", "s--", "F--"),
    "FMTU": (3, "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "s---", "F---"),
    "XKF1": (20, "QBccCfffffff", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD", "s#ddhnnnnmmm", "F-BBB0000000"),
    "ATT": (21, "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF", "sddddhh-", "F000000-"),
    "IMU": (22, "QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz", "s#EEEooo--O--zz", "F-000000-----00"),
    "ESC": (23, "QBffffcfcf", "TimeUS,Instance,RPM,RawRPM,Volt,Curr,Temp,CTot,MotTemp,Err", "s#qqvAOaO%", "F-00--BCB-"),
    "RCOU": (24, "QHHHH", "TimeUS,C1,C2,C3,C4", "sYYYY", "F----"),
    "BAT": (25, "QBfffffcfBBB", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H,SH", "s#vvAaXOw%-%", "F-000C0?0000"),
    "MSG": (26, "QZ", "TimeUS,Message", "s-", "F-"),
}
UNITS = {"s": "s", "d": "deg", "h": "degheading", "n": "m/s", "m": "m", "E": "rad/s", "o": "m/s/s", "q": "rpm", "v": "V", "A": "A", "O": "degC", "a": "Ah", "#": "instance"}
MULTS = {"-": 0.0, "?": 1.0, "0": 1.0, "B": 1e-2, "C": 1e-3, "F": 1e-6}


def packed(name, *values):
    number, letters = KINDS[name][:2] if name != "FMT" else (128, "BBnNZ")
    return struct.pack("<BBB" + "".join(SIZES[c] for c in letters), 0xA3, 0x95, number, *values)


def format_message(number, name, letters, labels):
    size = struct.calcsize("<BBB" + "".join(SIZES[c] for c in letters))
    return packed("FMT", number, size, name.encode(), letters.encode(), labels.encode())


def flight(seconds=4.0):
    """A made-up flight at 100 Hz: a slow circle, four ESCs, two IMUs, texts between."""
    out = [format_message(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")]
    out += [format_message(number, name, letters, labels) for name, (number, letters, labels, _, _) in KINDS.items()]
    out += [packed("UNIT", 0, ord(k), v.encode()) for k, v in UNITS.items()]
    out += [packed("MULT", 0, ord(k), v) for k, v in MULTS.items()]
    out += [packed("FMTU", 0, number, units.encode(), mults.encode()) for number, _, _, units, mults in KINDS.values()]
    for i in range(int(100 * seconds)):
        t, us = 0.01 * i, 81_000_000 + 10_000 * i
        angle = 0.5 * t
        for core in (0, 1):
            out.append(packed("XKF1", us, core, int(300 * math.sin(t)), int(200 * math.cos(t)), int(100 * math.degrees(angle)) % 36000,
                              *(math.cos(angle), math.sin(angle), 0.1), 0.0, *(2 * math.sin(angle), -2 * math.cos(angle), -5 - 0.1 * t - core)))
        out.append(packed("ATT", us, 0, 3 * math.sin(t), 0, 2 * math.cos(t), 0, math.degrees(angle) % 360, 3))
        for k in (0, 1):
            out.append(packed("IMU", us + k, k, 0.1 * math.sin(t), 0.2, 0.5 + k, 0.3, -0.2, -9.8 + 0.1 * math.sin(3 * t), 0, 0, 25.0, 1, 1, 400, 400))
        for k in range(4):
            out.append(packed("ESC", us + 12 * k, k, 5000 + 100 * k + 300 * math.sin(t + k), 0, 16.0, 4.5, 4100, 12.5, 0, 0))
        out.append(packed("RCOU", us, 1400, 1410, 1420 + i % 7, 1430))
        if i % 10 == 0:
            out.append(packed("BAT", us, 0, 16.2 - 0.01 * t, 16.3, 18.0, 12.0, 0.1, 2500, 0.02, 90, 1, 100))
            out.append(packed("MSG", us, b"all well"))
    return b"".join(out)


class OtherReaders(CommandTest):
    def setUp(self):
        super().setUp()
        (self.path / "00000012.BIN").write_bytes(flight())

    def converted(self, log="00000012.BIN", out="flight.csv"):
        done = self.run_command("log", "convert", log, "-m", MAPPING, "-o", out, "--force")
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.path / out

    def columns(self, path):
        lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        rows = list(csv.DictReader(lines))
        return {name: [float(row[name]) for row in rows if row[name]] for name in rows[0]}

    def messages(self, path, name):
        log, out = DFReader_binary(str(path), zero_time_base=True), []
        while (m := log.recv_match(type=name)) is not None:
            out.append(m)
        log.close()
        return out

    def test_what_pymavlink_reads_of_a_log_is_what_we_read(self):
        ours, log = self.columns(self.converted()), self.path / "00000012.BIN"
        for k in range(4):
            theirs = [m.RPM * math.pi / 30 for m in self.messages(log, "ESC") if m.Instance == k]
            self.assertEqual(len(theirs), 400)
            for a, b in zip(ours[f"omega_{k + 1}[rad/s]"], theirs, strict=True):
                self.assertAlmostEqual(a, b, delta=1e-9 * b)
        imu = [m for m in self.messages(log, "IMU") if m.I == 0]
        self.assertEqual(ours["gyro_z[rad/s]"], [-m.GyrZ for m in imu])
        self.assertEqual(ours["accel_z[m/s2]"], [-m.AccZ for m in imu])
        core = [m for m in self.messages(log, "XKF1") if m.C == 0]
        self.assertEqual(ours["p_y[m]"], [-m.PE for m in core])
        for i, m in enumerate(core):
            roll, pitch, yaw = (math.radians(x) for x in (m.Roll, m.Pitch, m.Yaw))
            up = math.cos(roll) * math.cos(pitch)  # of our z along the world's
            q = [ours[f"q_{a}[1]"][i] for a in "wxyz"]
            self.assertAlmostEqual(1 - 2 * (q[1] ** 2 + q[2] ** 2), up, places=9)
            self.assertAlmostEqual(2 * (q[1] * q[2] + q[0] * q[3]), -math.sin(yaw) * math.cos(pitch), places=9)
        self.assertEqual(ours["bus[V]"], [m.Volt for m in self.messages(log, "BAT")])

    def test_a_log_written_by_pymavlink_is_read_to_the_same_numbers(self):
        log, again = DFReader_binary(str(self.path / "00000012.BIN"), zero_time_base=True), []
        while (m := log.recv_msg()) is not None:
            again.append(bytes(m.get_msgbuf()))
        log.close()
        (self.path / "again.BIN").write_bytes(b"".join(again))
        self.assertEqual(self.columns(self.converted("again.BIN", "again.csv")), self.columns(self.converted()))

    def test_log_info_and_log_check_tell_the_same_flight_and_a_cut_log_says_where(self):
        told = json.loads(self.run_command("log", "info", "00000012.BIN", "-m", MAPPING, "--json").stdout)
        self.assertIn("400", json.dumps(told))
        (self.path / "cut.BIN").write_bytes((self.path / "00000012.BIN").read_bytes()[:-20])
        said = self.run_command("log", "info", "cut.BIN", "-m", MAPPING).stdout
        self.assertRegex(said, r"the log ends at byte \d+: the message \w+ there is cut")

    def test_mcap_is_read_by_its_own_library_with_schemas_units_and_every_value(self):
        ours = self.columns(self.converted())
        with open(self.converted(out="flight.mcap"), "rb") as file:
            reader = make_reader(file)
            summary = reader.get_summary()
            topics = {c.topic: c for c in summary.channels.values()}
            self.assertEqual(summary.statistics.message_count, sum(summary.statistics.channel_message_counts.values()))
            self.assertEqual(topics["/rotor_omega_rad_s"].metadata["unit"], "rad/s")
            for schema in summary.schemas.values():
                self.assertEqual(schema.encoding, "jsonschema")
                self.assertEqual(json.loads(schema.data)["type"], "object")
            got, last = {}, 0
            for _, channel, message in reader.iter_messages():
                self.assertGreaterEqual(message.log_time, last)
                last = message.log_time
                got.setdefault(channel.topic, []).append((1e-9 * message.log_time, json.loads(message.data)))
        self.assertEqual([m["rotor_3"] for _, m in got["/rotor_omega_rad_s"]], ours["omega_3[rad/s]"])
        self.assertEqual([m["x"] for _, m in got["/accel_B_m_s2"]], ours["accel_x[m/s2]"])
        self.assertEqual([m["pose"]["position"]["z"] for _, m in got["/pose"]], ours["p_z[m]"])
        self.assertEqual([m["value"] for _, m in got["/battery_V"]], ours["bus[V]"])
        self.assertAlmostEqual(got["/pose"][100][0], 82.0, places=9)
        self.assertEqual(got["/pose"][100][1]["timestamp"]["sec"], 82)


if __name__ == "__main__":
    main(sys.argv)
