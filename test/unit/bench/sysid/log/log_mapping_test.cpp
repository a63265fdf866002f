// Mapping files: each conversion on a log small enough to check by eye, and what a wrong mapping is told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "test/unit/bench/sysid/log/log_files.hpp"

namespace rotorloop::log {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;
const std::string kXyz = "[\"x\", \"y\", \"z\"]";
const std::string kQuaternion = "quaternion = [\"qw\", \"qx\", \"qy\", \"qz\"]\n";
const std::string kRotors = "[\"a\", \"b\", \"c\", \"d\"]";

void expect_near(const Eigen::Vector3d& actual, double x, double y, double z) {
  EXPECT_NEAR(actual.x(), x, 1e-12);
  EXPECT_NEAR(actual.y(), y, 1e-12);
  EXPECT_NEAR(actual.z(), z, 1e-12);
}

struct UnitCase {
  std::string quantity, unit;
  double logged, si;
};
class VectorUnits : public ::testing::TestWithParam<UnitCase> {};
TEST_P(VectorUnits, BecomeSi) {
  const auto& c = GetParam();
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,x,y,z\n1.5,0,0," + std::to_string(c.logged) + "\n", csv_mapping(stream(c.quantity, kXyz, c.unit)));
  const auto& s = c.quantity == "position"   ? r.flight.position_W_m
                  : c.quantity == "velocity" ? r.flight.velocity_W_m_s
                  : c.quantity == "gyro"     ? r.flight.gyro_B_rad_s
                                             : r.flight.accel_B_m_s2;
  ASSERT_EQ(s.size(), 1u);
  EXPECT_EQ(s.t_s[0], 1.5);
  expect_near(s.value[0], 0, 0, c.si);
}
INSTANTIATE_TEST_SUITE_P(LogMapping, VectorUnits,
                         ::testing::Values(UnitCase{"position", "m", 2, 2}, UnitCase{"position", "mm", 1500, 1.5},
                                           UnitCase{"position", "cm", 150, 1.5}, UnitCase{"velocity", "mm/s", 250, 0.25},
                                           UnitCase{"gyro", "deg/s", 180, kPi}, UnitCase{"gyro", "mrad/s", 500, 0.5},
                                           UnitCase{"accel", "g", 1, 9.80665}, UnitCase{"accel", "mg", 1000, 9.80665},
                                           UnitCase{"accel", "m/s2", 9.8, 9.8}));

class TimeUnits : public ::testing::TestWithParam<std::pair<std::string, double>> {};
TEST_P(TimeUnits, BecomeSeconds) {
  test::TempFolder folder;
  std::string mapping = csv_mapping(stream("battery", "[\"u\"]", "V"));
  mapping.replace(mapping.find("unit = \"s\""), 10, "unit = \"" + GetParam().first + "\"");
  const auto r = read_csv(folder, "t,u\n2000,12\n", mapping);
  EXPECT_NEAR(r.flight.battery_V.t_s.at(0), GetParam().second, 1e-15);
}
INSTANTIATE_TEST_SUITE_P(LogMapping, TimeUnits,
                         ::testing::Values(std::pair{"s", 2000.0}, std::pair{"ms", 2.0}, std::pair{"us", 2e-3}, std::pair{"ns", 2e-6}));

class BatteryUnits : public ::testing::TestWithParam<std::pair<std::string, double>> {};
TEST_P(BatteryUnits, BecomeVolts) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,u\n0,160\n", csv_mapping(stream("battery", "[\"u\"]", GetParam().first)));
  EXPECT_NEAR(r.flight.battery_V.value.at(0), GetParam().second, 1e-12);
}
INSTANTIATE_TEST_SUITE_P(LogMapping, BatteryUnits, ::testing::Values(std::pair{"V", 160.0}, std::pair{"dV", 16.0}, std::pair{"mV", 0.16}));

TEST(LogMapping, RotorSpeedsComeInOurOrderWhateverTheirs) {
  test::TempFolder folder;  // theirs: 1 front right, 2 rear right, 3 rear left, 4 front left
  const auto r = read_csv(folder, "t,m1,m2,m3,m4\n0,101,102,103,104\n",
                          csv_mapping(stream("rotor_speed", "[\"m1\", \"m3\", \"m4\", \"m2\"]", "rad/s")));
  EXPECT_EQ(r.flight.rotor_omega_rad_s.value.at(0), (RotorValues{101, 103, 104, 102}));
}

