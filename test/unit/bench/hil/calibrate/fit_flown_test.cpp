// The fit over flown states: exact on loads of second_writing.hpp, the best there is on others, and honest about what is unobservable.
#include "bench/hil/calibrate/fit_flown.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "bench/hil/calibrate/programme.hpp"
#include "host/vehicle/drag.hpp"
#include "host/vehicle/thrust.hpp"
#include "test/unit/bench/hil/calibrate/second_writing.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::calibrate {
namespace {

using ::testing::HasSubstr;

constexpr Truth kTruth{.com_x = 0.0014, .com_y = -0.0007};

// Climbs, runs along both axes, and turns, with rotors that are never alike.
std::vector<LoadPoint> flight(const Truth& t, double speed_xy_m_s = 8.0) {
  std::vector<LoadPoint> points;
  for (int i = 0; i < 200; ++i) {
    const double a = 0.1 * i, climb = 3.0 * std::sin(0.37 * a);
    const Eigen::Vector3d v(speed_xy_m_s * std::sin(a), speed_xy_m_s * std::sin(0.61 * a), climb);
    const double w = 950.0 + 120.0 * std::sin(0.83 * a), turn = 1.0 + 0.06 * std::sin(1.7 * a), roll = 20.0 * std::sin(2.3 * a);
    points.push_back(point(t, v, {w * turn - roll, w * turn + roll, w / turn + roll, w / turn - roll}));
  }
  return points;
}

host::VehicleModel guess() {
  host::VehicleModel m = geometry();
  m.thrust.k1_N_s2 = 1.3 * kTruth.k1;
  m.thrust.k2_N_s2_m = 1.5 * kTruth.k2;
  return m;  // drag zero
}

TEST(FlownFit, RecoversAllEightCoefficientsOfModelTrueLoadsFromAGuessThirtyPercentOff) {
  const FlownFit f = fit_flown(flight(kTruth), guess());
  EXPECT_NEAR(f.k1_N_s2.value / kTruth.k1, 1.0, 1e-6);
  EXPECT_NEAR(f.k2_N_s2_m.value / kTruth.k2, 1.0, 1e-6);
  EXPECT_NEAR(f.c_dh_s_m.value / kTruth.c_dh, 1.0, 1e-6);
  EXPECT_NEAR(f.c_dxy_N_s2_m2.value / kTruth.c_dxy, 1.0, 1e-6);
  EXPECT_NEAR(f.c_dz_N_s2_m2.value / kTruth.c_dz, 1.0, 1e-6);
  EXPECT_NEAR(f.c_q_N_m_s2.value / kTruth.c_q, 1.0, 1e-6);
  EXPECT_NEAR(f.com_x_m.value, kTruth.com_x, 1e-8);
  EXPECT_NEAR(f.com_y_m.value, kTruth.com_y, 1e-8);
  EXPECT_LT(f.force_xy_rms_N + f.force_z_rms_N, 1e-6);
}

// Loads that the equations cannot give: thrust that grows with an extra power of speed, as small propellers' does.
std::vector<LoadPoint> with_misfit() {
  std::vector<LoadPoint> points = flight(kTruth);
  for (LoadPoint& p : points) p.force_B_N *= std::pow(p.omega_rad_s[0] / 950.0, 0.2);
  return points;
}

double mean_square_N2(const std::vector<LoadPoint>& points, const host::ThrustModel& thrust, const host::DragModel& drag) {
  double sum = 0.0;
  for (const LoadPoint& p : points) {
    double total = 0.0;
    for (const double w : p.omega_rad_s) total += host::solve_thrust(thrust, w, p.v_B_m_s.z(), p.v_B_m_s.head<2>().norm()).thrust_N;
    sum += (p.force_B_N - Eigen::Vector3d(0, 0, total) - host::rotor_drag_B_N(drag, total, p.v_B_m_s) -
            host::airframe_drag_B_N(drag, p.v_B_m_s))
               .squaredNorm();
  }
  return sum / static_cast<double>(points.size());
}

TEST(FlownFit, NoNeighbourHasALessForceError) {
  const auto points = with_misfit();
  const FlownFit f = fit_flown(points, guess());
  host::ThrustModel thrust = guess().thrust;
  thrust.k1_N_s2 = f.k1_N_s2.value;
  thrust.k2_N_s2_m = f.k2_N_s2_m.value;
  host::DragModel drag{f.c_dh_s_m.value, f.c_dxy_N_s2_m2.value, f.c_dz_N_s2_m2.value};
  const double best = mean_square_N2(points, thrust, drag);
  EXPECT_NEAR(best, f.force_xy_rms_N * f.force_xy_rms_N + f.force_z_rms_N * f.force_z_rms_N, 1e-9);
  ASSERT_GT(best, 1e-4);  // there is a misfit to spread
  for (double* coefficient : {&thrust.k1_N_s2, &thrust.k2_N_s2_m, &drag.c_dh_s_m, &drag.c_dxy_N_s2_m2, &drag.c_dz_N_s2_m2})
    for (const double factor : {0.99, 1.01}) {
      const double kept = *coefficient;
      *coefficient *= factor;
      EXPECT_GT(mean_square_N2(points, thrust, drag), best);
      *coefficient = kept;
    }
}

TEST(FlownFit, ADragThatWouldBeNegativeIsHeldAtZero) {
  Truth pushed = kTruth;
  pushed.c_dz = -0.01;
  const FlownFit f = fit_flown(flight(pushed), guess());
  EXPECT_EQ(f.c_dz_N_s2_m2.value, 0.0);
  EXPECT_NEAR(f.c_dh_s_m.value / kTruth.c_dh, 1.0, 0.02);
}

TEST(FlownFit, VerticalFlightAloneDoesNotDetermineDragAcross) {
  EXPECT_THAT(test::error_of([] { fit_flown(flight(kTruth, 1e-3), guess()); }, ExitCode::data_quality), HasSubstr("leave c_d"));
}

TEST(FlownFit, PairsAlwaysAlikeCannotTellTheTorqueCoefficient) {
  auto points = flight(kTruth);
  for (LoadPoint& p : points) p.omega_rad_s.fill(p.omega_rad_s[0]);
  EXPECT_THAT(test::error_of([&] { fit_flown(points, guess()); }, ExitCode::data_quality), HasSubstr("hold no yaw torque"));
}

TEST(FlownFit, TwentyStatesAreTheLeast) {
  auto points = flight(kTruth);
  points.resize(19);
  EXPECT_THAT(test::error_of([&] { fit_flown(points, guess()); }, ExitCode::data_quality), HasSubstr("19 states, at least 20"));
}

TEST(FlownFit, GoesIntoTheVehicleFileWithCentreOfMassAndStaticThrust) {
  const host::VehicleFile base =
      host::read_vehicle(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/reference_cad.toml", host::builtin_effect_catalogue());
  const host::VehicleFile v = calibrated(base, fit_flown(with_misfit(), guess()), "a test", {});
  const host::VehicleFile back = host::parse_vehicle(host::vehicle_text(v), "written.toml", host::builtin_effect_catalogue());
  EXPECT_NEAR(back.com_offset_m[0].value, kTruth.com_x, 1e-4);
  EXPECT_EQ(back.com_offset_m[1].origin, host::Origin::stand);
  EXPECT_EQ(back.inertia_kg_m2, base.inertia_kg_m2);  // no load: left alone
  ASSERT_EQ(back.static_thrust.size(), 1u);
  EXPECT_NEAR(back.static_thrust[0].c_t_N_s2, host::static_c_t(host::to_model(back).thrust), 1e-18);
}

}  // namespace
}  // namespace rotorloop::calibrate
