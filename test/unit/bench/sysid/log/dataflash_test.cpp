// DataFlash: what the format says, on files built byte by byte here; instances, units, old clocks; and that no damage crashes the reader.
#include "bench/sysid/log/dataflash.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/base/random.hpp"
#include "test/unit/bench/sysid/log/log_files.hpp"

namespace rotorloop::log {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string le(std::uint64_t v, std::size_t bytes) {
  std::string s;
  for (std::size_t i = 0; i < bytes; ++i) s += static_cast<char>(v >> (8 * i));
  return s;
}
std::string flt(double v) { return le(std::bit_cast<std::uint32_t>(static_cast<float>(v)), 4); }
std::string padded(std::string s, std::size_t bytes) { return s.append(bytes - s.size(), '\0'); }
std::string msg(int type, const std::string& body) { return "\xA3\x95" + le(static_cast<std::uint64_t>(type), 1) + body; }
std::string fmt_of(int type, std::size_t length, const std::string& name, const std::string& types, const std::string& labels) {
  return msg(128, le(static_cast<std::uint64_t>(type), 1) + le(length, 1) + padded(name, 4) + padded(types, 16) + padded(labels, 64));
}
const std::string kFmt = fmt_of(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
// The units of the field names, as the autopilot writes them before its first data.
std::string units_head() {
  std::string s = fmt_of(1, 76, "UNIT", "QbZ", "TimeUS,Id,Label") + fmt_of(2, 20, "MULT", "Qbd", "TimeUS,Id,Mult") +
                  fmt_of(3, 44, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds");
  for (const auto& [id, unit] : {std::pair{'s', "s"}, {'q', "rpm"}, {'a', "Ah"}, {'O', "degC"}, {'#', "instance"}})
    s += msg(1, le(0, 8) + id + padded(unit, 64));
  for (const auto& [id, factor] : {std::pair{'F', 1e-6}, {'0', 1.0}, {'B', 1e-2}, {'C', 1e-3}, {'-', 0.0}})
    s += msg(2, le(0, 8) + id + le(std::bit_cast<std::uint64_t>(factor), 8));
  return s;
}
std::string fmtu(int type, const std::string& units, const std::string& factors) {
  return msg(3, le(0, 8) + le(static_cast<std::uint64_t>(type), 1) + padded(units, 16) + padded(factors, 16));
}
const std::string kEsc = fmt_of(60, 22, "ESC", "QBffc", "TimeUS,Instance,RPM,CTot,Temp") + fmtu(60, "s#qaO", "F-0CB");
std::string esc(std::uint64_t t_us, int instance, double rpm) {
  return msg(60, le(t_us, 8) + le(static_cast<std::uint64_t>(instance), 1) + flt(rpm) + flt(12) + le(2500, 2));
}
const std::string kOne = fmt_of(7, 15, "ONE", "Qf", "TimeUS,X");
std::string one(std::uint64_t t_us, double x) { return msg(7, le(t_us, 8) + flt(x)); }

DataFlash parse(const std::string& bytes) { return DataFlash::parse(bytes, "test.bin"); }
std::vector<double> column(const DataFlash& log, const std::string& name, const std::string& field, int instance = 0) {
  const auto t = log.table(name, instance, {field});
  return t && t->has(field) ? t->columns.at(field) : std::vector<double>{};
}

TEST(DataFlash, ReadsEveryTypeLittleEndianSignedAndInHundredths) {
  const std::string types = "bBhHiIfdcCeELqQM";
  const std::string body = "\xFE\xFE" + le(0xFFFE, 2) + le(0xFFFE, 2) + le(0xFFFFFFFE, 4) + le(0xFFFFFFFE, 4) + flt(-1.5) +
                           le(std::bit_cast<std::uint64_t>(0.1), 8) + le(0xFFFF - 149, 2) + le(65000, 2) + le(0xFFFFFFFF - 149, 4) +
                           le(4000000000, 4) + le(static_cast<std::uint32_t>(-351332423), 4) + le(~std::uint64_t{1}, 8) +
                           le(1ull << 40, 8) + "\x05";
  const auto log = parse(kFmt + fmt_of(9, 3 + body.size(), "ALL", types, "a,b,c,d,e,f,g,h,i,j,k,l,m,n,o,p") + msg(9, body));
  const std::vector<std::pair<std::string, double>> expected{
      {"a", -2},   {"b", 254},   {"c", -2},   {"d", 65534},      {"e", -2},          {"f", 4294967294.0}, {"g", -1.5},   {"h", 0.1},
      {"i", -1.5}, {"j", 650.0}, {"k", -1.5}, {"l", 40000000.0}, {"m", -35.1332423}, {"n", -2},           {"o", 0x1p40}, {"p", 5}};
  for (const auto& [field, value] : expected) EXPECT_THAT(column(log, "ALL", field), ElementsAre(value)) << field;
  EXPECT_THAT(log.notes(), IsEmpty());
}

TEST(DataFlash, HalfFloatsAreReadFromTheSmallestToInfinity) {
  std::string bytes = kFmt + fmt_of(9, 5, "HALF", "g", "x");
  for (const int h : {0x3C00, 0xC500, 0x0001, 0x7BFF, 0x7C00}) bytes += msg(9, le(static_cast<std::uint64_t>(h), 2));
  EXPECT_THAT(column(parse(bytes), "HALF", "x"), ElementsAre(1.0, -5.0, 0x1p-24, 65504.0, std::numeric_limits<double>::infinity()));
}

TEST(DataFlash, SaysUnitsByItsOwnTablesAndLeavesOutTheFactorThatTheLetterCarries) {
  const auto log = parse(kFmt + units_head() + kEsc + esc(1000, 0, 5000));
  const auto& m = *std::find_if(log.messages().begin(), log.messages().end(), [](const auto& x) { return x.name == "ESC"; });
  ASSERT_EQ(m.fields.size(), 5u);
  EXPECT_EQ(m.fields[0].unit, "1e-06 s");
  EXPECT_EQ(m.fields[2].unit, "rpm");
  EXPECT_EQ(m.fields[3].unit, "0.001 Ah");
  EXPECT_EQ(m.fields[4].unit, "degC");
  EXPECT_EQ(m.instance, 1u);
  EXPECT_THAT(column(log, "ESC", "Temp"), ElementsAre(25.0));
}

TEST(DataFlash, InstancesAreTablesOfTheirOwnOrOneRoundARow) {
  std::string bytes = kFmt + units_head() + kEsc;
  for (std::uint64_t i = 0; i < 3; ++i)
    for (int k = 0; k < 4; ++k)
      if (!(i == 1 && k == 2)) bytes += esc(10000 * i + 20 * static_cast<std::uint64_t>(k), k, 1000.0 * (k + 1) + static_cast<double>(i));
  const auto log = parse(bytes);
  EXPECT_THAT(column(log, "ESC", "RPM", 2), ElementsAre(3000.0, 3002.0));
  EXPECT_FALSE(log.table("ESC", 4, {"RPM"})) << "no fifth motor";
  const auto rounds = log.table("ESC", 0, {"TimeUS", "RPM[0]", "RPM[2]", "RPM[3]"});
  ASSERT_TRUE(rounds);
  EXPECT_THAT(rounds->columns.at("TimeUS"), ElementsAre(0.0, 10000.0, 20000.0));
  EXPECT_THAT(rounds->columns.at("RPM[0]"), ElementsAre(1000.0, 1001.0, 1002.0));
  EXPECT_THAT(rounds->columns.at("RPM[2]"), ElementsAre(3000.0, ::testing::IsNan(), 3002.0));
  EXPECT_THAT(rounds->columns.at("RPM[3]"), ElementsAre(4000.0, 4001.0, 4002.0));
}

TEST(DataFlash, NumberedMessagesOfOldLogsAreInstances) {
  std::string bytes = kFmt;
  for (int k = 1; k <= 4; ++k) bytes += fmt_of(60 + k, 13, "ESC" + std::to_string(k), "Qh", "TimeUS,RPM");
  for (std::uint64_t k = 1; k <= 4; ++k) bytes += msg(60 + static_cast<int>(k), le(5000 + k, 8) + le(100 * k, 2));
  const auto t = parse(bytes).table("ESC", 0, {"RPM[1]", "RPM[3]"});
  ASSERT_TRUE(t);
  EXPECT_THAT(t->columns.at("RPM[1]"), ElementsAre(200.0));
  EXPECT_THAT(t->columns.at("RPM[3]"), ElementsAre(400.0));
}

TEST(DataFlash, MillisecondsOfOldLogsBecomeMicroseconds) {
  const auto log = parse(kFmt + fmt_of(7, 11, "OLD", "If", "TimeMS,X") + msg(7, le(12345, 4) + flt(1)));
  EXPECT_THAT(column(log, "OLD", "TimeUS"), ElementsAre(12345000.0));
}

TEST(DataFlash, LatitudesBecomeMetresOfTheEllipsoidAndNoFixIsNoReading) {
  std::string bytes = kFmt + fmt_of(7, 19, "POS", "QLL", "TimeUS,Lat,Lng") + msg(7, le(0, 8) + le(0, 4) + le(0, 4));
  for (const auto& [lat, lng] : {std::pair{450000000, 80000000}, {450010000, 80000000}, {450000000, 80010000}})
    bytes += msg(7, le(0, 8) + le(static_cast<std::uint32_t>(lat), 4) + le(static_cast<std::uint32_t>(lng), 4));
  const auto t = parse(bytes).table("POS", 0, {"Lat[m]", "Lng[m]"});
  ASSERT_TRUE(t);
  const auto& north = t->columns.at("Lat[m]");
  const auto& east = t->columns.at("Lng[m]");
  EXPECT_TRUE(std::isnan(north[0]));
  EXPECT_EQ(north[1], 0.0);
  EXPECT_NEAR(north[2], 111.132, 0.001) << "a degree of latitude at 45 degrees is 111.132 km";
  EXPECT_NEAR(east[3], 78.847, 0.001) << "and one of longitude 78.847 km";
}

TEST(DataFlash, ACutTailIsNotedAndBlankFlashBehindTheDataIsNot) {
  const std::string whole = kFmt + kOne + one(1, 1) + one(2, 2);
  const auto cut = parse(whole.substr(0, whole.size() - 5));
  EXPECT_THAT(column(cut, "ONE", "X"), ElementsAre(1.0));
  EXPECT_THAT(cut.notes(), ElementsAre(HasSubstr("the message ONE there is cut (10 of 15 bytes)")));
  EXPECT_THAT(parse(whole + std::string(200, '\xFF')).notes(), IsEmpty());
}

TEST(DataFlash, DamageInTheMiddleCostsTheMessagesThatItHitsAndIsCounted) {
  const std::string head = kFmt + kOne;
  const auto log = parse(head + one(1, 1) + "\xA3\x95" + "garbage" + one(2, 2) + msg(99, "unknown") + one(3, 3));
  EXPECT_THAT(column(log, "ONE", "X"), ElementsAre(1.0, 2.0, 3.0));
  EXPECT_THAT(log.notes(), Contains(HasSubstr("of a type that the log does not describe")));
  std::string bad = head + one(1, 1) + one(2, 2) + one(3, 3) + one(4, 4);
  bad[head.size() + 15] = 0;  // the head of the second
  const auto hit = parse(bad);
  EXPECT_THAT(column(hit, "ONE", "X"), ElementsAre(1.0, 3.0, 4.0));
  EXPECT_THAT(hit.notes(), ElementsAre("15 damaged bytes were skipped, up to the next message"));
}

TEST(DataFlash, WhatDescribesNoMessageIsRefusedWithTheNumberOfBytes) {
  for (const std::string& bytes : {std::string(), std::string("\xA3\x95"), kFmt, kFmt + kOne})
    EXPECT_THAT(test::error_of([&] { (void)parse(bytes); }, ExitCode::data_quality), HasSubstr("holds no message of a DataFlash log in"));
  EXPECT_THAT(parse(kFmt + kOne + fmt_of(8, 200, "LIE", "Qf", "TimeUS,X") + one(1, 1)).notes(), ElementsAre(HasSubstr("cannot be read")));
}

TEST(DataFlash, NoDamageOfBytesCrashesTheReaderOrGrowsItsMemory) {
  std::string good = kFmt + units_head() + kEsc + kOne;
  for (std::uint64_t i = 0; i < 20; ++i) good += esc(100 * i, static_cast<int>(i % 4), 5000) + one(100 * i, 1);
  std::uint64_t k = 0;
  const RandomStream stream(12, 2);
  const auto random = [&] { return stream.bits(k++); };
  for (int round = 0; round < 400; ++round) {
    std::string bad = good.substr(0, random() % good.size());
    for (std::uint64_t i = 0, n = random() % 30; i < n && !bad.empty(); ++i) bad[random() % bad.size()] = static_cast<char>(random());
    try {
      const auto log = parse(bad);
      for (const auto& m : log.messages()) (void)log.table(m.name, 0, {"TimeUS", "RPM[0]", "X", "Lat[m]"});
    } catch (const Error&) {
    }
  }
}

TEST(DataFlashFlight, ThroughTheShippedMappingIsInOurAxesUnitsAndOrder) {
  std::string bytes = kFmt + units_head() + kEsc;
  bytes += fmt_of(20, 46, "XKF1", "QBccCfffffff", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD");
  bytes += fmtu(20, "s#dddnnnnmmm", "F-BBB0000000") + fmt_of(21, 36, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ");
  bytes += fmtu(21, "s#EEEooo", "F-000000") + fmt_of(22, 19, "RCOU", "QHHHH", "TimeUS,C1,C2,C3,C4");
  for (std::uint64_t i = 0; i < 5; ++i) {
    const std::uint64_t t = 5000000 + 100000 * i + (i % 2);  // 10 Hz, and not to the microsecond
    for (int core = 0; core < 2; ++core)
      bytes += msg(20, le(t, 8) + le(static_cast<std::uint64_t>(core), 1) + le(1000, 2) + le(0, 2) + le(9000, 2) + flt(1) + flt(2) +
                           flt(-3) + flt(0) + flt(10 + core) + flt(20) + flt(-30));
    bytes += msg(21, le(t, 8) + le(0, 1) + flt(0.1) + flt(0.2) + flt(0.3) + flt(0) + flt(0) + flt(-9.8));
    bytes += msg(22, le(t, 8) + le(1000, 2) + le(1250, 2) + le(1500, 2) + le(2000, 2));
    for (int k = 0; k < 4; ++k) bytes += esc(t + 10 * static_cast<std::uint64_t>(k), k, 6000 + 60 * k);
  }
  const test::TempFolder folder;
  const LogMapping m = read_log_mapping(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/measured/ardupilot_bin.mapping.toml");
  ReadBack r;
  r.flight = read_flight(folder.write("00000012.BIN", bytes), &m, &r.notes);
  ASSERT_EQ(r.flight.pose.size(), 5u) << "attitude and position of one message, 0.1 s apart";
  EXPECT_TRUE(r.flight.pose.value[0].p_W_m.isApprox(Eigen::Vector3d(10, -20, 30)));
  EXPECT_NEAR((r.flight.pose.value[0].q_WS * Eigen::Vector3d::UnitX()).y(), -1.0, 1e-6) << "heading east is to the right";
  EXPECT_TRUE(r.flight.velocity_W_m_s.value[0].isApprox(Eigen::Vector3d(1, -2, 3)));
  EXPECT_TRUE(r.flight.gyro_B_rad_s.value[0].isApprox(Eigen::Vector3d(0.1, -0.2, -0.3), 1e-6));
  EXPECT_NEAR(r.flight.accel_B_m_s2.value[0].z(), 9.8, 1e-6);
  ASSERT_EQ(r.flight.rotor_omega_rad_s.size(), 5u);
  EXPECT_NEAR(r.flight.rotor_omega_rad_s.value[0][3], 6180.0 * std::numbers::pi / 30.0, 1e-3);
  EXPECT_NEAR(r.flight.rotor_omega_rad_s.t_s[1] - r.flight.rotor_omega_rad_s.t_s[0], 0.1, 2e-6);
  EXPECT_THAT(r.flight.motor_command.value[0], ElementsAre(0.0, 0.25, 0.5, 1.0));
}

TEST(DataFlashFlight, WithoutAMappingTheErrorListsItsMessagesAndTheMappingToTake) {
  const test::TempFolder folder;
  const auto path = folder.write("00000012.BIN", kFmt + units_head() + kEsc + esc(1, 0, 1) + esc(2, 3, 1) + kOne + one(1, 1));
  const std::string said = test::error_of([&] { (void)read_flight(path, nullptr); });
  EXPECT_THAT(said, HasSubstr("ONE, ESC"));
  EXPECT_THAT(said, HasSubstr("ardupilot_bin.mapping.toml is that of ArduPilot"));
}

}  // namespace
}  // namespace rotorloop::log