TEST(LogMapping, RevolutionsPerMinuteAndElectricalOnesWithPolePairsBecomeRadPerS) {
  test::TempFolder folder;
  const auto rpm = read_csv(folder, "t,a,b,c,d\n0,60,120,0,6000\n", csv_mapping(stream("rotor_speed", kRotors, "rpm")));
  EXPECT_NEAR(rpm.flight.rotor_omega_rad_s.value[0][0], 2 * kPi, 1e-12);
  EXPECT_NEAR(rpm.flight.rotor_omega_rad_s.value[0][3], 200 * kPi, 1e-9);
  const auto erpm = read_csv(folder, "t,a,b,c,d\n0,360,1,1,1\n", csv_mapping(stream("rotor_speed", kRotors, "erpm", "pole_pairs = 6")));
  EXPECT_NEAR(erpm.flight.rotor_omega_rad_s.value[0][0], 2 * kPi, 1e-12);
}

TEST(LogMapping, SignsAndScaleApplyToEachColumn) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,x,y,z\n0,1,2,3\n", csv_mapping(stream("gyro", kXyz, "rad/s", "sign = [1, -1, -1]\nscale = 2")));
  expect_near(r.flight.gyro_B_rad_s.value.at(0), 2, -4, -6);
}

TEST(LogMapping, MotorCommandsRunFromZeroToOneBetweenTheValuesOfNoAndFullThrust) {
  test::TempFolder folder;
  const auto pwm =
      read_csv(folder, "t,a,b,c,d\n0,0,65535,32767.5,13107\n", csv_mapping(stream("motor_command", kRotors, "", "full_scale = 65535")));
  EXPECT_EQ(pwm.flight.motor_command.value.at(0), (RotorValues{0, 1, 0.5, 0.2}));
  const auto us = read_csv(folder, "t,a,b,c,d\n0,1000,2000,1500,1250\n",
                           csv_mapping(stream("motor_command", kRotors, "", "zero = 1000\nfull_scale = 2000")));
  EXPECT_EQ(us.flight.motor_command.value.at(0), (RotorValues{0, 1, 0.5, 0.25}));
}

TEST(LogMapping, ConstantStandsForAColumnThatTheLogLacks) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,x,y\n0,1,2\n", csv_mapping(stream("position", "[\"x\", \"y\", \"= 0.5\"]", "m")));
  expect_near(r.flight.position_W_m.value.at(0), 1, 2, 0.5);
}

// Yaw of +90°: x of the body points along y of the world.
const std::string kYaw90 = std::to_string(std::sqrt(0.5)) + ",0,0," + std::to_string(std::sqrt(0.5));

TEST(LogMapping, AttitudeIsBodyToWorldWhicheverWayItIsLogged) {
  test::TempFolder folder;
  const std::string log = "t,x,y,z,qw,qx,qy,qz\n0,1,2,3," + kYaw90 + "\n";
  const auto a = read_csv(folder, log, csv_mapping(stream("pose", kXyz, "m", kQuaternion)));
  expect_near(a.flight.pose.value.at(0).q_WS * Eigen::Vector3d::UnitX(), 0, 1, 0);
  EXPECT_NEAR(a.flight.pose.value[0].q_WS.norm(), 1.0, 1e-15);
  const auto b = read_csv(folder, log, csv_mapping(stream("pose", kXyz, "m", kQuaternion + "direction = \"world_to_body\"")));
  expect_near(b.flight.pose.value.at(0).q_WS * Eigen::Vector3d::UnitX(), 0, -1, 0);
}

TEST(LogMapping, NorthEastDownAndForwardRightDownTurnIntoOurAxes) {
  test::TempFolder folder;  // heading east (yaw +90° about down), 2 m up, climbing
  const std::string mapping = csv_mapping(stream("pose", kXyz, "m", kQuaternion) + stream("velocity", "[\"vx\", \"vy\", \"vz\"]", "m/s") +
                                              stream("accel", "[\"ax\", \"ay\", \"az\"]", "m/s2"),
                                          "axes.world = \"NED\"\naxes.body = \"FRD\"\n");
  const auto r = read_csv(folder, "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,ax,ay,az\n0,5,6,-2," + kYaw90 + ",0.1,0.2,-0.3,1,2,-9.8\n", mapping);
  expect_near(r.flight.pose.value.at(0).p_W_m, 5, -6, 2);
  expect_near(r.flight.pose.value[0].q_WS * Eigen::Vector3d::UnitX(), 0, -1, 0);  // east is to the right of north: -y
  expect_near(r.flight.pose.value[0].q_WS * Eigen::Vector3d::UnitZ(), 0, 0, 1);
  expect_near(r.flight.velocity_W_m_s.value.at(0), 0.1, -0.2, 0.3);
  expect_near(r.flight.accel_B_m_s2.value.at(0), 1, -2, 9.8);
}

