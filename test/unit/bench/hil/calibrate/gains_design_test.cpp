// Designed gains: margins checked by a simulation in time of the axis itself, with lag and delay, not by a second frequency response.
#include "bench/hil/calibrate/gains_design.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <string>

#include "host/base/error.hpp"
#include "host/control/gains_file.hpp"
#include "host/vehicle/effect_catalogue.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::calibrate {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

host::VehicleModel shipped(const std::string& path) {
  return host::to_model(host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/" + path, host::builtin_effect_catalogue()));
}

constexpr ActuatorDynamics kReference{.lag_s = 0.010, .delay_s = 0.003, .omega_max_rad_s = 1780.0};

// One axis from an error of 1: angle after `seconds`, largest over the last tenth of it. `gain` multiplies what the actuator gives.
double swing_at_end(const host::AxisGains& g, const ActuatorDynamics& a, double gain, double extra_delay_s = 0.0) {
  constexpr double kStep_s = 1e-4, kSeconds = 12.0;
  std::deque<double> waiting(static_cast<std::size_t>((a.delay_s + extra_delay_s) / kStep_s), 0.0);
  double angle = 1.0, rate = 0.0, acceleration = 0.0, largest = 0.0;
  for (double t = 0.0; t < kSeconds; t += kStep_s) {
    waiting.push_back(-gain * (g.kp() * angle + g.kd() * rate));
    acceleration += kStep_s / a.lag_s * (waiting.front() - acceleration);
    waiting.pop_front();
    rate += kStep_s * acceleration;
    angle += kStep_s * rate;
    if (t > 0.9 * kSeconds) largest = std::fmax(largest, std::fabs(angle));
  }
  return largest;
}

TEST(GainsDesign, AttitudeOscillatesJustBeyondTheGainFactorThatIsStatedAndNotBelowIt) {
  const DesignedLoop loop = design_gains(shipped("calibrated.toml"), kReference).roll_pitch;
  EXPECT_LT(swing_at_end(loop.gains, kReference, 0.95 * loop.margins.gain_factor), 1e-2);
  EXPECT_GT(swing_at_end(loop.gains, kReference, 1.05 * loop.margins.gain_factor), 1.0);
}

TEST(GainsDesign, AttitudeOscillatesJustBeyondTheDelayThatItsPhaseMarginIsWorth) {
  const DesignedLoop loop = design_gains(shipped("calibrated.toml"), kReference).roll_pitch;
  const double delay_s = loop.margins.phase_deg / 57.29578 / loop.margins.crossover_rad_s;
  EXPECT_LT(swing_at_end(loop.gains, kReference, 1.0, 0.93 * delay_s), 1e-2);
  EXPECT_GT(swing_at_end(loop.gains, kReference, 1.0, 1.07 * delay_s), 1.0);
}

TEST(GainsDesign, EveryVehicleKeepsTheMarginsAndEndsInAFileThatTheControllerReads) {
  for (const char* path : {"calibrated.toml", "quad_3in/calibrated.toml", "quad_7in/calibrated.toml", "quad_10in/calibrated.toml",
                           "quad_17in/calibrated.toml"}) {
    ActuatorDynamics a{.lag_s = 0.012, .delay_s = 0.003};
    const host::VehicleModel vehicle = shipped(path);
    a.omega_max_rad_s = 1.8 * std::sqrt(vehicle.weight_N() / 4.0 / (0.6 * vehicle.thrust.k1_N_s2));  // some three times the weight
    const GainsDesign d = design_gains(vehicle, a);
    for (const DesignedLoop& loop : {d.roll_pitch, d.yaw}) {
      EXPECT_GE(loop.margins.phase_deg, kLeastPhase_deg) << path;
      EXPECT_GE(loop.margins.gain_factor, kLeastGainFactor) << path;
    }
    EXPECT_GE(d.horizontal.margins.phase_deg, kLeastOuterPhase_deg) << path;
    const host::GainsFile read = host::parse_gains(gains_text(d, path, a), "gains.toml");
    EXPECT_DOUBLE_EQ(read.gains.roll_pitch.frequency_rad_s, d.roll_pitch.gains.frequency_rad_s) << path;
    EXPECT_LE(read.limits.total_max_weight, d.thrust_to_weight) << path;
  }
}

TEST(GainsDesign, SlowerRotorsGiveSlowerLoops) {
  ActuatorDynamics slow = kReference;
  slow.lag_s = 0.030;
  const GainsDesign quick = design_gains(shipped("calibrated.toml"), kReference), late = design_gains(shipped("calibrated.toml"), slow);
  EXPECT_LT(late.roll_pitch.gains.frequency_rad_s, 0.6 * quick.roll_pitch.gains.frequency_rad_s);
  EXPECT_LT(late.horizontal.gains.frequency_rad_s, quick.horizontal.gains.frequency_rad_s);
}

TEST(GainsDesign, ASpeedLimitThatLeavesNoThrustToSteerWithIsRefusedWithBothFigures) {
  ActuatorDynamics weak = kReference;
  weak.omega_max_rad_s = 1000.0;  // hover at 939
  try {
    design_gains(shipped("calibrated.toml"), weak);
    ADD_FAILURE() << "accepted";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("1000 rad/s"), HasSubstr("times the weight, at least 1.3 is needed"),
                                HasSubstr("raise the highest speed")));
  }
}

}  // namespace
}  // namespace rotorloop::calibrate
