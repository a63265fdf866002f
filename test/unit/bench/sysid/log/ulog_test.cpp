// ULog: what the format says, on files built byte by byte here; PX4's axes; round trip; and that no damage crashes the reader.
#include "bench/sysid/log/ulog.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "bench/sysid/log/read_flight.hpp"
#include "bench/sysid/log/ulog_write.hpp"
#include "test/unit/bench/sysid/identify/flight_examples.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::log {
namespace {
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string little_endian(std::uint64_t v, std::size_t bytes) {
  std::string s;
  for (std::size_t i = 0; i < bytes; ++i) s += static_cast<char>(v >> (8 * i));
  return s;
}
std::string f32(float v) { return little_endian(std::bit_cast<std::uint32_t>(v), 4); }
std::string message(char type, const std::string& body) { return little_endian(body.size(), 2) + type + body; }
std::string format(const std::string& text) { return message('F', text); }
std::string subscription(int multi_id, int id, const std::string& name) {
  return message('A', little_endian(static_cast<std::uint64_t>(multi_id), 1) + little_endian(static_cast<std::uint64_t>(id), 2) + name);
}
std::string data(int id, const std::string& body) { return message('D', little_endian(static_cast<std::uint64_t>(id), 2) + body); }
std::string flags(std::uint64_t compat, std::uint64_t incompat, std::uint64_t appended_at = 0) {
  return message('B', little_endian(compat, 8) + little_endian(incompat, 8) + little_endian(appended_at, 8) + std::string(16, '\0'));
}
const std::string kHeader = std::string(kULogMagic) + '\1' + little_endian(0, 8);
const std::string kSync = message('S', std::string("\x2F\x73\x13\x20\x25\x0C\xBB\x12", 8));
const std::string kOne = format("one:uint64_t timestamp;float x;") + subscription(0, 5, "one");
std::string one(std::uint64_t t_us, float x) { return data(5, little_endian(t_us, 8) + f32(x)); }

ULog parse(const std::string& bytes) { return ULog::parse(bytes, "test.ulg"); }
std::vector<double> column(const ULog& log, const std::string& topic, const std::string& field, int multi_id = 0) {
  const ULogTopic* t = log.topic(topic, multi_id);
  if (!t) return {};
  return log.column(*t, field).value_or(std::vector<double>{});
}

TEST(ULog, ReadsEveryTypeLittleEndianAndSigned) {
  const std::string fields =
      "int8_t a;uint8_t b;int16_t c;uint16_t d;int32_t e;uint32_t f;int64_t g;uint64_t h;float i;double j;bool k;char l;";
  const std::string body = little_endian(7, 8) + "\xFE" + "\xFE" + little_endian(0xFFFE, 2) + little_endian(0xFFFE, 2) +
                           little_endian(0xFFFFFFFE, 4) + little_endian(0xFFFFFFFE, 4) + little_endian(~std::uint64_t{1}, 8) +
                           little_endian(1ull << 40, 8) + f32(-1.5f) + little_endian(std::bit_cast<std::uint64_t>(0.1), 8) + "\x01" + "A";
  const auto log = parse(kHeader + format("all:uint64_t timestamp;" + fields) + subscription(0, 1, "all") + data(1, body));
  const std::vector<std::pair<std::string, double>> expected{
      {"timestamp", 7}, {"a", -2},     {"b", 254},  {"c", -2},  {"d", 65534}, {"e", -2}, {"f", 4294967294.0},
      {"g", -2},        {"h", 0x1p40}, {"i", -1.5}, {"j", 0.1}, {"k", 1},     {"l", 65}};
  for (const auto& [field, value] : expected) EXPECT_THAT(column(log, "all", field), ElementsAre(value)) << field;
  EXPECT_TRUE(log.notes().empty());
}

TEST(ULog, FindsArraysNestedTypesAndTheirArraysByPath) {
  const auto log = parse(kHeader + format("esc_report:int32_t rpm;uint8_t state;uint8_t[3] _padding0;") +
                         format("esc_status:uint64_t timestamp;float[2] v;esc_report[3] esc;") + subscription(0, 1, "esc_status") +
                         data(1, little_endian(1, 8) + f32(1) + f32(2) + little_endian(100, 4) + "\x01___" + little_endian(200, 4) +
                                     "\x02___" + little_endian(300, 4) + "\x03___"));
  EXPECT_THAT(log.fields("esc_status"), ElementsAre("timestamp", "v[0]", "v[1]", "esc[0].rpm", "esc[0].state", "esc[1].rpm", "esc[1].state",
                                                    "esc[2].rpm", "esc[2].state"));
  EXPECT_THAT(column(log, "esc_status", "v[1]"), ElementsAre(2));
  EXPECT_THAT(column(log, "esc_status", "esc[2].rpm"), ElementsAre(300));
  EXPECT_THAT(column(log, "esc_status", "esc[1].state"), ElementsAre(2));
  for (const char* wrong :
       {"esc[3].rpm", "esc.rpm", "esc[1]", "v", "v[2]", "v[-1]", "v[", "v[0", "", ".", "esc[0].", "timestamp[0]", "timestamp.x"})
    EXPECT_FALSE(log.column(*log.topic("esc_status", 0), wrong)) << wrong;
}

TEST(ULog, PaddingAtTheEndOfAMessageNeedNotBeLogged) {
  const auto log =
      parse(kHeader + format("one:uint64_t timestamp;float x;uint8_t[4] _padding0;") + subscription(0, 5, "one") + one(1, 2.0f));
  EXPECT_THAT(column(log, "one", "x"), ElementsAre(2));
}

TEST(ULog, InstancesOfATopicAreKeptApart) {
  const auto log = parse(kHeader + kOne + subscription(1, 6, "one") + one(1, 10) + data(6, little_endian(2, 8) + f32(20)) + one(3, 11));
  EXPECT_THAT(column(log, "one", "x", 0), ElementsAre(10, 11));
  EXPECT_THAT(column(log, "one", "x", 1), ElementsAre(20));
}

TEST(ULog, LastMessageThatWasCutIsLeftOutAndNoted) {
  const std::string whole = kHeader + kOne + one(1, 10) + one(2, 20);
  for (std::size_t cut = 1; cut < one(2, 20).size(); ++cut) {
    const auto log = parse(whole.substr(0, whole.size() - cut));
    EXPECT_THAT(column(log, "one", "x"), ElementsAre(10)) << cut;
    EXPECT_THAT(log.notes(), Contains(HasSubstr("the message there is cut"))) << cut;
  }
}

TEST(ULog, AppendedDataAreReadFromTheirPlaceAfterAMessageThatWasCut) {
  const std::string cut = one(2, 20).substr(0, 9);
  const std::string before = kHeader + flags(0, 1, 0) + kOne + one(1, 10) + cut;
  const std::string file = kHeader + flags(0, 1, before.size()) + kOne + one(1, 10) + cut + one(3, 30);
  const auto log = parse(file);
  EXPECT_THAT(column(log, "one", "x"), ElementsAre(10, 30));
  EXPECT_THAT(log.notes(), Contains(HasSubstr("data before those appended end")));
}

TEST(ULog, ReadsOnAfterTheNextSynchronisationMarkWhenAMessageIsDamaged) {
  const std::string damaged = little_endian(60000, 2) + "D" + std::string(20, 'x');
  const auto log = parse(kHeader + kOne + one(1, 10) + damaged + kSync + one(3, 30));
  EXPECT_THAT(column(log, "one", "x"), ElementsAre(10, 30));
  EXPECT_THAT(log.notes(), Contains(HasSubstr("damaged bytes were skipped")));
}

TEST(ULog, UnknownMessagesAndUnknownCompatibleFlagsAreSkippedAndDropoutsCounted) {
  const auto log = parse(kHeader + flags(0xFF, 0) + message('?', "later") + kOne + data(99, "no one subscribed") + one(1, 10) +
                         message('O', little_endian(250, 2)) + message('I', std::string(1, 13) + "char[9] sys_x" + "rotorloop"));
  EXPECT_THAT(column(log, "one", "x"), ElementsAre(10));
  EXPECT_THAT(log.notes(), AllOf(Contains("1 messages of unknown type are left out"),
                                 Contains("1 data messages without a known subscription are left out"),
                                 Contains("the logger dropped out 1 times, 0.250 s in all")));
  EXPECT_EQ(log.info().at("sys_x"), "rotorloop");
}

TEST(ULog, WhatAReaderMustKnowAndThisOneDoesNotIsRefused) {
  const auto error = [](const std::string& bytes) { return test::error_of([&] { parse(bytes); }, ExitCode::data_quality); };
  EXPECT_THAT(error(kHeader + flags(0, 2) + kOne), HasSubstr("incompatible flags 0x02 in byte 0"));
  EXPECT_THAT(error(kHeader + flags(0, 1ull << 16) + kOne), HasSubstr("incompatible flags 0x01 in byte 2"));
  EXPECT_THAT(error("ULog"), HasSubstr("does not begin with its magic bytes"));
  EXPECT_THAT(error(""), HasSubstr("does not begin with its magic bytes"));
  EXPECT_THAT(error(kHeader.substr(0, 12)), HasSubstr("ends within the header"));
  EXPECT_THAT(error(std::string(kULogMagic) + '\7' + little_endian(0, 8)), HasSubstr("has ULog version 7"));
}

TEST(ULog, DefinitionsThatCannotBeAreLeftOutAndNoted) {
  for (const char* text :
       {"", "x", ":uint8_t a;", "x:", "x:uint8_t;", "x:uint8_t ;", "x:uint8_t[] a;", "x:uint8_t[0] a;", "x:uint8_t[70000] a;",
        "x:uint8_t[2 a;", "x:[2] a;", "x:uint8_t[2]2 a;", "x:uint8_t a;uint8_t a;", "x:uint8_t a[1];", "x:uint8_t a.b;"})
    EXPECT_THAT(parse(kHeader + format(text) + kOne + one(1, 1)).notes(), Contains(HasSubstr("definitions that cannot be read"))) << text;
}

TEST(ULog, TypesThatHoldThemselvesOrAreLargerThanAnyMessageCannotBeSubscribedTo) {
  const std::string loop = format("a:b x;") + format("b:a[65535] y;") + subscription(0, 1, "a");
  EXPECT_TRUE(parse(kHeader + loop + data(1, "0123")).topics().empty());
  std::string tower = format("t0:uint8_t[1000] x;");
  for (int i = 1; i < 40; ++i) tower += format("t" + std::to_string(i) + ":t" + std::to_string(i - 1) + "[1000] x;");
  for (int i = 0; i < 40; ++i) tower += subscription(0, i, "t" + std::to_string(i));
  EXPECT_EQ(parse(kHeader + tower).topics().size(), 1u);
  EXPECT_EQ(parse(kHeader + tower).fields("t0").size(), 1000u);
  EXPECT_TRUE(parse(kHeader + tower).fields("t1").empty());
}

// --- as a flight ------------------------------------------------------------------------------------------------------------------

LogMapping px4() { return read_log_mapping(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/measured/px4_ulog.mapping.toml"); }

TEST(ULogFlight, Px4TopicsComeInOurAxesUnitsAndRotorOrder) {
  test::TempFolder folder;
  const std::string file = kHeader +
                           format(
                               "vehicle_odometry:uint64_t timestamp;uint64_t timestamp_sample;float[3] position;float[4] q;float[3] "
                               "velocity;uint8_t velocity_frame;") +
                           format("sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;") +
                           format("esc_report:int32_t esc_rpm;") + format("esc_status:uint64_t timestamp;esc_report[8] esc;") +
                           format("battery_status:uint64_t timestamp;float voltage_v;") + subscription(0, 0, "vehicle_odometry") +
                           subscription(0, 1, "sensor_combined") + subscription(0, 2, "esc_status") + subscription(0, 3, "battery_status") +
                           data(0, little_endian(1'010'000, 8) + little_endian(1'000'000, 8) + f32(1) + f32(2) + f32(-3) + f32(1) + f32(0) +
                                       f32(0) + f32(0) + f32(0.5f) + f32(0.25f) + f32(-1) + "\x01") +
                           data(1, little_endian(1'000'500, 8) + f32(0.125f) + f32(0.25f) + f32(0.5f) + f32(0) + f32(0) + f32(-9.75f)) +
                           data(2, little_endian(1'001'000, 8) + little_endian(3000, 4) + little_endian(6000, 4) + little_endian(9000, 4) +
                                       little_endian(12000, 4) + std::string(16, '\0')) +
                           data(3, little_endian(1'002'000, 8) + f32(15.5f));
  const LogMapping mapping = px4();
  const auto f = read_flight(folder.write("x.ulg", file), &mapping);
  ASSERT_EQ(f.pose.size(), 1u);
  EXPECT_EQ(f.pose.t_s[0], 1.0);  // when it was measured, not when it was published
  EXPECT_EQ(f.pose.value[0].p_W_m, Eigen::Vector3d(1, -2, 3));
  EXPECT_NEAR(std::abs(f.pose.value[0].q_WS.w()), 1.0, 1e-15);
  EXPECT_EQ(f.velocity_W_m_s.value.at(0), Eigen::Vector3d(0.5, -0.25, 1));
  EXPECT_EQ(f.gyro_B_rad_s.value.at(0), Eigen::Vector3d(0.125, -0.25, -0.5));
  EXPECT_EQ(f.accel_B_m_s2.value.at(0), Eigen::Vector3d(0, 0, 9.75));
  EXPECT_NEAR(f.rotor_omega_rad_s.value.at(0)[0], 314.159265, 1e-6);
  EXPECT_NEAR(f.rotor_omega_rad_s.value[0][3], 1256.637061, 1e-6);
  EXPECT_EQ(f.battery_V.value.at(0), 15.5);
}

TEST(ULogFlight, RoundTripKeepsMicrosecondsAndSinglePrecision) {
  test::TempFolder folder;
  const FlightRecord a = identify::flight_example();
  const LogMapping mapping = px4();
  std::vector<LogFinding> notes;
  const FlightRecord b = read_flight(folder.write("flight_a.ulg", ulog_bytes(a)), &mapping, &notes);
  identify::expect_same_flight(a, b, 0.51e-6, 1.2e-7);
  // This flight has neither beside its pose.
  for (const auto& n : notes) EXPECT_TRUE(n.stream == "position" || n.stream == "attitude") << n.what;
}

TEST(ULogFlight, FlightThatBeginsBeforeZeroKeepsItsTimes) {
  test::TempFolder folder;
  FlightRecord a;
  a.battery_V.add(-2.5, 16);
  a.battery_V.add(1.5, 15);
  a.extra["x[m]"].add(-0.25, 3);
  const LogMapping mapping = px4();
  const FlightRecord b = read_flight(folder.write("early.ulg", ulog_bytes(a)), &mapping);
  identify::expect_same_flight(a, b, 1e-12, 0.0);
}

TEST(ULogFlight, PositionWithoutAttitudeReadsBackAsPosition) {
  test::TempFolder folder;
  FlightRecord a;
  a.position_W_m.add(0.5, {1, 2, 3});
  const LogMapping mapping = px4();
  const FlightRecord b = read_flight(folder.write("p.ulg", ulog_bytes(a)), &mapping);
  EXPECT_TRUE(b.pose.empty());
  EXPECT_EQ(b.position_W_m.value, a.position_W_m.value);
}

TEST(ULogFlight, StampsThatCannotBeWrittenAndTooManyExtrasAreRefused) {
  FlightRecord late;
  late.battery_V.add(1e11, 16);
  EXPECT_THAT(test::error_of([&] { (void)ulog_bytes(late); }, ExitCode::data_quality), HasSubstr("100000000000 s"));
  FlightRecord odd;
  odd.battery_V.add(std::nan(""), 16);
  EXPECT_THAT(test::error_of([&] { (void)ulog_bytes(odd); }, ExitCode::data_quality), HasSubstr("a stamp of nan s"));
  FlightRecord many;
  for (int i = 0; i < 257; ++i) many.extra["x" + std::to_string(i) + "[m]"].add(0, 0);
  EXPECT_THAT(test::error_of([&] { (void)ulog_bytes(many); }, ExitCode::data_quality), HasSubstr("at most 256"));
}

TEST(ULogFlight, TopicWithoutTheFieldIsNamedWithWhatItHas) {
  test::TempFolder folder;
  const auto path = folder.write("x.ulg", kHeader + kOne + one(1, 2));
  const std::string head =
      "format = 1\nname = \"x\"\nlog = \"ulog\"\n[source.s]\ntopic = \"one\"\n[source.gone]\ntopic = \"two\"\nmulti_id = 1\n";
  const auto error = [&](const std::string& from, const std::string& field) {
    const LogMapping m = parse_log_mapping(
        head + "[[stream]]\nquantity = \"battery\"\nfrom = \"" + from + "\"\ncolumns = [\"" + field + "\"]\nunit = \"V\"\n", "m.toml");
    return test::error_of([&] { (void)read_flight(path, &m); });
  };
  EXPECT_THAT(error("s", "voltage_v"), AllOf(HasSubstr("m.toml:9"), HasSubstr("no column voltage_v (battery) in topic one 0 of x.ulg"),
                                             HasSubstr("it has: timestamp, x")));
  EXPECT_THAT(error("gone", "x"), HasSubstr("topic two 1, which is not there"));
  EXPECT_THAT(test::error_of([&] { (void)read_flight(path, nullptr); }),
              AllOf(HasSubstr("topics one"), HasSubstr("px4_ulog.mapping.toml")));
  const LogMapping csv = parse_log_mapping(
      "format = 1\nname = \"x\"\nlog = \"csv\"\n[time]\ncolumn = \"t\"\nunit = \"s\"\n[[stream]]\nquantity = \"battery\"\ncolumns = "
      "[\"u\"]\nunit = \"V\"\n",
      "c.toml");
  EXPECT_THAT(test::error_of([&] { (void)read_flight(path, &csv); }), HasSubstr("is ULog, and c.toml maps CSV"));
}

// --- damage -----------------------------------------------------------------------------------------------------------------------

// Reads whatever the bytes still are; an Error is a fine answer, a crash or a large allocation is not.
void survive(const std::string& bytes, const LogMapping& mapping, const test::TempFolder& folder) {
  try {
    const ULog log = parse(bytes);
    for (const auto& t : log.topics())
      for (const auto& field : log.fields(t.name)) {
        const auto values = log.column(t, field);
        ASSERT_TRUE(values);
        ASSERT_EQ(values->size(), t.messages.size());
        ASSERT_LE(values->size() * 5, bytes.size());
      }
    (void)read_flight(folder.write("damaged.ulg", bytes), &mapping);
  } catch (const Error&) {
  }
}

TEST(ULogDamage, NoTruncationAndNoFlippedBitCrashesTheReader) {
  test::TempFolder folder;
  FlightRecord flight = identify::flight_example();
  const std::string good = ulog_bytes(flight).substr(0, 2600);  // all definitions and subscriptions, and some data
  const LogMapping mapping = px4();
  for (std::size_t n = 0; n < good.size(); n += 7) survive(good.substr(0, n), mapping, folder);
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ (1 << (at % 8)));
    survive(bad, mapping, folder);
  }
}

TEST(ULogDamage, NoRandomBytesCrashTheReader) {
  test::TempFolder folder;
  const LogMapping mapping = px4();
  const std::string good = ulog_bytes(identify::flight_example()).substr(0, 4000);
  const RandomStream random(11, 2);
  std::uint64_t k = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::string bad = good;
    for (std::uint64_t i = 0, n = 1 + random.bits(k++) % 40; i < n; ++i) {
      const std::size_t at = 8 + random.bits(k++) % (bad.size() - 8);
      bad[at] = static_cast<char>(random.bits(k++));
    }
    survive(bad, mapping, folder);
  }
}