TEST(LogMapping, RollToTheRightInForwardRightDownIsRollToTheRightInOurs) {
  test::TempFolder folder;
  const std::string roll30 = std::to_string(std::cos(kPi / 12)) + "," + std::to_string(std::sin(kPi / 12)) + ",0,0";
  const auto r = read_csv(folder, "t,x,y,z,qw,qx,qy,qz\n0,0,0,0," + roll30 + "\n",
                          csv_mapping(stream("pose", kXyz, "m", kQuaternion), "axes.world = \"NED\"\naxes.body = \"FRD\"\n"));
  const Eigen::Vector3d left = r.flight.pose.value.at(0).q_WS * Eigen::Vector3d::UnitY();
  EXPECT_NEAR(left.z(), 0.5, 1e-6);  // the left side is up
}

TEST(LogMapping, VelocityInTheBodyIsTurnedToTheWorld) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,x,y,z,qw,qx,qy,qz\n0,3,0,1," + kYaw90 + "\n",
                          csv_mapping(stream("velocity", kXyz, "m/s", kQuaternion + "frame = \"body\"")));
  expect_near(r.flight.velocity_W_m_s.value.at(0), 0, 3, 1);
}

TEST(LogMapping, SpecificForceInWorldAxesIsTurnedToTheBody) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,x,y,z,qw,qx,qy,qz\n0,0,2,9.8," + kYaw90 + "\n",
                          csv_mapping(stream("accel", kXyz, "m/s2", kQuaternion + "frame = \"world\"")));
  expect_near(r.flight.accel_B_m_s2.value.at(0), 2, 0, 9.8);
}

TEST(LogMapping, GravityThatWasRemovedIsAddedBackInWorldAndInBodyAxes) {
  test::TempFolder folder;
  const std::string upside_down = "0,1,0,0";
  const auto world = read_csv(folder, "t,x,y,z,qw,qx,qy,qz\n0,0,0,0," + upside_down + "\n",
                              csv_mapping(stream("accel", kXyz, "m/s2", kQuaternion + "frame = \"world\"\ngravity = \"removed\"")));
  expect_near(world.flight.accel_B_m_s2.value.at(0), 0, 0, -9.80665);
  const auto body = read_csv(folder, "t,x,y,z,qw,qx,qy,qz\n0,0,0,1,1,0,0,0\n",
                             csv_mapping(stream("accel", kXyz, "m/s2", kQuaternion + "gravity = \"removed\"")));
  expect_near(body.flight.accel_B_m_s2.value.at(0), 0, 0, 10.80665);
}

TEST(LogMapping, HeldSamplesAreDroppedOnRequestAndCounted) {
  test::TempFolder folder;
  const std::string log = "t,a,b,c,d\n0,1,1,1,1\n0.01,1,1,1,1\n0.02,2,1,1,1\n0.03,2,1,1,1\n0.04,1,1,1,1\n";
  const auto all = read_csv(folder, log, csv_mapping(stream("rotor_speed", kRotors, "rad/s")));
  EXPECT_EQ(all.flight.rotor_omega_rad_s.size(), 5u);
  const auto true_rate = read_csv(folder, log, csv_mapping(stream("rotor_speed", kRotors, "rad/s", "held = \"drop\"")));
  EXPECT_EQ(true_rate.flight.rotor_omega_rad_s.t_s, (std::vector<double>{0, 0.02, 0.04}));
  EXPECT_TRUE(true_rate.noted("rotor_speed: 2 of 5 rows repeat the reading before and are left out (50.0 Hz remain)"));
}

