// The house's own flight log as a FlightRecord: stamps of poses, empty cells, conversion there and back, and no truth.
#include "bench/sysid/log/own_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/log/log_writer.hpp"
#include "bench/sysid/log/read_flight.hpp"
#include "test/unit/bench/sysid/identify/flight_examples.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::log {
namespace {
using ::testing::HasSubstr;

TEST(OwnLog, PoseAndVelocityCarryTheTimeOfMeasurementAndTheRestTheTimeOfTheRow) {
  test::TempFolder folder;
  {
    FlightLogWriter w(folder.path() / "flight.csv", {});
    FlightRow r;
    r.t_s = 1.015;
    r.pose_t_s = 1.0;
    r.p_W_m = {1, 2, 3};
    r.q_WS = {1, 0, 0, 0};
    r.v_W_m_s = {0.1, 0.2, 0.3};
    r.omega_rad_s = {900, 901, 902, 903};
    r.omega_cmd_rad_s = {910, 910, 910, 910};
    r.bus_V = 16.1;
    r.gyro_B_rad_s = {0.01, 0.02, 0.03};
    r.accel_B_m_s2 = {0, 0, 9.81};
    w.write(r);
    FlightRow imu_only;
    imu_only.t_s = 1.016;
    imu_only.gyro_B_rad_s = {0, 0, 0};
    imu_only.omega_rad_s = {900, kEmpty, 902, 903};
    w.write(imu_only);
    w.close();
  }
  const auto f = read_flight(folder.path(), nullptr);
  EXPECT_EQ(f.pose.t_s, (std::vector<double>{1.0}));
  EXPECT_EQ(f.velocity_W_m_s.t_s, (std::vector<double>{1.0}));
  EXPECT_EQ(f.pose.value[0].p_W_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(f.gyro_B_rad_s.t_s, (std::vector<double>{1.015, 1.016}));
  EXPECT_EQ(f.accel_B_m_s2.t_s, (std::vector<double>{1.015}));
  ASSERT_EQ(f.rotor_omega_rad_s.size(), 2u);
  EXPECT_TRUE(std::isnan(f.rotor_omega_rad_s.value[1][1]));
  EXPECT_EQ(f.battery_V.value, (std::vector<double>{16.1}));
  EXPECT_EQ(f.extra.at("omega_cmd_3[rad/s]").value, (std::vector<double>{910}));
  EXPECT_EQ(f.extra.count("est_p_x[m]"), 0u);
}

TEST(OwnLog, FlightOfARunFolderIsNamedAfterItsThreeFolders) {
  test::TempFolder folder;
  folder.write("run/vertical/pd_ff/3/flight.csv", "# rotorloop flight log 1\nt[s],bus[V]\n0,16\n");
  EXPECT_EQ(read_flight(folder.path() / "run/vertical/pd_ff/3", nullptr).name, "vertical/pd_ff/3");
}

TEST(OwnLog, WhatIsWrittenReadsBackToTheLastBit) {
  test::TempFolder folder;
  const FlightRecord a = identify::flight_example();
  const FlightRecord b = read_own_log(folder.write("flight.csv", own_log_text(a)));
  identify::expect_same_flight(a, b, 0.0, 0.0);
}

TEST(OwnLog, PositionWithoutAttitudeReadsBackAsPosition) {
  test::TempFolder folder;
  FlightRecord a;
  a.position_W_m.add(0.5, {1, 2, 3});
  const FlightRecord b = read_own_log(folder.write("flight.csv", own_log_text(a)));
  EXPECT_TRUE(b.pose.empty());
  EXPECT_EQ(b.position_W_m.value, a.position_W_m.value);
}

TEST(OwnLog, ExtraThatWouldPassForAColumnOfTheFlightLogIsRefused) {
  FlightRecord a;
  a.extra["p_x[m]"].add(0.5, 1);
  EXPECT_THAT(test::error_of([&] { (void)own_log_text(a); }), HasSubstr("give it another name in the mapping"));
}

TEST(OwnLog, TruthIsRefused) {
  test::TempFolder folder;
  {
    TruthLogWriter w(folder.path() / "truth.csv", {});
    TruthRow r;
    r.t_s = 0.0;
    w.write(r);
    w.close();
  }
  EXPECT_THAT(test::error_of([&] { (void)read_flight(folder.path() / "truth.csv", nullptr); }), HasSubstr("is a truth log"));
}

TEST(OwnLog, DamageIsNamed) {
  test::TempFolder folder;
  const auto error = [&](const std::string& columns_and_rows) {
    const auto path = folder.write("flight.csv", "# rotorloop flight log 1\n" + columns_and_rows);
    return test::error_of([&] { (void)read_flight(path, nullptr); }, ExitCode::data_quality);
  };
  EXPECT_THAT(error("p_x[m]\n1\n"), HasSubstr("has no column \"t[s]\""));
  EXPECT_THAT(error("t[s],gyro_x[rad/s]\n1,2\n"), HasSubstr("has no column \"gyro_y[rad/s]\""));
  EXPECT_THAT(error("t[s],bus[V]\n,12\n"), HasSubstr("row 1 has no t[s]"));
  EXPECT_THAT(error("t[s],p_x[m],p_y[m],p_z[m],q_w[1],q_x[1],q_y[1],q_z[1]\n1,0,0,0,2,0,0,0\n"), HasSubstr("norm 2, expected 1"));
}

TEST(OwnLog, MappingGivenWithItIsAnError) {
  test::TempFolder folder;
  const auto path = folder.write("flight.csv", "# rotorloop flight log 1\nt[s],bus[V]\n0,16\n");
  const LogMapping m = parse_log_mapping(
      "format = 1\nname = \"x\"\nlog = \"csv\"\n[time]\ncolumn = \"t\"\nunit = \"s\"\n[[stream]]\nquantity = \"battery\"\n"
      "columns = [\"u\"]\nunit = \"V\"\n",
      "m.toml");
  EXPECT_THAT(test::error_of([&] { (void)read_flight(path, &m); }), HasSubstr("needs no mapping"));
}

}  // namespace
}  // namespace rotorloop::log
