// The staged fit against loads of second_writing.hpp, and the load table.
#include "bench/hil/calibrate/fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "bench/sysid/log/column_table.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/hil/calibrate/second_writing.hpp"

namespace rotorloop::calibrate {
namespace {

std::vector<LoadPoint> programme(const Truth& t) {
  std::vector<LoadPoint> points;
  for (const double v : {-8.0, -5.0, -2.0, 2.0, 5.0, 8.0})
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
      velocity[axis] = v;
      points.push_back(point(t, velocity, {}));
    }
  for (const double w : {750.0, 900.0, 1000.0, 1150.0})
    for (const double v_z : {-2.0, -1.0, 0.0, 1.5, 3.0}) points.push_back(point(t, {0, 0, v_z}, {w, w, w, w}));
  for (const double w : {850.0, 1000.0})
    for (const double v : {2.0, 4.0, 8.5}) {
      points.push_back(point(t, {v, 0, 0.5}, {w, w, w, w}));
      points.push_back(point(t, {0, -v, -0.5}, {w, w, w, w}));
    }
  for (const double d : {-0.1, -0.05, 0.05, 0.1})
    points.push_back(point(t, {0, 0, 0}, {1000 * (1 + d), 1000 * (1 + d), 1000 * (1 - d), 1000 * (1 - d)}));
  return points;
}

TEST(LoadFit, RecoversAllSixCoefficientsOfModelTrueLoadsTo1e5Relative) {
  const Truth t;
  const LoadFit f = fit_loads(programme(t), geometry());
  EXPECT_NEAR(f.k1_N_s2.value / t.k1, 1.0, 1e-5);
  EXPECT_NEAR(f.k2_N_s2_m.value / t.k2, 1.0, 1e-5);
  EXPECT_NEAR(f.c_q_N_m_s2.value / t.c_q, 1.0, 1e-5);
  EXPECT_NEAR(f.c_dh_s_m.value / t.c_dh, 1.0, 1e-5);
  EXPECT_NEAR(f.c_dxy_N_s2_m2.value / t.c_dxy, 1.0, 1e-5);
  EXPECT_NEAR(f.c_dz_N_s2_m2.value / t.c_dz, 1.0, 1e-5);
  EXPECT_LT(f.thrust_rms_N, 1e-5);
}

TEST(LoadFit, UncertaintyGrowsWithWhatTheModelCannotExplain) {
  const Truth t;
  auto points = programme(t);
  const double before = fit_loads(points, geometry()).k1_N_s2.u;
  int n = 0;
  for (auto& p : points) p.force_B_N.z() += ++n % 2 ? 0.05 : -0.05;
  EXPECT_GT(fit_loads(points, geometry()).k1_N_s2.u, 100.0 * before + 1e-10);
}

TEST(LoadFit, ThrustComesFromAxialPointsAlone) {
  const Truth t;
  auto points = programme(t);
  for (auto& p : points)
    if (p.v_B_m_s.head<2>().norm() > 0.5) p.force_B_N.z() *= 1.2;  // an edgewise effect that eq. (1)-(2) has not
  EXPECT_NEAR(fit_loads(points, geometry()).k1_N_s2.value / t.k1, 1.0, 1e-5);
}

TEST(LoadFit, SaysWhichPointsAreMissing) {
  const Truth t;
  const auto without = [&](auto drop) {
    auto points = programme(t);
    std::erase_if(points, drop);
    try {
      fit_loads(points, geometry());
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
      return std::string(e.what());
    }
    return std::string("no error");
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(without([](const LoadPoint& p) { return p.omega_rad_s[0] == 0.0; }), HasSubstr("airframe drag, eq. (5)"));
  EXPECT_THAT(without([](const LoadPoint& p) {
                return p.omega_rad_s[0] > 0.0 && p.omega_rad_s[0] == p.omega_rad_s[2] && p.v_B_m_s.head<2>().norm() < 0.5;
              }),
              HasSubstr("the thrust model, eq. (1)-(2)"));
  EXPECT_THAT(without([](const LoadPoint& p) { return p.omega_rad_s[0] != p.omega_rad_s[2]; }),
              HasSubstr("the torque coefficient, eq. (3)"));
  EXPECT_THAT(without([](const LoadPoint& p) { return p.omega_rad_s[0] > 0.0 && p.v_B_m_s.head<2>().norm() > 0.5; }),
              HasSubstr("rotor drag, eq. (4)"));
}

class LoadTable : public ::testing::Test {
 protected:
  std::filesystem::path path_ = std::filesystem::temp_directory_path() /
                                ("rotorloop_loads_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + ".csv");
  void TearDown() override { std::filesystem::remove(path_); }
};

TEST_F(LoadTable, IsReadBitByBitByTheReaderOfLogs) {
  const auto points = programme(Truth{});
  write_load_points(path_, points);
  const log::ColumnTable back = log::read_csv_table(path_, {"omega_3[rad/s]", "f_z[N]", "tau_z[N m]"}, {});
  ASSERT_EQ(back.rows, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(back.columns.at("omega_3[rad/s]")[i], points[i].omega_rad_s[2]);
    EXPECT_EQ(back.columns.at("f_z[N]")[i], points[i].force_B_N.z());
    EXPECT_EQ(back.columns.at("tau_z[N m]")[i], points[i].torque_B_N_m.z());
  }
}

}  // namespace
}  // namespace rotorloop::calibrate
