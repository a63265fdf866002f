#include "bench/hil/calibrate/gains_design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "host/base/error.hpp"
#include "host/control/mixer.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::calibrate {
namespace {

using Complex = std::complex<double>;

constexpr double kAttitudeDamping = 0.9, kPositionDamping = 0.8;
constexpr double kVerticalOverHorizontal =
    1.2;  // thrust answers without a tilt in between; more would shake the rotors with the pose's noise
constexpr double kFastestAttitude_rad_s = 60.0, kSlowest_rad_s = 0.5;
constexpr double kLeastThrustToWeight = 1.3;
constexpr double kSlowestSpeedShare = 0.28;  // of hover: the least set-point in flight, where thrust is under a tenth of the weight's share
constexpr double kSteeringShare = 0.1;       // of the highest thrust, kept for roll and pitch when all else is asked for
constexpr double kMostTilt_deg = 65.0;

// Walks up in frequency; the phase is followed continuously from -180 degrees of the double integrator.
template <class Loop>
LoopMargins margins_of(const Loop& loop) {
  LoopMargins m{.crossover_rad_s = 0.0, .phase_deg = 180.0, .gain_factor = std::numeric_limits<double>::infinity()};
  double last_deg = -180.0 + 1e-9;
  for (double w = 0.02; w < 5000.0; w *= 1.002) {
    const Complex l = loop(Complex(0.0, w));
    double deg = std::arg(l) * 180.0 / std::numbers::pi;
    deg -= 360.0 * std::round((deg - last_deg) / 360.0);
    if (std::abs(l) >= 1.0) {
      m.crossover_rad_s = w;
      m.phase_deg = 180.0 + deg;
    } else if (last_deg > -180.0 && deg <= -180.0) {
      m.gain_factor = std::min(m.gain_factor, 1.0 / std::abs(l));
    }
    last_deg = deg;
  }
  return m;
}

Complex pd(const host::AxisGains& g, Complex s) { return (g.kp() + g.kd() * s) / (s * s); }

Complex rotor(const ActuatorDynamics& a, Complex s) { return std::exp(-a.delay_s * s) / (1.0 + a.lag_s * s); }

struct Authority {
  double hover_rad_s, hover_N, most_N, least_rad_s;  // of one rotor in still air
};

Authority authority(const host::VehicleModel& v, const ActuatorDynamics& a) {
  const double hover = host::Mixer(v, {.lookup = host::ThrustLookup::still_air}).hover_omega_rad_s();
  return {hover, 0.25 * v.weight_N(), host::solve_thrust(v.thrust, a.omega_max_rad_s, 0.0, 0.0).thrust_N, kSlowestSpeedShare * hover};
}

// Angular acceleration over kStep_rad gives the square of the highest frequency: kp times the error is all the torque there is.
double frequency_of_torque(double torque_N_m, double inertia_kg_m2) { return std::sqrt(torque_N_m / inertia_kg_m2 / kStep_rad); }

// Of the slower of roll and pitch: two rotors up and two down from hover, as far as both can go.
double roll_pitch_frequency(const host::VehicleModel& v, const Authority& a) {
  const double change_N = std::min(a.most_N - a.hover_N, a.hover_N * (1.0 - kSlowestSpeedShare * kSlowestSpeedShare));
  double roll_m = 0.0, pitch_m = 0.0;
  for (int r = 0; r < host::kRotors; ++r) {
    roll_m += std::fabs(v.arm_m(r).y());
    pitch_m += std::fabs(v.arm_m(r).x());
  }
  return std::min(frequency_of_torque(change_N * roll_m, v.inertia_kg_m2.x()),
                  frequency_of_torque(change_N * pitch_m, v.inertia_kg_m2.y()));
}

double yaw_frequency(const host::VehicleModel& v, const Authority& a, double omega_max_rad_s) {
  const double up = omega_max_rad_s * omega_max_rad_s - a.hover_rad_s * a.hover_rad_s;
  const double down = a.hover_rad_s * a.hover_rad_s - a.least_rad_s * a.least_rad_s;
  return frequency_of_torque(4.0 * v.c_q_N_m_s2 * std::min(up, down), v.inertia_kg_m2.z());
}

// The fastest loop up to `most_rad_s` that has both margins.
template <class Margins>
DesignedLoop fastest(double damping, double most_rad_s, const char* most_because, double phase_deg, const Margins& margins) {
  const auto loop = [&](double w) {
    const host::AxisGains g{.frequency_rad_s = w, .damping = damping};
    return DesignedLoop{g, margins(g), most_because};
  };
  const auto good = [&](const DesignedLoop& l) { return l.margins.phase_deg >= phase_deg && l.margins.gain_factor >= kLeastGainFactor; };
  DesignedLoop best = loop(most_rad_s);
  if (good(best)) return best;
  double low = 0.0, high = most_rad_s;
  for (int k = 0; k < 40; ++k) (good(loop(0.5 * (low + high))) ? low : high) = 0.5 * (low + high);
  const bool phase = loop(1.01 * high).margins.phase_deg < phase_deg;
  best = loop(low);
  best.limited_by = phase ? "phase margin" : "gain margin";
  return best;
}

// Files show a tenth; rounding down keeps the margins.
double tenth_below(double value) { return std::max(kSlowest_rad_s, std::floor(10.0 * value + 1e-9) / 10.0); }

void check(const host::VehicleModel& v, const ActuatorDynamics& a, double thrust_to_weight) {
  const auto outside = [](const char* what, double value, const char* unit, const char* range, const char* remedy) {
    throw Error({"", fmt::format("{} is {:.4g} {}, allowed is {}", what, value, unit, range), "", remedy});
  };
  if (!(a.lag_s >= 0.001 && a.lag_s <= 0.3))
    outside("the rotors' lag", a.lag_s, "s", "0.001 to 0.3 s", "give the time constant of a small step");
  if (!(a.delay_s >= 0.0005 && a.delay_s <= 0.05))
    outside("the loop's delay", a.delay_s, "s", "0.0005 to 0.05 s", "give the delay from gyro to ESC");
  if (!(v.inertia_kg_m2.minCoeff() > 0.0))
    outside("the least moment of inertia", v.inertia_kg_m2.minCoeff(), "kg m²", "above 0", "correct the vehicle file");
  if (thrust_to_weight < kLeastThrustToWeight)
    throw Error(
        {"",
         fmt::format("at {:.0f} rad/s ({:.0f} RPM) the rotors lift {:.2f} times the weight, at least {} is needed to climb and steer",
                     a.omega_max_rad_s, a.omega_max_rad_s * 30.0 / std::numbers::pi, thrust_to_weight, kLeastThrustToWeight),
         "speed limit too low, or a thrust model of another propeller", "raise the highest speed, or correct k1, k2 and mass"});
}

}  // namespace