TEST(LogMapping, BlankRowsAreSkippedAndNotedAndARotorWithoutReadingStaysNotANumber) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,a,b,c,d,u\n0,1,,3,nan,12\n1,,,,,\n2,1,2,3,4,12.1\n",
                          csv_mapping(stream("rotor_speed", kRotors, "rad/s") + stream("battery", "[\"u\"]", "V")));
  ASSERT_EQ(r.flight.rotor_omega_rad_s.size(), 2u);
  EXPECT_EQ(r.flight.rotor_omega_rad_s.value[0][0], 1.0);
  EXPECT_TRUE(std::isnan(r.flight.rotor_omega_rad_s.value[0][1]));
  EXPECT_TRUE(std::isnan(r.flight.rotor_omega_rad_s.value[0][3]));
  EXPECT_EQ(r.flight.battery_V.t_s, (std::vector<double>{0, 2}));
  EXPECT_TRUE(r.noted("battery: 1 of 3 rows are blank"));
}

TEST(LogMapping, ValueThatStandsForNoReadingIsNone) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,u\n0,-1\n1,12\n", csv_mapping(stream("battery", "[\"u\"]", "V", "missing_value = -1")));
  EXPECT_EQ(r.flight.battery_V.t_s, (std::vector<double>{1}));
}

TEST(LogMapping, RowsCountOnlyWhereAColumnHasTheValueAskedFor) {
  test::TempFolder folder;
  const auto r =
      read_csv(folder, "t,u,ok\n0,11,0\n1,12,1\n", csv_mapping(stream("battery", "[\"u\"]", "V", "only_if = { column = \"ok\", is = 1 }")));
  EXPECT_EQ(r.flight.battery_V.value, (std::vector<double>{12}));
}

TEST(LogMapping, OffsetIsAddedToTheStampsOfItsStreamAlone) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,u,x,y,z\n1,12,0,0,0\n",
                          csv_mapping(stream("battery", "[\"u\"]", "V", "time_offset_s = -0.02") + stream("gyro", kXyz, "rad/s")));
  EXPECT_NEAR(r.flight.battery_V.t_s.at(0), 0.98, 1e-15);
  EXPECT_EQ(r.flight.gyro_B_rad_s.t_s.at(0), 1.0);
}

TEST(LogMapping, StartAtZeroMovesAllFilesByTheEarliestStampOfAny) {
  test::TempFolder folder;
  folder.write("log_slow.csv", "ms,u\n99000,12\n");
  std::string mapping = csv_mapping(stream("gyro", kXyz, "rad/s") + stream("battery", "[\"u\"]", "V", "from = \"slow\"") +
                                    "[source.slow]\nsuffix = \"_slow.csv\"\ntime.column = \"ms\"\ntime.unit = \"ms\"\n");
  mapping.replace(mapping.find("unit = \"s\""), 10, "unit = \"s\"\nstart = \"zero\"");
  const auto r = read_csv(folder, "t,x,y,z\n100,1,2,3\n", mapping);
  EXPECT_EQ(r.flight.battery_V.t_s.at(0), 0.0);
  EXPECT_EQ(r.flight.gyro_B_rad_s.t_s.at(0), 1.0);
}

TEST(LogMapping, FirstAlternativeThatTheLogHasIsTaken) {
  test::TempFolder folder;
  const std::string mapping = csv_mapping(stream("battery", "[\"volt\"]", "V") + stream("battery", "[\"u\"]", "mV"));
  EXPECT_EQ(read_csv(folder, "t,u\n0,12000\n", mapping).flight.battery_V.value.at(0), 12.0);
  EXPECT_EQ(read_csv(folder, "t,u,volt\n0,12000,11\n", mapping).flight.battery_V.value.at(0), 11.0);
}

TEST(LogMapping, OptionalStreamThatIsNotThereIsANote) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,x,y,z\n0,0,0,0\n",
                          csv_mapping(stream("gyro", kXyz, "rad/s") + stream("battery", "[\"u\"]", "V", "optional = true")));
  EXPECT_TRUE(r.flight.battery_V.empty());
  EXPECT_TRUE(r.noted("battery: not in this log: no column u"));
}

