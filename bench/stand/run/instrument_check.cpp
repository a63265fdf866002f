#include "bench/stand/run/instrument_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/stand/run/prediction.hpp"
#include "bench/stand/run_folder.hpp"

namespace rotorloop::stand_run {
namespace {

constexpr double kLoaded = 0.7;         // of the plan's highest speed, half of its thrust: from here on sizes are judged
constexpr double kFactor = 3.0;         // from coefficients that the stand file gives
constexpr double kFactorTypical = 6.0;  // from those of any propeller of the diameter: its own are known to a factor of two
// Besides: running torque of wires and bearings, zeros that drift, rounding; a small propeller's torque may be no more than that.
constexpr double kOffsetShare = 0.004, kOffset_N = 0.05, kOffset_N_m = 0.01;  // of full scale, and at least
constexpr double kSupply = 1.35;                                   // voltage of supply and ESC: 40 A through 50 mohm of cable are 2 V of 16
constexpr double kCurrent = 4.0, kCurrent_A = 1.0;                 // of supply and ESC: some ESCs tell a current of few digits
constexpr double kLeastEfficiency = 0.12, kMostEfficiency = 1.25;  // torque may be a third off by wires and bearings at low load
constexpr double kSpreads = 4.0;                                   // that a change of speed must have moved a channel by
constexpr double kSpeedsNever = 1.3;                               // speeds between which a channel that never moved must have

struct Column {
  std::size_t index;
  const char *name, *unit;
};
constexpr Column kMoving[] = {{stand::kThrustColumn, "thrust", "(before calibration)"},
                              {stand::kTorqueColumn, "torque", "(before calibration)"},
                              {stand::kCurrentColumn, "current", "A"},
                              {stand::kIndependentColumn, "rotor_speed", "rad/s"}};

bool beyond(double ratio, double factor) { return ratio > factor || ratio < 1.0 / factor; }

double offset(double full_scale, double least) { return std::max(kOffsetShare * full_scale, least); }

std::string off_propeller(const char* name, const char* unit, double value, double expected, double omega_rad_s, bool typical) {
  return fmt::format(
      "{}: {:.4g} {} at {:.0f} rad/s, {:.2g} times the {:.4g} {} of {}; likely: decimal point or unit of the indicator, two channels "
      "exchanged, an overload, or another propeller than the file's (then give it expected_c_t_N_s2 and expected_c_q_N_m_s2)",
      name, value, unit, omega_rad_s, value / expected, expected, unit,
      typical ? "a propeller of this diameter" : "the stand file's expected coefficients");
}

}  // namespace

std::string InstrumentCheck::hold(const StepMeans& s) {
  if (s.wanted_rad_s == 0.0) {
    zero_N_ = s.thrust_N;
    zero_N_m_ = s.torque_N_m;
    return {};
  }
  std::string found = stands_still(s);
  // What stands behind the rotor in configuration B may take what it likes.
  if (s.configuration != 'A' || s.omega_rad_s < kLoaded * top_rad_s_) return found;
  if (found.empty()) found = of_propeller(s);
  return found.empty() ? of_supply(s) : found;
}

std::string InstrumentCheck::stands_still(const StepMeans& s) {
  for (const Column& c : kMoving) {
    Still& still = still_[c.index];
    const auto [low, high] = s.shown[c.index];
    if (!(low <= high)) continue;  // nothing shown
    if (low != high) {
      still.spread = still.spread > 0.0 ? std::min(still.spread, high - low) : high - low;
      still.has = false;
      continue;
    }
    if (!still.has || still.value != low) {
      still.slowest_rad_s = still.fastest_rad_s = s.omega_rad_s;
      still.value = low;
      still.has = true;
      continue;
    }
    still.slowest_rad_s = std::min(still.slowest_rad_s, s.omega_rad_s);
    still.fastest_rad_s = std::max(still.fastest_rad_s, s.omega_rad_s);
    const double ratio = still.fastest_rad_s / still.slowest_rad_s;
    const bool moved = still.spread > 0.0 ? std::abs(low) * (ratio * ratio - 1.0) > kSpreads * still.spread : ratio > kSpeedsNever;
    if (moved && still.fastest_rad_s > 0.5 * top_rad_s_)
      return fmt::format(
          "{}: shows {:.6g} {} and nothing else while the speed goes from {:.0f} to {:.0f} rad/s; likely: the instrument stands still, or "
          "is at the end of its range",
          c.name, low, c.unit, still.slowest_rad_s, still.fastest_rad_s);
  }
  return {};
}

std::string InstrumentCheck::of_propeller(const StepMeans& s) const {
  const ExpectedCoefficients e = expected_coefficients(setup_);
  const double square = s.omega_rad_s * s.omega_rad_s, thrust = std::abs(s.thrust_N - zero_N_), torque = std::abs(s.torque_N_m - zero_N_m_);
  const auto off = [&](double value, double expected, double offset, bool typical) {
    const double factor = typical ? kFactorTypical : kFactor;
    return value - offset > factor * expected || (!in_wind_ && factor * (value + offset) < expected);
  };
  const auto& full = setup_.calibration.full_scale;
  if (off(thrust, e.c_t_N_s2 * square, offset(full[0], kOffset_N), e.typical_c_t))
    return off_propeller("thrust", "N", thrust, e.c_t_N_s2 * square, s.omega_rad_s, e.typical_c_t);
  if (off(torque, e.c_q_N_m_s2 * square, offset(full[1], kOffset_N_m), e.typical_c_q))
    return off_propeller("torque", "N m", torque, e.c_q_N_m_s2 * square, s.omega_rad_s, e.typical_c_q);
  return {};
}

// An ESC that tells no voltage or no current says 0 or not-a-number.
std::string InstrumentCheck::of_supply(const StepMeans& s) const {
  const double V = s.voltage_V, A = s.current_A;
  if (V == V && s.esc_voltage_V > 1.0 && beyond(V / s.esc_voltage_V, kSupply))
    return fmt::format(
        "voltage: the supply shows {:.4g} V, the ESC {:.4g} V; likely: decimal point or unit of one of them, or two channels "
        "exchanged",
        V, s.esc_voltage_V);
  if (A == A && s.esc_current_A > 0.0 && beyond(A / s.esc_current_A, kCurrent) && std::abs(A - s.esc_current_A) > kCurrent_A)
    return fmt::format("current: the supply shows {:.4g} A, the ESC {:.4g} A; likely: decimal point or unit of one of them, or an overload",
                       A, s.esc_current_A);
  if (V != V || A != A) return {};
  const double shaft_W = std::abs(s.torque_N_m - zero_N_m_) * s.omega_rad_s, power_W = V * A;
  const double offset_W = offset(setup_.calibration.full_scale[1], kOffset_N_m) * s.omega_rad_s;
  if (shaft_W - offset_W > kMostEfficiency * power_W || (!in_wind_ && shaft_W + offset_W < kLeastEfficiency * power_W))
    return fmt::format(
        "power: torque and speed make {:.4g} W of the {:.4g} W that the supply shows at {:.0f} rad/s (allowed {:.0f} to {:.0f} "
        "%); likely: decimal point or unit of torque, voltage or current",
        shaft_W, power_W, s.omega_rad_s, 100.0 * kLeastEfficiency, 100.0 * kMostEfficiency);
  return {};
}

}  // namespace rotorloop::stand_run