LoopMargins attitude_margins(const host::AxisGains& g, const ActuatorDynamics& a, double lead_s, double shaping_s) {
  return margins_of([&](Complex s) { return pd(g, s) * rotor(a, s) * (1.0 + lead_s * s) / (1.0 + shaping_s * s); });
}

LoopMargins position_margins(const host::AxisGains& g, const host::AxisGains& roll_pitch, const ActuatorDynamics& a) {
  return margins_of([&](Complex s) {
    const Complex inner = pd(roll_pitch, s) * rotor(a, s);
    return pd(g, s) * inner / (1.0 + inner);
  });
}

GainsDesign design_gains(const host::VehicleModel& v, const ActuatorDynamics& a) {
  const Authority rotor = authority(v, a);
  GainsDesign d;
  d.hover_rad_s = rotor.hover_rad_s;
  d.thrust_to_weight = 4.0 * rotor.most_N / v.weight_N();
  check(v, a, d.thrust_to_weight);
  const auto round = [](DesignedLoop& l, const auto& margins) {
    l.gains.frequency_rad_s = tenth_below(l.gains.frequency_rad_s);
    l.margins = margins(l.gains);
  };

  const auto attitude = [&](const host::AxisGains& g) { return attitude_margins(g, a); };
  d.roll_pitch = fastest(kAttitudeDamping, std::min(kFastestAttitude_rad_s, roll_pitch_frequency(v, rotor)), "torque in hover",
                         kLeastPhase_deg, attitude);
  round(d.roll_pitch, attitude);

  // The reaction need not be as strong as the model says: the loop keeps its margins with none of it as well.
  const double lead_s = v.rotor_inertia_kg_m2 / (2.0 * v.c_q_N_m_s2 * rotor.hover_rad_s),
               shaping_s = std::min(lead_s, host::kYawShapingMax_s);
  const auto yaw = [&](const host::AxisGains& g) {
    const LoopMargins with = attitude_margins(g, a, lead_s, shaping_s), without = attitude_margins(g, a, 0.0, shaping_s);
    return LoopMargins{with.crossover_rad_s, std::min(with.phase_deg, without.phase_deg), std::min(with.gain_factor, without.gain_factor)};
  };
  d.yaw = fastest(kAttitudeDamping, yaw_frequency(v, rotor, a.omega_max_rad_s), "torque in hover", kLeastPhase_deg, yaw);
  round(d.yaw, yaw);

  const auto position = [&](const host::AxisGains& g) { return position_margins(g, d.roll_pitch.gains, a); };
  d.horizontal =
      fastest(kPositionDamping, d.roll_pitch.gains.frequency_rad_s / kLoopSeparation, "attitude loop", kLeastOuterPhase_deg, position);
  round(d.horizontal, position);
  const auto vertical = [&](const host::AxisGains& g) { return attitude_margins(g, a); };
  d.vertical = fastest(kAttitudeDamping, kVerticalOverHorizontal * d.horizontal.gains.frequency_rad_s, "noise of the pose",
                       kLeastOuterPhase_deg, vertical);
  round(d.vertical, vertical);

  d.file.gains = {.horizontal = d.horizontal.gains, .vertical = d.vertical.gains, .roll_pitch = d.roll_pitch.gains, .yaw = d.yaw.gains};
  d.file.limits.total_max_weight = (1.0 - kSteeringShare) * d.thrust_to_weight;
  d.file.limits.tilt_max_rad = std::min(kMostTilt_deg * kRad_per_deg, std::acos(1.0 / d.file.limits.total_max_weight));
  d.file.omega_min_rad_s = rotor.least_rad_s;
  d.file.omega_max_rad_s = a.omega_max_rad_s;
  return d;
}