TEST(LogMapping, FurtherColumnThatIsNotThereIsANoteUnlessTheMappingSaysOtherwise) {
  test::TempFolder folder;
  const std::string log = "t,x,y,z\n0,0,0,0\n", gyro = stream("gyro", kXyz, "rad/s");
  const auto r = read_csv(folder, log, csv_mapping(gyro + stream("extra", "[\"px\"]", "mm", "name = \"payload_x[m]\"")));
  EXPECT_EQ(r.flight.gyro_B_rad_s.size(), 1u);
  EXPECT_TRUE(r.noted("extra payload_x[m]: not in this log: no column px"));
  const std::string required = csv_mapping(gyro + stream("extra", "[\"px\"]", "mm", "name = \"payload_x[m]\"\noptional = false"));
  EXPECT_THAT(test::error_of([&] { read_csv(folder, log, required); }), HasSubstr("no column px"));
}

TEST(LogMapping, FurtherColumnsAreKeptUnderTheirNames) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,px\n0,-15\n", csv_mapping(stream("extra", "[\"px\"]", "mm", "name = \"payload_x[m]\"")));
  EXPECT_NEAR(r.flight.extra.at("payload_x[m]").value.at(0), -0.015, 1e-15);
}

TEST(CsvTable, TakesCarriageReturnsByteOrderMarksCommentsQuotesAndOtherSeparators) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "\xEF\xBB\xBF# exported\r\n\"t\"; \"u\" \r\n\r\n0; 12\r\n1;+13\r\n",
                          csv_mapping(stream("battery", "[\"u\"]", "V"), "separator = \";\"\n"));
  EXPECT_EQ(r.flight.battery_V.value, (std::vector<double>{12, 13}));
}

TEST(CsvTable, LastLineThatWasCutIsLeftOutAndNoted) {
  test::TempFolder folder;
  const auto r = read_csv(folder, "t,u,x\n0,12,1\n1,1", csv_mapping(stream("battery", "[\"u\"]", "V")));
  EXPECT_EQ(r.flight.battery_V.size(), 1u);
  EXPECT_TRUE(r.noted("line 3 was cut off"));
}

// --- what does not work is told with file, line and remedy -----------------------------------------------------------------------

