// Inertia by bands: the truth from a rigid body, and that a moment which goes with velocity shows where it acts.
#include "bench/sysid/score/inertia_band.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

constexpr double kInertia = 1.6e-5, kArm_m = 0.0325, kCt = 3.7e-8;

estimate::ModelValues vehicle() {
  host::VehicleModel m;
  m.mass_kg = 0.037;
  m.inertia_kg_m2 = {kInertia, kInertia, 3e-5};
  const double sx[] = {1, -1, 1, -1}, sy[] = {-1, 1, 1, -1};
  for (std::size_t i = 0; i < 4; ++i) m.rotors[i] = {{kArm_m * sx[i], kArm_m * sy[i], 0}, i < 2 ? -1 : 1};
  m.thrust = {kCt, 0.0, 0.0275, 1.2};  // no inflow: T = c_t ω²
  return estimate::model_values(m);
}

// Twelve seconds of roll by tones of 0.7, 3.3 and 9 Hz in the rotor speeds; the body follows J Ω̇ = τ(t - delay) + slow_share τ of the slow
// tone.
log::FlightRecord rolling(double delay_s, double slow_share) {
  constexpr double kHover = 1565.0;
  const double f_Hz[] = {2.0 / 3.0, 10.0 / 3.0, 9.0}, amplitude[] = {3.0, 15.0, 40.0};
  log::FlightRecord record;
  record.name = record.source = "rolling";
  for (int k = 0; k <= 6000; ++k) {
    const double t = 0.002 * k;
    double swing = 0.0, rate = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double w = 2.0 * 3.14159265358979 * f_Hz[i], torque = 8.0 * kArm_m * kCt * kHover * amplitude[i];  // 4 rotors, 2 ω δω
      swing += amplitude[i] * std::sin(w * t);
      rate -= torque * (i == 0 ? 1.0 + slow_share : 1.0) / (kInertia * w) * std::cos(w * (t - delay_s));
    }
    record.rotor_omega_rad_s.add(t, {kHover - swing, kHover + swing, kHover + swing, kHover - swing});
    record.gyro_B_rad_s.add(t, {rate, 0.0, 0.0});
  }
  return record;
}

TEST(InertiaBand, RigidBodyHasItsInertiaInEveryBandWithinHalfAPercent) {
  const std::vector flights{rolling(0.0, 0.0)};
  for (const auto& [from, to] : {std::pair{0.5, 1.5}, {2.0, 15.0}, {5.0, 15.0}}) {
    const BandInertia b = inertia_in_band(flights, vehicle(), {.axis = 0, .from_Hz = from, .to_Hz = to, .delay_s = 0.0});
    EXPECT_NEAR(b.inertia_kg_m2, kInertia, 5e-3 * kInertia) << from;
    EXPECT_GT(b.explained, 0.999);
  }
}

TEST(InertiaBand, DelayOf6msIsFoundAndDoesNotMoveTheInertia) {
  const std::vector flights{rolling(0.006, 0.0)};
  const BandInertia b = inertia_in_band(flights, vehicle(), {.axis = 0, .from_Hz = 2.0, .to_Hz = 15.0, .delay_s = {}});
  EXPECT_NEAR(b.delay_s, 0.006, 5e-4);
  EXPECT_NEAR(b.inertia_kg_m2, kInertia, 5e-3 * kInertia);
}

TEST(InertiaBand, MomentThatTakesHalfOfTheSlowTorqueDoublesTheSlowInertiaOnly) {
  const std::vector flights{rolling(0.0, -0.5)};
  const BandInertia slow = inertia_in_band(flights, vehicle(), {.axis = 0, .from_Hz = 0.5, .to_Hz = 1.5, .delay_s = 0.0});
  const BandInertia fast = inertia_in_band(flights, vehicle(), {.axis = 0, .from_Hz = 5.0, .to_Hz = 15.0, .delay_s = 0.0});
  EXPECT_NEAR(slow.inertia_kg_m2, 2.0 * kInertia, 0.02 * kInertia);
  EXPECT_NEAR(fast.inertia_kg_m2, kInertia, 5e-3 * kInertia);
}

TEST(InertiaBand, ArmScalesTheInertiaOneToOne) {
  estimate::ModelValues wide = vehicle();
  for (auto& r : wide.geometry.rotors) r.position_m *= 1.1;
  const std::vector flights{rolling(0.0, 0.0)};
  const InertiaBand band{.axis = 0, .from_Hz = 2.0, .to_Hz = 15.0, .delay_s = 0.0};
  EXPECT_NEAR(inertia_in_band(flights, wide, band).inertia_kg_m2 / inertia_in_band(flights, vehicle(), band).inertia_kg_m2, 1.1, 1e-9);
}

TEST(InertiaBand, FlightShorterThanASegmentIsRefusedWithTheSegmentNamed) {
  log::FlightRecord record = rolling(0.0, 0.0);
  record.gyro_B_rad_s.t_s.resize(1000);
  record.gyro_B_rad_s.value.resize(1000);
  try {
    inertia_in_band(std::vector{record}, vehicle(), {});
    FAIL() << "answered";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
    EXPECT_NE(std::string(e.what()).find("3.0 s"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace rotorloop::score
