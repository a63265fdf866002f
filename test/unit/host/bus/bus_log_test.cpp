// Recordings: the exact bytes other tools expect, and nothing lost on the way through a file.
#include "host/bus/bus_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "host/base/error.hpp"
#include "host/bus/candump_log.hpp"
#include "host/bus/pcap_log.hpp"

namespace rotorloop {
namespace {

using ::testing::HasSubstr;

struct TemporaryFile {
  explicit TemporaryFile(const std::string& name)
      : path((std::filesystem::temp_directory_path() /
              (std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + "_" + std::to_string(::getpid()) + name))
                 .string()) {}
  ~TemporaryFile() { std::filesystem::remove(path); }
  std::string path;
};

CanFrame frame(std::uint32_t id, bool extended, std::initializer_list<int> data) {
  CanFrame f{.id = id, .extended = extended, .length = static_cast<std::uint8_t>(data.size())};
  std::size_t i = 0;
  for (const int byte : data) f.data[i++] = static_cast<std::uint8_t>(byte);
  return f;
}

std::string line(std::int64_t time_ns, std::string_view interface, const CanFrame& f) {
  char out[96];
  return std::string(out, format_candump(out, time_ns, interface, f));
}

std::vector<LoggedFrame> mixed_traffic(std::int64_t resolution_ns) {
  std::vector<LoggedFrame> frames;
  std::uint64_t state = 7;
  const auto next = [&] { return state = state * 6364136223846793005ull + 1442695040888963407ull, state >> 33; };
  std::int64_t time_ns = 0;
  for (int n = 0; n < 3000; ++n) {
    LoggedFrame f;
    f.frame.fd = next() % 4 == 0;
    f.frame.bit_rate_switch = f.frame.fd && next() % 2 == 0;
    f.time_ns = time_ns += static_cast<std::int64_t>(next() % 2'000'000) * resolution_ns;
    f.frame.extended = next() % 2 == 0;
    f.frame.id = static_cast<std::uint32_t>(next()) & (f.frame.extended ? 0x1FFFFFFFu : 0x7FFu);
    f.frame.length = static_cast<std::uint8_t>(next() % 9);
    if (f.frame.fd && next() % 2 == 0) f.frame.length = kFdLengths[next() % kFdLengths.size()];
    for (std::size_t i = 0; i < f.frame.length; ++i) f.frame.data[i] = static_cast<std::uint8_t>(next());
    frames.push_back(f);
  }
  return frames;
}

void expect_same(const std::vector<LoggedFrame>& a, const std::vector<LoggedFrame>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].time_ns, b[i].time_ns) << "frame " << i;
    ASSERT_EQ(a[i].frame, b[i].frame) << "frame " << i;
  }
}

