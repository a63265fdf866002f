// Inertia by bands against the fit's: what a missing moment of low frequency does to it, and what is held where the flights want what
// cannot be.
#include "bench/sysid/identify/inertia_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace rotorloop::identify {
namespace {

constexpr double kInertia = 1.6e-5, kArm_m = 0.0325, kCt = 3.7e-8, kHover_rad_s = 1565.0;

estimate::ModelValues vehicle() {
  host::VehicleModel m;
  m.mass_kg = 0.037;
  m.inertia_kg_m2 = {kInertia, kInertia, 3e-5};
  const double sx[] = {1, -1, 1, -1}, sy[] = {-1, 1, 1, -1};
  for (std::size_t i = 0; i < 4; ++i) m.rotors[i] = {{kArm_m * sx[i], kArm_m * sy[i], 0}, i < 2 ? -1 : 1};
  m.thrust = {kCt, 0.0, 0.0275, 1.2};  // no inflow: T = c_t ω²
  m.c_q_N_m_s2 = 2.2e-10;
  return estimate::model_values(m);
}

// Twelve seconds of roll by tones of 1, 6 and 11 Hz; `slow_share` of the slow torque is taken by a moment that the model lacks.
log::FlightRecord rolling(double slow_share, bool with_gyro) {
  const double f_Hz[] = {1.0, 6.0, 11.0}, amplitude[] = {3.0, 20.0, 40.0};
  log::FlightRecord record;
  record.name = record.source = "rolling";
  for (int k = 0; k <= 6000; ++k) {
    const double t = 0.002 * k;
    double swing = 0.0, rate = 0.0, angle = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double w = 2.0 * 3.14159265358979 * f_Hz[i],
                   torque = 8.0 * kArm_m * kCt * kHover_rad_s * amplitude[i] * (i == 0 ? 1.0 - slow_share : 1.0);
      swing += amplitude[i] * std::sin(w * t);
      rate -= torque / (kInertia * w) * std::cos(w * t);
      angle -= torque / (kInertia * w * w) * std::sin(w * t);
    }
    record.rotor_omega_rad_s.add(t, {kHover_rad_s - swing, kHover_rad_s + swing, kHover_rad_s + swing, kHover_rad_s - swing});
    if (with_gyro) record.gyro_B_rad_s.add(t, {rate, 0.0, 0.0});
    if (k % 5 == 0) record.pose.add(t, {Eigen::Vector3d::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()))});
  }
  return record;
}

InertiaCheck checked(const log::FlightRecord& record, const estimate::Fit* fit) {
  const std::vector<estimate::GridFlight> grid{estimate::make_grid(record, {.rate_Hz = 100.0, .use_gyro = !record.gyro_B_rad_s.empty()})};
  const std::vector<std::vector<estimate::BodyState>> states{std::vector<estimate::BodyState>(grid.front().nodes)};
  const std::vector values{vehicle()};
  const std::vector<const log::FlightRecord*> records{&record};
  return check_inertia(records, grid, states, values, fit);
}

estimate::Fit fit_with(std::vector<estimate::Estimate> estimates) {
  estimate::Fit fit;
  fit.values = {vehicle()};
  for (const estimate::Estimate& e : estimates) fit.values.front()[e.parameter] = e.value;
  fit.estimates = std::move(estimates);
  return fit;
}

const std::vector<estimate::FreeParameter> kFree{{estimate::kIxx}, {estimate::kIyy}, {estimate::kIzz}, {estimate::kCq}};

TEST(InertiaCheck, MomentThatTakesMostOfTheTorqueAt1HzLeavesTheInertiaOf5To15HzWithin1percent) {
  const estimate::Fit fit = fit_with({{.parameter = estimate::kIxx, .value = 7.9e-5, .u = 2e-6, .u_robust = 1e-5}});
  const InertiaCheck c = checked(rolling(0.9, true), &fit);
  const InertiaByBand* roll = c.of(estimate::kIxx);
  ASSERT_TRUE(roll);
  EXPECT_NEAR(roll->value, kInertia, 0.01 * kInertia);
  EXPECT_TRUE(roll->taken);
  EXPECT_TRUE(c.needed);
}

TEST(InertiaCheck, AttitudeOfPosesAt100HzInPlaceOfTheGyroFindsItWithin2percent) {
  const InertiaCheck c = checked(rolling(0.9, false), nullptr);
  const InertiaByBand* roll = c.of(estimate::kIxx);
  ASSERT_TRUE(roll);
  EXPECT_NEAR(roll->value, kInertia, 0.02 * kInertia);
}