struct BadMapping {
  std::string mapping, message;
};
class BadMappings : public ::testing::TestWithParam<BadMapping> {};
TEST_P(BadMappings, AreRefusedWithFileLineAndRemedy) {
  const std::string error = test::error_of([] { (void)parse_log_mapping(GetParam().mapping, "bad.mapping.toml"); });
  EXPECT_THAT(error, AllOf(HasSubstr("bad.mapping.toml"), HasSubstr(GetParam().message)));
}
const std::string kGyro = stream("gyro", kXyz, "rad/s");
INSTANTIATE_TEST_SUITE_P(
    LogMapping, BadMappings,
    ::testing::Values(BadMapping{"format = 2\nname = \"x\"\nlog = \"csv\"\n", "format"}, BadMapping{"format = 1\n", "name"},
                      BadMapping{"format = 1\nname = \"x\"\nlog = \"tsv\"\n", "tsv"},
                      BadMapping{"format = 1\nname = \"x\"\nlog = \"csv\"\n" + kGyro, "time"}, BadMapping{csv_mapping(""), "stream"},
                      BadMapping{csv_mapping(kGyro, "colour = 1\n"), "colour"},
                      BadMapping{csv_mapping(kGyro, "separator = \"|\"\n"), "separator"},
                      BadMapping{csv_mapping(stream("thrust", kXyz, "N")), "thrust"},
                      BadMapping{csv_mapping(stream("gyro", "[\"x\", \"y\"]", "rad/s")), "expected 3"},
                      BadMapping{csv_mapping(stream("rotor_speed", kXyz, "rpm")), "give one column for each rotor"},
                      BadMapping{csv_mapping(stream("gyro", "[\"x\", \"x\", \"z\"]", "rad/s")), "names \"x\" twice"},
                      BadMapping{csv_mapping(stream("gyro", "[\"x\", \"\", \"z\"]", "rad/s")), "empty name"},
                      BadMapping{csv_mapping(stream("gyro", "[\"x\", \"= up\", \"z\"]", "rad/s")), "is not a constant"},
                      BadMapping{csv_mapping(stream("gyro", kXyz, "m/s")), "use one of: rad/s, mrad/s, deg/s"},
                      BadMapping{csv_mapping(stream("gyro", kXyz, "")), "unit"},
                      BadMapping{csv_mapping(stream("rotor_speed", kRotors, "erpm")), "pole_pairs"},
                      BadMapping{csv_mapping(stream("gyro", kXyz, "rad/s", "sign = [1, 1, 0.5]")), "expected 1 or -1"},
                      BadMapping{csv_mapping(stream("gyro", kXyz, "rad/s", "scale = 0")), "scale = 0"},
                      BadMapping{csv_mapping(stream("gyro", kXyz, "rad/s", "from = \"mocap\"")), "no source of this mapping"},
                      BadMapping{csv_mapping(stream("gyro", kXyz, "rad/s", "time_offset_s = 60")), "time_offset_s"},
                      BadMapping{csv_mapping(stream("gyro", kXyz, "rad/s", "held = \"maybe\"")), "held"},
                      BadMapping{csv_mapping(stream("gyro", kXyz, "rad/s", "spin = 1")), "spin"},
                      BadMapping{csv_mapping(stream("pose", kXyz, "m")), "quantity = \"position\""},
                      BadMapping{csv_mapping(stream("pose", kXyz, "m", "quaternion = [\"qx\", \"qy\", \"qz\"]")), "expected 4"},
                      BadMapping{csv_mapping(stream("pose", kXyz, "m", "quaternion = [\"qx\", \"qx\", \"qy\", \"qz\"]")), "twice"},
                      BadMapping{csv_mapping(stream("pose", kXyz, "m", kQuaternion + "frame = \"body\"")), "no meaning"},
                      BadMapping{csv_mapping(stream("velocity", kXyz, "m/s", "frame = \"body\"")), "must be turned"},
                      BadMapping{csv_mapping(stream("accel", kXyz, "m/s2", "frame = \"world\"")), "must be turned"},
                      BadMapping{csv_mapping(stream("accel", kXyz, "m/s2", "gravity = \"removed\"")), "must be turned"},
                      BadMapping{csv_mapping(stream("motor_command", kRotors, "")), "full_scale"},
                      BadMapping{csv_mapping(stream("motor_command", kRotors, "", "zero = 5\nfull_scale = 5")),
                                 "every command would be the same"},
                      BadMapping{csv_mapping(stream("extra", "[\"x\"]", "mm")), "name"},
                      BadMapping{csv_mapping(stream("extra", "[\"x\"]", "mm", "name = \"load\"")), "does not end in an SI unit"},
                      BadMapping{csv_mapping(stream("extra", "[\"x\"]", "deg", "name = \"load_x[m]\"")), "use one of: m, cm, mm"},
                      BadMapping{csv_mapping(kGyro + "[source.far]\nsuffix = \"../other.csv\"\n"), "does not name a file beside the log"},
                      BadMapping{csv_mapping(kGyro, "axes.world = \"ENU\"\n"), "ENU"}));