TEST(Candump, LineIsTheOneOfCandumpL) {
  EXPECT_EQ(line(1'436'509'052'249'713'000, "vcan0", frame(0x044, false, {0x2A, 0x36, 0x6C, 0x2B, 0xBA})),
            "(1436509052.249713) vcan0 044#2A366C2BBA\n");
  EXPECT_EQ(line(0, "can0", frame(0x1F334455, true, {0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88})),
            "(0000000000.000000) can0 1F334455#1122334455667788\n");
  EXPECT_EQ(line(12'000'001'999, "can0", frame(5, true, {})), "(0000000012.000001) can0 00000005#\n");
}

TEST(Candump, FileRoundTripKeepsEveryFrameAndMicrosecond) {
  const TemporaryFile file(".log");
  const std::vector<LoggedFrame> frames = mixed_traffic(1'000);
  CandumpWriter writer(file.path, "vcan0");
  for (const LoggedFrame& f : frames) writer.write(f.time_ns, f.frame);
  writer.close();
  const BusLog log = read_bus_log(file.path);
  expect_same(frames, log.frames);
  EXPECT_EQ(log.interfaces, std::vector<std::string>{"vcan0"});
}

TEST(Candump, ForeignRecordingIsReadAndWhatCannotBeSentIsCounted) {
  const BusLog log = parse_candump(
      "(1.000000) can0 123#11.22.33\r\n"
      "(1.000100) can1 00000123#DEADBEEF R\n"
      "\n"
      "(1.000200) can0 123##0112233\n"
      "(1.000300) can0 123#R4\n"
      "(1.000400) can0 20000080#0000000000000000\n"
      "(1.000500) can1 7FF#1122334455667788_C T",
      "foreign.log");
  ASSERT_EQ(log.frames.size(), 4u);
  EXPECT_EQ(log.frames[0].frame, BusFrame(frame(0x123, false, {0x11, 0x22, 0x33})));
  EXPECT_EQ(log.frames[0].time_ns, 1'000'000'000);
  EXPECT_EQ(log.frames[1].frame, BusFrame(frame(0x123, true, {0xDE, 0xAD, 0xBE, 0xEF})));
  EXPECT_EQ(log.interfaces[log.frames[1].interface], "can1");
  const BusFrame& fd = log.frames[2].frame;
  EXPECT_TRUE(fd.fd && !fd.bit_rate_switch);
  EXPECT_EQ((std::vector<int>{fd.length, fd.data[0], fd.data[1], fd.data[2]}), (std::vector<int>{3, 0x11, 0x22, 0x33}));
  EXPECT_EQ(log.frames[3].frame.length, 8);
  EXPECT_EQ(log.skipped_remote, 1u);
  EXPECT_EQ(log.skipped_error, 1u);
}

TEST(Candump, BadLineIsNamedWithFileAndLine) {
  const auto refusal = [](const std::string& bad) {
    try {
      parse_candump("(0.000000) can0 123#00\n" + bad + "\n", "run/bus.log");
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return "accepted: " + bad;
  };
  EXPECT_THAT(refusal("(0.000001) can0 123#0"), HasSubstr("run/bus.log:2: error: expected pairs of hex digits"));
  EXPECT_THAT(refusal("(0.000001) can0 12#00"), HasSubstr("expected an identifier of 3 or 8 hex digits"));
  EXPECT_THAT(refusal("(0.000001) can0 800#00"), HasSubstr("identifier beyond 7FF"));
  EXPECT_THAT(refusal("(0.000001) can0 123#001122334455667788"), HasSubstr("more than 8 data bytes"));
  EXPECT_THAT(refusal("(0.0001) can0 123#00"), HasSubstr("decimal digits in the time stamp"));
  EXPECT_THAT(refusal("can0 123 [2] 00 11"), HasSubstr("expected a time stamp"));
  EXPECT_THAT(refusal("(0.000001) can0"), HasSubstr("expected an interface name and a frame"));
  EXPECT_THAT(refusal("(0.000001) can0 123##"), HasSubstr("expected a digit of flags"));
  EXPECT_THAT(refusal("(0.000001) can0 123##1112233445566778899"), HasSubstr("9 data bytes, which no CAN FD frame has"));
  EXPECT_THAT(refusal("(0.000001) can0 123##1" + std::string(130, '0')), HasSubstr("more than 64 data bytes"));
  EXPECT_THAT(refusal("(0.000001) can0 123#00 nonsense"), HasSubstr("unexpected text after the frame"));
}

TEST(Candump, InterfaceNameThatWouldBreakTheFormatIsRefused) {
  const TemporaryFile file(".log");
  EXPECT_THROW(CandumpWriter(file.path, "two words"), Error);
  EXPECT_THROW(CandumpWriter(file.path, ""), Error);
  EXPECT_THROW(CandumpWriter(file.path, "sixteen_letters_"), Error);
}

TEST(Candump, CommentsArePassedOverAndACutLastLineIsLeftOutAndNoted) {
  const BusLog log =
      parse_candump("# bench, ESC 3 replaced\n(1.000001) can0 123#1122\n; noted by hand\n(1.000002) can0 124#33\n(1.000003) can0 1", "x");
  ASSERT_EQ(log.frames.size(), 2u);
  EXPECT_EQ(log.frames[1].frame.id, 0x124u);
  ASSERT_EQ(log.notes.size(), 1u);
  EXPECT_EQ(log.notes[0], "line 5 was cut off and is left out");
  EXPECT_EQ(parse_candump("(1.000001) can0 123#1122334455667788\n(1.000002) can0 123#1122", "x").frames.size(), 1u)
      << "2 bytes of how many?";
  EXPECT_EQ(parse_candump("(1.000001) can0 123#1122334455667788", "x").frames.size(), 1u) << "no frame has more";
  EXPECT_THROW((void)parse_candump("(1.000003) can0 1\n(1.000004) can0 123#11\n", "x"), Error) << "a damaged line within the file";
}

TEST(Candump, TextOfTheScreenIsReadAsTheFile) {
  const BusLog log = parse_candump(
      " (1700000000.000001)  can0  123   [2]  11 22\n (1700000000.000002)  can0  1F334455   [8]  00 01 02 03 04 05 06 07\n"
      " (1700000000.000003)  can0  123   [4]  remote request\n (1700000000.000004)  can0  124  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B\n",
      "x");
  ASSERT_EQ(log.frames.size(), 3u);
  EXPECT_EQ(log.frames[0].frame.data[1], 0x22);
  EXPECT_TRUE(log.frames[1].frame.extended);
  EXPECT_EQ(log.frames[1].time_ns, 1'700'000'000'000'002'000);
  EXPECT_TRUE(log.frames[2].frame.fd);
  EXPECT_EQ(log.frames[2].frame.length, 12);
  EXPECT_EQ(log.skipped_remote, 1u);
}

TEST(Candump, StampsThatAreTheTimeSinceTheLineBeforeAreAddedUpOverRemoteFramesTooAndNoted) {
  std::string text;
  for (int i = 0; i < 4; ++i)
    text += " (000.010000)  can0  123   [1]  11\n (000.000100)  can0  124   [4]  remote request\n (000.000200)  can0  125   [1]  22\n";
  const BusLog log = parse_candump(text, "x");
  ASSERT_EQ(log.frames.size(), 8u);
  EXPECT_EQ(log.frames[1].time_ns, 10'300'000);
  EXPECT_EQ(log.frames[7].time_ns, 41'200'000);
  ASSERT_EQ(log.notes.size(), 1u);
  EXPECT_NE(log.notes[0].find("since the line before"), std::string::npos);
}

TEST(Candump, AClockThatIsSetBackOnceStaysAsLogged) {
  std::string text;
  for (int i = 0; i < 30; ++i) text += "(" + std::to_string(i < 20 ? 100 + i : 70 + i) + ".000000) can0 123#11\n";
  const BusLog log = parse_candump(text, "x");
  EXPECT_EQ(log.frames[20].time_ns, 90'000'000'000);
  EXPECT_TRUE(log.notes.empty());
}

TEST(Candump, DirectionAndFlagsOfTheScreenAndWordsAboutErrorsArePassedOver) {
  const BusLog log = parse_candump(
      " (1.000001)  can0  RX - -  123   [2]  11 22\n (1.000002)  can0  TX B -  1F334455  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B\n"
      " (1.000003)  can0  20000004   [8]  00 20 00 00 00 00 60 00   ERRORFRAME\n\tcontroller-problem{rx-overflow}\n",
      "x");
  ASSERT_EQ(log.frames.size(), 2u);
  EXPECT_EQ(log.frames[0].frame.data[1], 0x22);
  EXPECT_TRUE(log.frames[1].frame.bit_rate_switch);
  EXPECT_EQ(log.skipped_error, 1u);
}

TEST(ForeignBusLog, TextInUTF16OrWithAByteOrderMarkIsReadLikeAnyOther) {
  const TemporaryFile file(".log");
  const std::string text = "(1.000001) can0 123#1122\n";
  std::string wide = "\xFF\xFE";
  for (const char c : text) wide += {c, '\0'};
  for (const std::string& bytes : {wide, "\xEF\xBB\xBF" + text}) {
    std::ofstream(file.path, std::ios::binary) << bytes;
    ASSERT_EQ(read_bus_log(file.path).frames.size(), 1u);
    EXPECT_EQ(read_bus_log(file.path).frames[0].frame.data[1], 0x22);
  }
}

TEST(ForeignBusLog, RelativeStampsOfAnAscAreAddedUpOverEventsAndDecimalCommasAreRead) {
  const TemporaryFile file(".asc");
  std::ofstream(file.path) << "date Mon Nov 28 07:00:00.000 am 2026\nbase hex  timestamps relative\n"
                              "   0,010000 1  64   Rx   d 1 00\n   0,020000 1  Statistic: D 10 R 0\n   0,030000 1  65   Rx   d 1 01\n";
  const BusLog log = read_bus_log(file.path);
  ASSERT_EQ(log.frames.size(), 2u) << "neither of them passed over for its comma";
  EXPECT_EQ(log.frames[0].time_ns, 10'000'000);
  EXPECT_EQ(log.frames[1].time_ns, 60'000'000);
}

// Lines as PEAK's "PCAN Trace File Format" (version 1.1 and 2.1) prints them.
TEST(ForeignBusLog, TraceOfPcanViewIsReadInBothItsForms) {
  const TemporaryFile file(".trc");
  std::ofstream(file.path) << ";$FILEVERSION=1.1\n;$STARTTIME=25569.5\n;   Message Number\n"
                              "     1)      1059.9  Rx         0300  7  00 00 00 00 04 00 00\n"
                              "     2)      1283.2  Rx     1F334455  4  20 B9 17 94\n"
                              "     3)      1298.9  Tx         0400  2  RTR\n     4)      1300.0  Error      0008  4  00 19 08 08\n";
  const BusLog one = read_bus_log(file.path);
  ASSERT_EQ(one.frames.size(), 2u);
  EXPECT_EQ(one.frames[0].time_ns, 43'200'000'000'000 + 1'059'900'000) << "12 h after the start of 1970";
  EXPECT_EQ(one.frames[0].frame.id, 0x300u);
  EXPECT_EQ(one.frames[0].frame.length, 7);
  EXPECT_TRUE(one.frames[1].frame.extended);
  EXPECT_EQ(one.frames[1].frame.data[1], 0xB9);
  EXPECT_EQ(one.skipped_remote, 1u);
  EXPECT_EQ(one.skipped_error, 1u);
  std::ofstream(file.path) << ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n"
                              "      1      1059.900 DT 1      0300 Rx -  2    11 22\n"
                              "      2      1060.100 FB 1  18EF8034 Rx -  9    00 01 02 03 04 05 06 07 08 09 0A 0B\n"
                              "      3      1061.000 ST 1           Rx -  4    00 00 00 00\n      4      1062.0";
  const BusLog two = read_bus_log(file.path);
  ASSERT_EQ(two.frames.size(), 2u);
  EXPECT_TRUE(two.frames[1].frame.fd && two.frames[1].frame.bit_rate_switch);
  EXPECT_EQ(two.frames[1].frame.length, 12);
  EXPECT_EQ(two.notes.size(), 1u) << "the last line was cut";
}

// Lines as CANalyzer's "ASCII Logging File Format" has them.
TEST(ForeignBusLog, AscOfVectorIsReadAndEventsArePassedOver) {
  const TemporaryFile file(".asc");
  std::ofstream(file.path) << "date Mon Nov 28 07:00:00.000 am 2026\nbase hex  timestamps absolute\ninternal events logged\n"
                              "// version 8.0.0\nBegin Triggerblock\n   0.000000 Start of measurement\n"
                              "   0.015991 1  64              Rx   d 8 00 01 02 03 04 05 06 07  Length = 0\n"
                              "   0.016991 1  1F334455x       Tx   d 2 AA BB\n   0.017 1  65   Rx   r\n"
                              "   0.020000 1  Statistic: D 10 R 0 XD 0 XR 0 E 0 O 0 B 0.1%\n   0.030000 1  ErrorFrame\n"
                              "   0.040000 CANFD   1 Rx   18EF8034x   Name   1 0 9 12 00 01 02 03 04 05 06 07 08 09 0A 0B 0 0 1000\n"
                              "End TriggerBlock\n";
  const BusLog log = read_bus_log(file.path);
  ASSERT_EQ(log.frames.size(), 3u);
  EXPECT_EQ(log.frames[0].time_ns, 15'991'000);
  EXPECT_EQ(log.frames[0].frame.id, 0x64u);
  EXPECT_TRUE(log.frames[1].frame.extended);
  EXPECT_EQ(log.frames[1].frame.data[1], 0xBB);
  EXPECT_TRUE(log.frames[2].frame.fd);
  EXPECT_EQ(log.frames[2].frame.length, 12);
  EXPECT_EQ(log.skipped_remote, 1u);
  EXPECT_EQ(log.skipped_error, 1u);
}

TEST(FieldBusLogs, ACutLogHas248FramesAndANoteAndACommentIsSkipped) {
  const char* root = std::getenv("ROTORLOOP_DATA");
  if (root == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  const BusLog cut = read_bus_log(std::string(root) + "/field/C2_cut.log");
  EXPECT_EQ(cut.frames.size(), 248u);
  EXPECT_EQ(cut.notes.size(), 1u);
  const BusLog comment = read_bus_log(std::string(root) + "/field/C3_comment.log");
  EXPECT_GE(comment.frames.size(), 248u);
  EXPECT_TRUE(comment.notes.empty());
}

TEST(Pcap, BytesAreThoseOfTheSpecification) {
  // File header: magic with nanoseconds, version 2.4, link type 227. Record: 1 s + 500 ns, 10 bytes; identifier big-endian
  // with bit 31 for extended.
  char out[64];
  std::size_t n = format_pcap_file_header(out);
  n += format_pcap_record(out + n, 1'000'000'500, frame(0x12345678, true, {0xAB, 0xCD}));
  const std::vector<int> expected = {0x4D, 0x3C, 0xB2, 0xA1, 2,    0,    4, 0, 0,    0,   0, 0, 0,  0, 0, 0,
                                     0xFF, 0xFF, 0,    0,    227,  0,    0, 0,                                //
                                     1,    0,    0,    0,    0xF4, 0x01, 0, 0, 10,   0,   0, 0, 10, 0, 0, 0,  //
                                     0x92, 0x34, 0x56, 0x78, 2,    0,    0, 0, 0xAB, 0xCD};
  std::vector<int> got;
  for (std::size_t i = 0; i < n; ++i) got.push_back(static_cast<unsigned char>(out[i]));
  EXPECT_EQ(got, expected);
}

TEST(Pcap, FileRoundTripKeepsEveryFrameAndNanosecond) {
  const TemporaryFile file(".pcap");
  const std::vector<LoggedFrame> frames = mixed_traffic(1);
  PcapWriter writer(file.path);
  for (const LoggedFrame& f : frames) writer.write(f.time_ns, f.frame);
  writer.close();
  const BusLog log = read_bus_log(file.path);
  expect_same(frames, log.frames);
  EXPECT_EQ(log.skipped_remote + log.skipped_error, 0u);
}

std::string big_endian_microsecond_file() {
  const auto u32 = [](std::uint32_t v) {
    return std::string{static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8), static_cast<char>(v)};
  };
  const std::string head = u32(0xA1B2C3D4) + u32(2u << 16 | 4) + u32(0) + u32(0) + u32(65535) + u32(227);
  // As Wireshark captures from a socket: padded to 16 bytes.
  const std::string remote = u32(0) + u32(5) + u32(16) + u32(16) + u32(0x40000123) + std::string("\x02\0\0\0\0\0\0\0\0\0\0\0", 12);
  const std::string error = u32(0) + u32(6) + u32(16) + u32(16) + u32(0x20000004) + std::string("\x08\0\0\0\0\x01\0\0\0\0\0\0", 12);
  const std::string fd = u32(0) + u32(7) + u32(20) + u32(20) + u32(0x00000123) + std::string("\x0C\x04\0\0", 4) + std::string(12, 'x');
  const std::string data = u32(3) + u32(8) + u32(16) + u32(16) + u32(0x00000123) + std::string("\x02\0\0\0\x11\x22\0\0\0\0\0\0", 12);
  return head + remote + error + fd + data;
}

TEST(Pcap, BigEndianMicrosecondFileIsReadAndWhatCannotBeSentIsCounted) {
  const BusLog log = parse_pcap(big_endian_microsecond_file(), "foreign.pcap");
  ASSERT_EQ(log.frames.size(), 2u);
  EXPECT_TRUE(log.frames[0].frame.fd);
  EXPECT_EQ(log.frames[0].frame.length, 12);
  EXPECT_EQ(log.frames[0].frame.data[11], 'x');
  EXPECT_EQ(log.frames[1].time_ns, 3'000'008'000);
  EXPECT_EQ(log.frames[1].frame, BusFrame(frame(0x123, false, {0x11, 0x22})));
  EXPECT_EQ(log.skipped_remote, 1u);
  EXPECT_EQ(log.skipped_error, 1u);
}

TEST(Pcap, CutOrForeignFileIsRefusedWithTheRecordOrTheReason) {
  const auto refusal = [](const std::string& bytes) {
    try {
      parse_pcap(bytes, "bus.pcap");
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  const std::string good = big_endian_microsecond_file();
  EXPECT_THAT(refusal(good.substr(0, good.size() - 1)), HasSubstr("bus.pcap: record 4: error: the file ends within a frame"));
  EXPECT_THAT(refusal(good.substr(0, 24 + 15)), HasSubstr("record 1: error: the file ends within a record header"));
  std::string ethernet = good;
  ethernet[23] = 1;
  EXPECT_THAT(refusal(ethernet), HasSubstr("link type 1, a CAN recording has 227"));
  EXPECT_THAT(refusal(std::string("\x0A\x0D\x0D\x0A", 4) + std::string(40, '\0')), HasSubstr("pcapng"));
}

TEST(Recorder, MissingFolderIsADeviceErrorWithThePath) {
  try {
    PcapWriter writer("/nonexistent_folder/bus.pcap");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::device);
    EXPECT_THAT(e.what(), HasSubstr("/nonexistent_folder/bus.pcap"));
  }
}

TEST(Recorder, FullDiskIsReportedAndNotSwallowed) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  CandumpWriter writer("/dev/full", "can0");
  writer.write(0, frame(1, false, {}));
  EXPECT_THROW(writer.close(), Error);
}

TEST(BusLog, MissingFileIsNamed) { EXPECT_THROW(read_bus_log("/nonexistent_folder/bus.log"), Error); }

}  // namespace
}  // namespace rotorloop
