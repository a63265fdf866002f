// gains.toml: what is refused, and that the shipped gains are stable with the lags of the real loop, by frequency response
// computed here from the gains alone.
#include "host/control/gains_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <fstream>
#include <numbers>
#include <sstream>

#include "host/base/error.hpp"

namespace rotorloop::host {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kShippedGains = std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/gains.toml";

std::string refusal(const std::string& from, const std::string& to) {
  std::ifstream in(kShippedGains);
  std::ostringstream all;
  all << in.rdbuf();
  std::string text = all.str();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  try {
    parse_gains(text, "gains.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "accepted";
}

TEST(GainsFile, RefusesAnAttitudeLoopTooSlowForThePositionLoop) {
  EXPECT_THAT(refusal("frequency_rad_s = 20.0", "frequency_rad_s = 12.0"),
              AllOf(HasSubstr("roll_pitch.frequency_rad_s = 12 rad/s is less than 4 times horizontal.frequency_rad_s = 3.4 rad/s"),
                    HasSubstr("raise roll_pitch")));
}

TEST(GainsFile, RefusesSwappedSpeedLimitsRangesAndUnknownKeys) {
  EXPECT_THAT(refusal("omega_min_rad_s = 250.0", "omega_min_rad_s = 2500.0"), HasSubstr("is not below limits.omega_max_rad_s"));
  EXPECT_THAT(refusal("damping = 0.8", "damping = 80"), HasSubstr("horizontal.damping = 80 is outside 0.3 to 2"));
  EXPECT_THAT(refusal("damping = 0.8", "damping = 0.8\nintegral = 1.0"), HasSubstr("unknown key \"horizontal.integral\""));
}

// Loop gain of one attitude axis: PD over a double integrator, behind motor lag and dead time. `lead_s`: reaction torque of
// spinning the rotors up, J_r / (2 c_q ω), which multiplies yaw torque by 1 + lead s; `shaping_s`: how the controller softens it.
struct Margin {
  double crossover_rad_s, phase_deg, gain;
};
Margin margin(const AxisGains& g, double lag_s, double delay_s, double lead_s = 0.0, double shaping_s = 0.0) {
  using C = std::complex<double>;
  const auto loop = [&](double w) {
    const C s(0.0, w);
    return (g.kp() + g.kd() * s) / (s * s) * (1.0 + lead_s * s) / (1.0 + shaping_s * s) / (1.0 + lag_s * s) * std::exp(-delay_s * s);
  };
  Margin m{0.0, 180.0, 1e9};
  double last_phase = -180.0 + 1e-9;
  for (double w = 0.5; w < 3000.0; w *= 1.001) {
    const C l = loop(w);
    double phase = std::arg(l) * 180.0 / std::numbers::pi;
    while (phase - last_phase > 180.0) phase -= 360.0;
    while (phase - last_phase < -180.0) phase += 360.0;
    if (std::abs(l) >= 1.0) {
      m.crossover_rad_s = w;
      m.phase_deg = 180.0 + phase;
    } else if (last_phase > -180.0 && phase <= -180.0) {
      m.gain = std::fmin(m.gain, 1.0 / std::abs(l));
    }
    last_phase = phase;
  }
  return m;
}

TEST(ShippedGains, RollAndPitchKeep40DegreesAndGainFactor3With10msLagAnd3msDelay) {
  const Margin m = margin(read_gains(kShippedGains).gains.roll_pitch, 0.010, 0.003);
  EXPECT_GT(m.phase_deg, 40.0);
  EXPECT_GT(m.gain, 3.0);
  EXPECT_GT(m.crossover_rad_s, 25.0);
  EXPECT_GT(margin(read_gains(kShippedGains).gains.roll_pitch, 0.020, 0.005).phase_deg, 20.0);  // a tired motor
}

TEST(ShippedGains, YawKeeps35DegreesWhetherOrNotTheRotorsReact) {
  const AxisGains yaw = read_gains(kShippedGains).gains.yaw;
  for (const double lead_s : {0.0, 0.16, 0.29})  // none; the paper's c_q; 1.7e-8 N m s²
    for (const double lag_s : {0.010, 0.015})
      EXPECT_GT(margin(yaw, lag_s, 0.003, lead_s, kYawShapingMax_s).phase_deg, 34.0) << lead_s << ' ' << lag_s;
  // Cancelling the reaction that the vehicle file has would leave nothing when it is not there.
  EXPECT_LT(margin(yaw, 0.010, 0.003, 0.0, 0.29).phase_deg, 5.0);
  // Without softening the loop would cross over at the motors' own lag, and as fast as roll and pitch it would not hold at all.
  EXPECT_GT(margin(yaw, 0.010, 0.003, 0.29).crossover_rad_s, 200.0);
  EXPECT_LT(margin(yaw, 0.010, 0.003, 0.29, kYawShapingMax_s).crossover_rad_s, 80.0);
  EXPECT_LT(margin(read_gains(kShippedGains).gains.roll_pitch, 0.010, 0.003, 0.16).phase_deg, 20.0);
}

TEST(ShippedGains, LieInTheBandsOfTheirGroups) {
  const Gains g = read_gains(kShippedGains).gains;
  EXPECT_TRUE(g.horizontal.frequency_rad_s >= 2.4 && g.horizontal.frequency_rad_s <= 3.5);
  EXPECT_TRUE(g.vertical.frequency_rad_s >= 2.8 && g.vertical.frequency_rad_s <= 4.5);
  for (const AxisGains& a : {g.horizontal, g.vertical, g.roll_pitch, g.yaw}) EXPECT_TRUE(a.damping >= 0.7 && a.damping <= 1.0);
}

}  // namespace
}  // namespace rotorloop::host