TEST(LogMapping, ColumnThatTheLogLacksIsNamedWithTheMappingsLineAndWhatTheLogHas) {
  test::TempFolder folder;
  const std::string error = test::error_of([&] { read_csv(folder, "t,x,y\n0,1,2\n", csv_mapping(stream("gyro", kXyz, "rad/s"))); });
  EXPECT_THAT(error, AllOf(HasSubstr("test.mapping.toml:7"), HasSubstr("no column z (gyro) in log.csv"), HasSubstr("it has: t, x, y")));
}
TEST(LogMapping, TimeColumnThatTheLogLacksIsNamed) {
  test::TempFolder folder;
  EXPECT_THAT(test::error_of([&] { read_csv(folder, "time,x,y,z\n0,1,2,3\n", csv_mapping(stream("gyro", kXyz, "rad/s"))); }),
              HasSubstr("no column t (time) in log.csv"));
}
TEST(LogMapping, FileBesideTheLogThatIsNotThereIsNamed) {
  test::TempFolder folder;
  EXPECT_THAT(test::error_of([&] {
                read_csv(folder, "t\n0\n",
                         csv_mapping(stream("battery", "[\"u\"]", "V", "from = \"slow\"") + "[source.slow]\nsuffix = \"_slow.csv\"\n"));
              }),
              HasSubstr("the file *_slow.csv beside the log, which is not there"));
}
TEST(LogMapping, FourColumnsThatAreNoQuaternionAreRefused) {
  test::TempFolder folder;
  const std::string degrees = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,10,20,30,40\n1,0,0,0,10,20,30,40\n";
  EXPECT_THAT(
      test::error_of([&] { read_csv(folder, degrees, csv_mapping(stream("pose", kXyz, "m", kQuaternion))); }, ExitCode::data_quality),
      AllOf(HasSubstr("are no unit quaternion: norm 54.7"), HasSubstr("Euler angles")));
}
TEST(LogMapping, BlankIsRefusedWhereTheMappingSaysSo) {
  test::TempFolder folder;
  EXPECT_THAT(
      test::error_of([&] { read_csv(folder, "t,u\n0,1\n1,\n", csv_mapping(stream("battery", "[\"u\"]", "V", "blank = \"refuse\""))); },
                     ExitCode::data_quality),
      HasSubstr("battery is blank in data row 2"));
}
TEST(CsvTable, DamagedRowsAreNamedByLine) {
  test::TempFolder folder;
  const std::string mapping = csv_mapping(stream("battery", "[\"u\"]", "V"));
  const auto error = [&](const std::string& log) {
    return test::error_of([&] { read_csv(folder, log, mapping); }, ExitCode::data_quality);
  };
  EXPECT_THAT(error("t,u\n0,1,2\n1,2\n"), HasSubstr("log.csv:2: error: has 3 cells, the header has 2"));
  EXPECT_THAT(error("t;u\n0,1\n0;1\n"), HasSubstr("log.csv:2"));
  EXPECT_THAT(error("t,u\n0,1\n0,1x\n2,3\n"), HasSubstr("log.csv:3: error: \"1x\" in column \"u\" is not a number"));
  EXPECT_THAT(error("t,u,u\n0,1,2\n"), HasSubstr("has the column \"u\" twice"));
  EXPECT_THAT(error(""), HasSubstr("has no row of column names"));
  EXPECT_THAT(error("# only a comment\n"), HasSubstr("has no row of column names"));
}
TEST(CsvTable, PartedByAnotherSignIsRefusedWithTheSeparatorToSet) {
  test::TempFolder folder;
  const std::string battery = stream("battery", "[\"u\"]", "V");
  const auto error = [&](const std::string& log, const std::string& head) {
    return test::error_of([&] { read_csv(folder, log, csv_mapping(battery, head)); });
  };
  EXPECT_THAT(error("t;u\n0;1\n", ""), HasSubstr("set separator = \";\" in the mapping"));
  EXPECT_THAT(error("t\tu\n0\t1\n", ""), HasSubstr("set separator = \"tab\" in the mapping"));
  EXPECT_THAT(error("t,u\n0,1\n", "separator = \";\"\n"), HasSubstr("set separator = \",\" in the mapping"));
}
TEST(CsvTable, WithoutNamesOrWithoutRowsIsRefusedAsSuchAndNoColumnIsBlamed) {
  test::TempFolder folder;
  const std::string mapping = csv_mapping(stream("battery", "[\"u\"]", "V"));
  const std::string empty = test::error_of([&] { read_csv(folder, "t,u\n", mapping); }, ExitCode::data_quality);
  EXPECT_THAT(empty, HasSubstr("has names of 2 columns and no row of numbers"));
  EXPECT_THAT(test::error_of([&] { read_csv(folder, "0.0,11.1\n0.1,11.0\n", mapping); }),
              HasSubstr("its first row holds numbers where names of columns are expected: 0.0, 11.1"));
}
TEST(ReadFlight, LogOfAnotherToolWithoutMappingListsItsColumns) {
  test::TempFolder folder;
  const auto path = folder.write("log.csv", "t,u\n0,1\n");
  EXPECT_THAT(test::error_of([&] { (void)read_flight(path, nullptr); }),
              AllOf(HasSubstr("columns t, u mean"), HasSubstr("give --mapping")));
  EXPECT_THAT(test::error_of([&] { (void)read_flight(folder.path(), nullptr); }), HasSubstr("flight.csv: error: no such file"));
  const LogMapping ulog = parse_log_mapping(
      "format = 1\nname = \"u\"\nlog = \"ulog\"\n[source.b]\ntopic = \"b\"\n" + stream("battery", "[\"u\"]", "V", "from = \"b\""),
      "u.toml");
  EXPECT_THAT(test::error_of([&] { (void)read_flight(path, &ulog); }), HasSubstr("is CSV, and u.toml maps ULog"));
}

}  // namespace
}  // namespace rotorloop::log