std::string gains_text(const GainsDesign& d, const std::string& vehicle_name, const ActuatorDynamics& a) {
  std::string text = fmt::format(
      "# Gains of {}, by `rotorloop gains`: the fastest loops with {:.0f}° of phase (position {:.0f}°) and a gain factor of {:.0f} left,\n"
      "# with {:.1f} ms of motor lag and {:.1f} ms of delay. Hover {:.0f} rad/s, thrust-to-weight {:.2f}.\nformat = 1\n",
      vehicle_name, kLeastPhase_deg, kLeastOuterPhase_deg, kLeastGainFactor, 1e3 * a.lag_s, 1e3 * a.delay_s, d.hover_rad_s,
      d.thrust_to_weight);
  const auto axis = [&](const char* name, const DesignedLoop& l) {
    text += fmt::format("\n[{}] # {:.0f}° of phase, gain factor {:.1f}; held by {}\nfrequency_rad_s = {:.1f}\ndamping = {}\n", name,
                        l.margins.phase_deg, l.margins.gain_factor, l.limited_by, l.gains.frequency_rad_s, l.gains.damping);
  };
  axis("horizontal", d.horizontal);
  axis("vertical", d.vertical);
  axis("roll_pitch", d.roll_pitch);
  axis("yaw", d.yaw);
  text += fmt::format(
      "\n[limits]\ntilt_max_deg = {:.1f}\nvertical_thrust_min_weight = {}\nthrust_max_weight = {:.2f} # a tenth of the highest thrust "
      "stays for steering\n"
      "omega_min_rad_s = {:.1f} # {:.0f} RPM\nomega_max_rad_s = {:.1f} # {:.0f} RPM\n",
      std::floor(10.0 * d.file.limits.tilt_max_rad / kRad_per_deg) / 10.0, d.file.limits.vertical_min_weight,
      d.file.limits.total_max_weight, d.file.omega_min_rad_s, d.file.omega_min_rad_s * 30.0 / std::numbers::pi, d.file.omega_max_rad_s,
      d.file.omega_max_rad_s * 30.0 / std::numbers::pi);
  return text;
}

}  // namespace rotorloop::calibrate
