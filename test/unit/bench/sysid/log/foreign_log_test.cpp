// Flight logs of other programs as they are: rows above the names, names on two rows, units below them, UTF-16, decimal commas, attitude
// and position of two tables, Euler angles, clocks that wrap. The cases of the data folder are skipped without ROTORLOOP_DATA.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "bench/sysid/log/foreign_csv.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/sysid/log/log_files.hpp"

namespace rotorloop::log {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kDeg = std::numbers::pi / 180.0;

TEST(ForeignCsv, NamesStandUnderRowsOfAnotherWidthAndAreFoundByTheRowOfNumbers) {
  const CsvHead head =
      find_csv_head("\"Product\",\"Blackbox\"\n\"motor_poles\",\"14\"\n\"time\",\"gyroADC[0]\",\"motor[0]\"\n1,2,3\n", ',', {}, "x");
  EXPECT_THAT(head.names, ElementsAre("time", "gyroADC[0]", "motor[0]"));
  EXPECT_EQ(head.below.number, 3u);
  ASSERT_EQ(head.notes.size(), 1u);
  EXPECT_THAT(head.notes[0], HasSubstr("in line 3; 2 rows above passed over"));
}

TEST(ForeignCsv, NamesOnTwoRowsAreJoinedWhereTheLowerOnesRepeatAndUnitsBelowArePassedOver) {
  const CsvHead head = find_csv_head(
      "Trajectories\n100\n,,quad:quad,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,deg,deg,deg,mm,mm,mm\n1,0,0.1,0.2,0.3,1,2,3\n", ',', {},
      "x");
  EXPECT_THAT(head.names, ElementsAre("Frame", "Sub Frame", "RX", "RY", "RZ", "TX", "TY", "TZ"));
  EXPECT_EQ(head.below.number, 5u);
  const CsvHead motive = find_csv_head(",,Rotation,Rotation,Position,Position,Error\nFrame,Time,X,Y,X,Y,\n0,0.1,1,2,3,4,5\n", ',', {}, "x");
  EXPECT_THAT(motive.names, ElementsAre("Frame", "Time", "Rotation X", "Rotation Y", "Position X", "Position Y", "Error"));
}

// EuRoC's data sets, and many programs for plots, have the row of names as a comment.
TEST(ForeignCsv, NamesBehindAHashAreFoundByTheMappingOrByTheirWidth) {
  test::TempFolder folder;
  const std::string log = "# a rig, 2016\n#t,u [V], v\n0,12,1\n0.1,12.5,1\n";
  const auto r = read_csv(folder, log, csv_mapping(stream("battery", "[\"u [V]\"]", "V")));
  EXPECT_THAT(r.flight.battery_V.value, ElementsAre(12.0, 12.5));
  EXPECT_TRUE(r.noted("behind \"#\" in line 2"));
  EXPECT_THAT(find_csv_head(log, ',', {}, "x").names, ElementsAre("t", "u [V]", "v"));
  const CsvHead plain = find_csv_head("# t,u,v\nt,u,v\n0,1,2\n", ',', {"t", "u"}, "x");
  EXPECT_EQ(plain.below.number, 2u) << "a row of names goes before a comment that repeats it";
  EXPECT_TRUE(plain.notes.empty());
}

TEST(ForeignCsv, QuotedCellsMayHoldTheSeparatorAndACommaOfThousandsIsNoDecimalComma) {
  EXPECT_EQ(csv_number_with_comma("0,5", ';'), 0.5);
  EXPECT_EQ(csv_number_with_comma("-1,234", ';'), -1.234);
  EXPECT_EQ(csv_number_with_comma("1,25", ','), 1.25);
  EXPECT_FALSE(csv_number_with_comma("1,234", ',')) << "a thousand, or one: nobody knows";
  EXPECT_FALSE(csv_number_with_comma("1.234,5", ';'));
  EXPECT_FALSE(csv_number_with_comma("1,2,3", ';'));
  test::TempFolder folder;
  const auto r =
      read_csv(folder, "t,u,note\n\"0\",\"12\",\"a, b \"\"c\"\"\"\n1,\"12,5\",x\n", csv_mapping(stream("battery", "[\"u\"]", "V")));
  EXPECT_THAT(r.flight.battery_V.value, ElementsAre(12.0, 12.5));
}

TEST(ForeignCsv, UTF16OfEitherOrderIsReadAsUTF8) {
  for (const bool big : {false, true}) {
    std::string bytes = big ? "\xFE\xFF" : "\xFF\xFE";
    for (const char c : std::string("t,u\n0,12\n")) bytes += big ? std::string{'\0', c} : std::string{c, '\0'};
    EXPECT_EQ(as_utf8(bytes), "t,u\n0,12\n");
    test::TempFolder folder;
    EXPECT_THAT(read_csv(folder, bytes, csv_mapping(stream("battery", "[\"u\"]", "V"))).flight.battery_V.value, ElementsAre(12.0));
  }
  EXPECT_EQ(as_utf8(std::string("\xFF\xFE\xB5\0s\0", 6)), "\xC2\xB5s");
}

TEST(AttitudeStream, EulerAnglesTurnYawThenPitchThenRollFromNedAndFrd) {
  test::TempFolder folder;
  const auto r = read_csv(
      folder, "t,r,p,y\n0,0,0,90\n1,30,0,0\n2,0,20,0\n",
      csv_mapping(stream("attitude", "[\"r\", \"p\", \"y\"]", "deg", "euler = \"zyx\""), "axes.world = \"NED\"\naxes.body = \"FRD\"\n"));
  ASSERT_EQ(r.flight.attitude_WS.size(), 3u);
  const auto& q = r.flight.attitude_WS.value;
  const Eigen::Vector3d ahead = q[0] * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(ahead.y(), -1.0, 1e-12) << "heading east is to the right, y is left";
  const Eigen::Vector3d up = q[1] * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(up.y(), -std::sin(30.0 * kDeg), 1e-12) << "rolled to the right";
  EXPECT_NEAR((q[2] * Eigen::Vector3d::UnitX()).z(), std::sin(20.0 * kDeg), 1e-12) << "nose up";
}

// Vicon's "helical" angles: one turn about the vector, by its length.
TEST(AttitudeStream, ARotationVectorTurnsAboutItself) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,r,p,y\n0,0,0,0\n1,60,0,80\n",
                          csv_mapping(stream("attitude", "[\"r\", \"p\", \"y\"]", "deg", "euler = \"vector\"")));
  ASSERT_EQ(r.flight.attitude_WS.size(), 2u);
  EXPECT_EQ(r.flight.attitude_WS.value[0].w(), 1.0);
  EXPECT_NEAR(r.flight.attitude_WS.value[1].w(), std::cos(50.0 * kDeg), 1e-12);
  EXPECT_NEAR(r.flight.attitude_WS.value[1].z(), 0.8 * std::sin(50.0 * kDeg), 1e-12);
}