// A reader that shares no line with ours: ulog_reader.py beside this file, from the format's description.
TEST(ULogIndependent, AnotherReaderFindsTheSameTopicsCountsAndValues) {
  if (std::system("python3 -c pass >/dev/null 2>&1") != 0) GTEST_SKIP() << "no python3: ULog not read by the independent reader";
  test::TempFolder folder;
  const FlightRecord f = identify::flight_example();
  const auto path = folder.write("flight.ulg", ulog_bytes(f));
  const std::string script = std::string(ROTORLOOP_SOURCE_DIR) + "/test/unit/bench/sysid/log/ulog_reader.py";
  const std::string out = (folder.path() / "out.txt").string();
  ASSERT_EQ(std::system(("python3 '" + script + "' '" + path.string() + "' > '" + out + "'").c_str()), 0);
  const std::string text = test::read_text(out);
  EXPECT_THAT(text, HasSubstr("flags compat 0 incompat 0 appended 0 0 0\n"));
  EXPECT_THAT(text, HasSubstr("vehicle_visual_odometry 0: 8\n"));
  EXPECT_THAT(text, HasSubstr("sensor_combined 0: 40\n"));
  EXPECT_THAT(text, HasSubstr("esc_status 0: 40\n"));
  EXPECT_THAT(text, HasSubstr("rotorloop_extra 1: 1\n"));
  EXPECT_THAT(text, HasSubstr("info rotorloop_extra_1 payload_z[m]\n"));
  EXPECT_THAT(text, HasSubstr("last rotorloop_extra 1 value 0.3333333333333333\n"));
  char line[80];
  std::snprintf(line, sizeof line, "last battery_status 0 voltage_v %.6f",
                static_cast<double>(static_cast<float>(f.battery_V.value.back())));
  EXPECT_THAT(text, HasSubstr(std::string(line).substr(0, 36)));
}

}  // namespace
}  // namespace rotorloop::log