TEST(InertiaCheck, FitThatAgreesAndIsSurerThanTheBandIsKept) {
  const estimate::Fit fit = fit_with({{.parameter = estimate::kIxx, .value = 1.602e-5, .u = 1e-7, .u_robust = 1e-7}});
  const InertiaCheck c = checked(rolling(0.0, true), &fit);
  ASSERT_TRUE(c.of(estimate::kIxx));
  EXPECT_FALSE(c.of(estimate::kIxx)->taken);
  EXPECT_FALSE(c.needed);
  EXPECT_TRUE(priors_of(c, {}, kFree, vehicle()).empty());
}

TEST(InertiaCheck, PitchThatNoTorqueMovesIsNotDetermined) { EXPECT_FALSE(checked(rolling(0.0, true), nullptr).of(estimate::kIyy)); }

TEST(InertiaCheck, GuessedIZzIsTiedToTheOtherTwoAndADrawnOneIsKept) {
  host::VehicleFile file;
  file.inertia_kg_m2[2] = {3e-5, 1e-5, host::Origin::guess};
  file.c_q_N_m_s2 = {2.2e-10, 1e-10, host::Origin::guess};
  const InertiaCheck c{.axes = {{.parameter = estimate::kIxx, .value = kInertia, .u = 5e-7, .taken = true}}, .needed = true};
  const auto izz_of = [&] {
    for (const estimate::JointPrior& p : priors_of(c, file, kFree, vehicle())) {
      if (p.parameters.back() == estimate::kIzz) return p;
    }
    return estimate::JointPrior{};
  };
  EXPECT_EQ(izz_of().parameters, (std::vector<int>{estimate::kIxx, estimate::kIyy, estimate::kIzz}));
  file.inertia_kg_m2[2].origin = host::Origin::cad;
  EXPECT_EQ(izz_of().parameters, std::vector<int>{estimate::kIzz});
  EXPECT_DOUBLE_EQ(izz_of().mean[0], vehicle()[estimate::kIzz]);
}

TEST(InertiaCheck, InertiaOfABandGoesWithAFreeMassSoThatNoMissingMomentPullsAtIt) {
  const InertiaCheck c{
      .axes = {{.parameter = estimate::kIxx, .value = kInertia, .u = 5e-7, .taken = true}}, .needed = true, .mass_kg = 0.037};
  auto free = kFree;
  EXPECT_EQ(priors_of(c, {}, free, vehicle()).front().parameters, std::vector<int>{estimate::kIxx});
  free.push_back({estimate::kMass});
  const estimate::JointPrior p = priors_of(c, {}, free, vehicle()).front();
  ASSERT_EQ(p.parameters, (std::vector<int>{estimate::kMass, estimate::kIxx}));
  const Eigen::Vector2d heavier(0.037 * 1.02, kInertia * 1.02);
  EXPECT_NEAR((heavier - p.mean).dot(p.information * (heavier - p.mean)), 0.0, 1e-9);
}

TEST(PossibleVehicle, DragOfMinusFiveUIsHeldAtZeroAndOfMinusOneUIsLeftToTheWriterOfTheFile) {
  std::vector<estimate::Estimate> held;
  const estimate::Fit fit =
      fit_with({{.parameter = estimate::kCdh, .value = -5e-3, .u = 1e-3}, {.parameter = estimate::kCdz, .value = -1e-3, .u = 1e-3}});
  const auto priors = priors_of_the_possible(fit, {}, vehicle(), held);
  ASSERT_EQ(priors.size(), 1u);
  EXPECT_EQ(priors.front().parameters, std::vector<int>{estimate::kCdh});
  EXPECT_NEAR(priors.front().mean[0], 0.0, 2e-5);
  ASSERT_EQ(held.size(), 1u);
  EXPECT_DOUBLE_EQ(held.front().value, -5e-3);
}

TEST(PossibleVehicle, TorqueCoefficientOfAFigureOfMeritOfTwentyIsReplacedByTheFiles) {
  host::VehicleFile file;
  file.c_q_N_m_s2 = {2.2e-10, 1e-10, host::Origin::guess};
  std::vector<estimate::Estimate> held;
  const auto priors = priors_of_the_possible(fit_with({{.parameter = estimate::kCq, .value = 6e-12, .u = 3e-12}}), file, vehicle(), held);
  ASSERT_EQ(priors.size(), 1u);
  EXPECT_DOUBLE_EQ(priors.front().mean[0], 2.2e-10);
  held.clear();
  EXPECT_TRUE(priors_of_the_possible(fit_with({{.parameter = estimate::kCq, .value = 2e-10, .u = 3e-12}}), file, vehicle(), held).empty());
}

}  // namespace
}  // namespace rotorloop::identify