TEST(AttitudeStream, SignAndScaleOfAQuaternionsColumnsApply) {
  test::TempFolder folder;
  // A tilt of 30 degrees to the right about x, as 16-bit numbers of 32767 with x logged the other way.
  const auto r =
      read_csv(folder, "t,w,x,y,z\n0,31651,-8481,0,0\n",
               csv_mapping(stream("attitude", "[\"w\", \"x\", \"y\", \"z\"]", "1", "scale = 3.0518509e-5\nsign = [1, -1, 1, 1]")));
  ASSERT_EQ(r.flight.attitude_WS.size(), 1u);
  EXPECT_NEAR(2.0 * std::asin(r.flight.attitude_WS.value[0].x()), 30.0 * kDeg, 1e-4);
}

TEST(AttitudeStream, AxesWithYUpBecomeOursInPositionAttitudeAndVelocity) {
  test::TempFolder folder;
  // Motive: x ahead, y up, z to the right. The first vehicle is 1 m up and 2 m to the right, level, and turned to the left by 90 degrees
  // (about y); the second has its nose up by 90 degrees (about z).
  const auto r = read_csv(folder, "t,x,y,z,qw,qx,qy,qz\n0,0,1,2,0.70710678,0,0.70710678,0\n1,0,1,2,0.70710678,0,0,0.70710678\n",
                          csv_mapping(stream("pose", "[\"x\", \"y\", \"z\"]", "m", "quaternion = [\"qw\", \"qx\", \"qy\", \"qz\"]"),
                                      "axes.world = \"y_up\"\naxes.body = \"y_up\"\n"));
  ASSERT_EQ(r.flight.pose.size(), 2u);
  EXPECT_NEAR((r.flight.pose.value[0].p_W_m - Eigen::Vector3d(0.0, -2.0, 1.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((r.flight.pose.value[0].q_WS * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 0.0, 1e-7) << "nose to the left";
  EXPECT_NEAR((r.flight.pose.value[0].q_WS * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-7) << "level";
  EXPECT_NEAR((r.flight.pose.value[1].q_WS * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-7) << "nose up";
}

TEST(AttitudeStream, AttitudeAndPositionOfTwoTablesBecomePosesAtThePositionsStamps) {
  test::TempFolder folder;
  folder.write("log_att.csv", "t,w,x,y,z\n0,1,0,0,0\n0.1,0.996194698,0,0,0.0871557427\n0.2,0.984807753,0,0,0.173648178\n5,1,0,0,0\n");
  const std::string mapping =
      csv_mapping(stream("position", "[\"x\", \"y\", \"z\"]", "m") +
                  stream("attitude", "[\"w\", \"x\", \"y\", \"z\"]", "1", "from = \"att\"") + "[source.att]\nsuffix = \"_att.csv\"\n");
  const auto r = read_csv(folder, "t,x,y,z\n0.05,1,2,3\n0.15,1,2,3\n2,1,2,3\n", mapping);
  ASSERT_EQ(r.flight.pose.size(), 2u) << "between 0.2 and 5 s nobody knows the attitude";
  EXPECT_NEAR(2.0 * std::asin(r.flight.pose.value[0].q_WS.z()), 5.0 * kDeg, 1e-6);
  EXPECT_NEAR(2.0 * std::asin(r.flight.pose.value[1].q_WS.z()), 15.0 * kDeg, 1e-6);
  EXPECT_TRUE(r.flight.position_W_m.empty());
  EXPECT_TRUE(r.noted("pose: made of 3 positions and 4 attitudes"));
}

TEST(Clock, Of32BitsThatStartsAnewIsReadOnInAllTablesAndNoted) {
  test::TempFolder folder;
  folder.write("log_b.csv", "t,v\n5000,3.5\n15000,3.6\n");
  std::string mapping =
      csv_mapping(stream("battery", "[\"u\"]", "V") + stream("extra", "[\"v\"]", "V", "name = \"cell[V]\"\nfrom = \"b\"") +
                  "[source.b]\nsuffix = \"_b.csv\"\n");
  mapping.replace(mapping.find("unit = \"s\""), 10, "unit = \"us\"");
  const auto r = read_csv(folder, "t,u\n4294960000,12\n4294965000,12\n2704,12\n7704,12\n", mapping);
  const auto& t = r.flight.battery_V.t_s;
  ASSERT_EQ(t.size(), 4u);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(t[i] - t[i - 1], 0.005, 1e-9);
  EXPECT_NEAR(r.flight.extra.at("cell[V]").t_s[0] - t[2], 0.002296, 1e-9) << "a table that begins behind the wrap of the other";
  EXPECT_TRUE(r.noted("microseconds of 32 bits, starts anew 1 time"));
}

// One clock in four writings, each 20 samples of 5 ms with the end of the counter among them.
TEST(Clock, AWrapIsReadOnInSecondsSignedCountersAndShortOnesToo) {
  struct Case {
    const char* unit;
    double end, begin, per_s;  // the counter's, in ticks of the file
  };
  for (const Case& c : {Case{"s", 4294.967296, 0.0, 1.0}, Case{"us", 2147483648.0, -2147483648.0, 1e6}, Case{"ms", 65536.0, 0.0, 1e3},
                        Case{"ns", 4294967296.0, 0.0, 1e9}}) {
    test::TempFolder folder;
    std::string rows = "t,u\n";
    for (int i = 0; i < 20; ++i) {
      const double t = c.end + c.per_s * 0.005 * (i - 10.2);
      rows += fmt::format("{:.6f},12\n", t < c.end ? t : t - c.end + c.begin);
    }
    std::string mapping = csv_mapping(stream("battery", "[\"u\"]", "V"));
    mapping.replace(mapping.find("unit = \"s\""), 10, fmt::format("unit = \"{}\"", c.unit));
    const auto r = read_csv(folder, rows, mapping);
    const auto& t = r.flight.battery_V.t_s;
    ASSERT_EQ(t.size(), 20u);
    for (std::size_t i = 1; i < 20; ++i) EXPECT_NEAR(t[i] - t[i - 1], 0.005, 3e-6) << c.unit << " " << i;
    EXPECT_TRUE(r.noted("starts anew 1 time")) << c.unit;
  }
}

TEST(Clock, OneThatIsSetBackByAnythingElseStaysAsLogged) {
  test::TempFolder folder;
  const auto r =
      read_csv(folder, "t,u\n60.00,12\n60.01,12\n60.02,12\n0.01,12\n0.02,12\n0.03,12\n", csv_mapping(stream("battery", "[\"u\"]", "V")));
  EXPECT_EQ(r.flight.battery_V.t_s[3], 0.01);
  EXPECT_FALSE(r.noted("starts anew"));
}

// rosbag's exports have header.stamp.secs and header.stamp.nsecs beside each other.
TEST(Clock, SecondsAndNanosecondsOfTwoColumnsAreOneTime) {
  test::TempFolder folder;
  std::string mapping = csv_mapping(stream("battery", "[\"u\"]", "V"));
  mapping.replace(mapping.find("unit = \"s\""), 10, "unit = \"s\"\nnanoseconds = \"nsecs\"");
  const auto r = read_csv(folder, "t,nsecs,u\n1700000000,990000000,12\n1700000001,0,12\n1700000001,10000000,12\n", mapping);
  ASSERT_EQ(r.flight.battery_V.size(), 3u);
  EXPECT_NEAR(r.flight.battery_V.t_s[0], 1700000000.99, 1e-6);
  EXPECT_NEAR(r.flight.battery_V.t_s[2] - r.flight.battery_V.t_s[1], 0.01, 1e-6);
}

// Vicon's exports count frames, and their rate stands in the second row.
TEST(Clock, FramesOfAGivenRateAreATime) {
  test::TempFolder folder;
  std::string mapping = csv_mapping(stream("position", "[\"TX\", \"TY\", \"TZ\"]", "mm") +
                                    stream("attitude", "[\"RX\", \"RY\", \"RZ\"]", "rad", "euler = \"xyz\""));
  mapping.replace(mapping.find("column = \"t\"\nunit = \"s\""), 23, "column = \"Frame\"\nrate_Hz = 200");
  const auto r = read_csv(folder,
                          "Segments\n200\n,,quad:quad,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,rad,rad,rad,mm,mm,mm\n"
                          "1,0,0.1,0,0,1000,0,500\n2,0,0.1,0,0,1000,0,500\n3,0,0.1,0,0,1000,0,500\n",
                          mapping);
  ASSERT_EQ(r.flight.pose.size(), 3u);
  EXPECT_NEAR(r.flight.pose.t_s[2] - r.flight.pose.t_s[0], 0.01, 1e-12);
  EXPECT_NEAR(2.0 * std::asin(r.flight.pose.value[0].q_WS.x()), 0.1, 1e-9);
  EXPECT_NEAR(r.flight.pose.value[0].p_W_m.x(), 1.0, 1e-12);
  mapping.replace(mapping.find("rate_Hz = 200"), 13, "rate_Hz = 200\nunit = \"s\"");
  EXPECT_THROW((void)parse_log_mapping(mapping, "m.toml"), Error) << "two answers to one question";
}

class FieldLogs : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("ROTORLOOP_DATA") == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  }
  static ReadBack read(const char* file, const std::string& mapping) {
    const test::TempFolder folder;
    const LogMapping m = read_log_mapping(folder.write("m.toml", mapping));
    ReadBack out;
    out.flight = read_flight(std::filesystem::path(std::getenv("ROTORLOOP_DATA")) / "field" / file, &m, &out.notes);
    return out;
  }
};

TEST_F(FieldLogs, BlackboxExplorersExportIsReadUnderItsRowsOfSettings) {
  const auto r =
      read("F1_blackbox_explorer.csv",
           "format = 1\nname = \"blackbox\"\nlog = \"csv\"\naxes.body = \"FRD\"\n[time]\ncolumn = \"time\"\nunit = \"us\"\n" +
               stream("gyro", "[\"gyroADC[0]\", \"gyroADC[1]\", \"gyroADC[2]\"]", "deg/s") +
               stream("rotor_speed", "[\"eRPM[0]\", \"eRPM[1]\", \"eRPM[2]\", \"eRPM[3]\"]", "erpm", "pole_pairs = 7\nscale = 100"));
  ASSERT_EQ(r.flight.rotor_omega_rad_s.size(), 3u);
  EXPECT_NEAR(r.flight.rotor_omega_rad_s.value[0][0], 52000.0 / 7.0 * std::numbers::pi / 30.0, 1e-6);
  EXPECT_NEAR(r.flight.gyro_B_rad_s.t_s[1] - r.flight.gyro_B_rad_s.t_s[0], 1e-3, 1e-9);
}

TEST_F(FieldLogs, MotivesExportIsReadByNamesOfTwoRowsAndItsBlankFirstFrameIsLeftOut) {
  const auto r =
      read("F2_optitrack.csv", "format = 1\nname = \"motive\"\nlog = \"csv\"\n[time]\ncolumn = \"Time (Seconds)\"\nunit = \"s\"\n" +
                                   stream("pose", "[\"Position X\", \"Position Y\", \"Position Z\"]", "mm",
                                          "quaternion = [\"Rotation W\", \"Rotation X\", \"Rotation Y\", \"Rotation Z\"]"));
  ASSERT_GT(r.flight.pose.size(), 10u);
  EXPECT_NEAR(r.flight.pose.t_s[0], 0.008333, 1e-9);
  EXPECT_NEAR(r.flight.pose.value[0].p_W_m.y(), 1.0005, 1e-9);
  EXPECT_NEAR(r.flight.pose.value[0].q_WS.y(), 0.002083, 1e-6);
}

TEST_F(FieldLogs, ArduPilotsAttitudeIsReadAsEulerAngles) {
  const auto r = read(
      "F3_ardupilot_ATT.csv",
      "format = 1\nname = \"ATT\"\nlog = \"csv\"\naxes.world = \"NED\"\naxes.body = \"FRD\"\n[time]\ncolumn = \"TimeUS\"\nunit = \"us\"\n" +
          stream("attitude", "[\"Roll\", \"Pitch\", \"Yaw\"]", "deg", "euler = \"zyx\""));
  ASSERT_GT(r.flight.attitude_WS.size(), 10u);
  // Across north the angle jumps from 359° to 0°, the attitude turns by 1°.
  for (std::size_t i = 1; i < 10; ++i)
    EXPECT_LT(r.flight.attitude_WS.value[i].angularDistance(r.flight.attitude_WS.value[i - 1]), 1.5 * kDeg) << i;
}

TEST_F(FieldLogs, ShippedMappingsOfDefaultPX4LogsNameAttitudeAndLocalPosition) {
  const auto root = std::filesystem::path(std::getenv("ROTORLOOP_DATA")) / "field";
  EXPECT_EQ(read_log_mapping(root / "P1_px4_attitude.mapping.toml").streams[0].quantity, LogQuantity::attitude);
  EXPECT_NO_THROW((void)read_log_mapping(root / "P2_px4_lpos.mapping.toml"));
}

}  // namespace
}  // namespace rotorloop::log
