#include "bench/sysid/diagnose/manoeuvre/manoeuvre_catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "host/base/constants.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr double kTau = 2.0 * std::numbers::pi;

// 0 to 1 from rest to rest with three continuous derivatives, and how steep it is at most: peak speed and acceleration of a way L in a
// time T are these times L/T and L/T².
double smooth(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * x * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)));
}
constexpr double kPeakSpeed = 2.1875, kPeakAcceleration = 7.513;

// Its integral over time: a clock that starts from rest and runs true after `over_s`.
double eased(double t, double over_s) {
  if (t >= over_s) return t - 0.5 * over_s;
  const double x = std::max(0.0, t / over_s);
  return over_s * x * x * x * x * x * (7.0 - x * (14.0 - x * (10.0 - 2.5 * x)));
}

// To and fro from stop to stop, with these peaks on the way.
double to_and_fro(double t_s, double peak_m_s, double peak_m_s2) {
  const double t = std::max(0.0, t_s);
  const double way_m = kPeakAcceleration / (kPeakSpeed * kPeakSpeed) * peak_m_s * peak_m_s / peak_m_s2,
               leg_s = kPeakSpeed * way_m / peak_m_s;
  const double legs = std::floor(t / leg_s), along = smooth(t / leg_s - legs);
  return way_m * (std::fmod(legs, 2.0) == 0.0 ? along : 1.0 - along);
}
// As many m/s² as m/s: legs of 3.4 s at every speed.
double run(double t, double peak_m_s) { return to_and_fro(t, peak_m_s, peak_m_s); }

// A sine that swells within a second.
double shake(double t, double amplitude, double frequency_Hz) { return smooth(t) * amplitude * std::sin(kTau * frequency_Hz * t); }
// Moved to and fro so that the vehicle tilts by this much; so that its thrust changes by this share of its weight.
double tilting(double t, double tilt_rad, double frequency_Hz) {
  return shake(t, kGravity_m_s2 * tilt_rad / std::pow(kTau * frequency_Hz, 2), frequency_Hz);
}
double heaving(double t, double share, double frequency_Hz) { return tilting(t, share, frequency_Hz); }
double yawing(double t, double peak_rad_s, double frequency_Hz) { return shake(t, peak_rad_s / (kTau * frequency_Hz), frequency_Hz); }

// From step to step, each held.
template <std::size_t N>
double staircase(double t, const std::array<double, N>& steps) {
  constexpr double kMove_s = 0.9;
  const double each = kManoeuvre_s / N, place = std::floor(std::clamp(t, 0.0, kManoeuvre_s - 1e-9) / each);
  const auto i = static_cast<std::size_t>(place);
  const double before = i == 0 ? steps[0] : steps[i - 1];
  return before + (steps[i] - before) * smooth((t - place * each) / kMove_s);
}
constexpr std::array<double, 5> kSteps_m{0.50, 0.30, 0.18, 0.12, 0.08};  // between 8 and 1.3 rotor radii

PathPoint at(double x, double y, double z, double yaw = 0.0) { return {{x, y, z}, yaw}; }

constexpr double kPayload = 0.25;  // of the vehicle's mass

const std::array kManoeuvres{
    Manoeuvre{"hover", "hover without moving", 0, "", Level::free_air, [](double, double) { return at(0, 0, 0); }},
    Manoeuvre{"hover_turned", "hover while the heading turns evenly through a full circle", 0, "", Level::free_air,
              [](double t, double) { return at(0, 0, 0, kTau / (kManoeuvre_s - 1.0) * eased(t, 2.0)); }},
    Manoeuvre{"hover_low", "hover on a staircase of heights above the ground, the lowest with the hubs at {}", kSteps_m.back(), "m",
              Level::ground, [](double t, double) { return at(0, 0, staircase(t, kSteps_m)); }},
    Manoeuvre{"hover_under_ceiling", "hover on a staircase of gaps below the ceiling, the closest {} above the hubs", kSteps_m.back(), "m",
              Level::ceiling, [](double t, double) { return at(0, 0, staircase(t, kSteps_m)); }},
    Manoeuvre{"thrust_pulses", "hover with strong pulses of thrust, up to {} of the weight more and less", 0.6, "", Level::free_air,
              [](double t, double k) { return at(0, 0, k * heaving(t, 0.6, 1.1)); }},
    Manoeuvre{"thrust_pulses_loaded", "hover with a weighed load of a quarter of the mass, and pulses of thrust of {} of the weight", 0.4,
              "", Level::free_air, [](double t, double k) { return at(0, 0, k * heaving(t, 0.4, 1.1)); }, kPayload},
    Manoeuvre{"yaw_doublets", "yaw to and fro in hover as fast as {}", 3.0, "rad/s", Level::free_air,
              [](double t, double k) { return at(0, 0, 0, k * yawing(t, 3.0, 0.5)); }},
    Manoeuvre{"roll_doublets", "roll to and fro twice a second by {}", 0.35, "rad", Level::free_air,
              [](double t, double k) { return at(0, k * tilting(t, 0.35, 2.0), 0); }},
    Manoeuvre{"pitch_doublets", "pitch to and fro twice a second by {}", 0.35, "rad", Level::free_air,
              [](double t, double k) { return at(k * tilting(t, 0.35, 2.0), 0, 0); }},
    Manoeuvre{"tilt_and_thrust", "roll and pitch to and fro by {} while thrust rises and falls by a third of the weight", 0.2, "rad",
              Level::free_air,
              [](double t, double k) { return at(k * tilting(t, 0.2, 1.9), k * tilting(t, 0.2, 2.3), k * heaving(t, 0.33, 0.7)); }},
    Manoeuvre{"three_axes", "roll, pitch and yaw to and fro at once, tilts of {}", 0.2, "rad", Level::free_air,
              [](double t, double k) { return at(k * tilting(t, 0.2, 1.9), k * tilting(t, 0.2, 2.3), 0, k * yawing(t, 2.0, 0.6)); }},
    Manoeuvre{"vertical_slow", "straight up and down, up to {}", 1.5, "m/s", Level::free_air,
              [](double t, double k) { return at(0, 0, k * to_and_fro(t, 1.5, 1.5)); }},
    Manoeuvre{"vertical_fast", "straight up and down, up to {}", 4.0, "m/s", Level::free_air,
              [](double t, double k) { return at(0, 0, k * to_and_fro(t, 4.0, 4.5)); }},
    Manoeuvre{"descent", "climb gently, then drop straight down at up to {}", 5.5, "m/s", Level::free_air,
              [](double t, double k) { return at(0, 0, k * 8.8 * (smooth(t / 5.0) - smooth((t - 5.5) / 3.5))); }},
    Manoeuvre{"climb_and_yaw", "yaw to and fro while climbing and descending at up to {}", 3.0, "m/s", Level::free_air,
              [](double t, double k) { return at(0, 0, k * to_and_fro(t, 3.0, 3.0), k * yawing(t, 2.0, 0.6)); }},
    Manoeuvre{"pass_x_slow", "straight runs nose first and back, up to {}", 3.0, "m/s", Level::free_air,
              [](double t, double k) { return at(k * run(t, 3.0), 0, 0); }},
    Manoeuvre{"pass_x", "straight runs nose first and back, up to {}", 6.0, "m/s", Level::free_air,
              [](double t, double k) { return at(k * run(t, 6.0), 0, 0); }},
    Manoeuvre{"pass_x_fast", "straight runs nose first and back, up to {}", 9.0, "m/s", Level::free_air,
              [](double t, double k) { return at(k * run(t, 9.0), 0, 0); }},
    Manoeuvre{"pass_y_slow", "straight runs sideways and back, up to {}", 3.0, "m/s", Level::free_air,
              [](double t, double k) { return at(0, k * run(t, 3.0), 0); }},
    Manoeuvre{"pass_y", "straight runs sideways and back, up to {}", 6.0, "m/s", Level::free_air,
              [](double t, double k) { return at(0, k * run(t, 6.0), 0); }},
    Manoeuvre{"pass_y_fast", "straight runs sideways and back, up to {}", 9.0, "m/s", Level::free_air,
              [](double t, double k) { return at(0, k * run(t, 9.0), 0); }},
    Manoeuvre{"pass_diagonal", "straight runs and back with the nose turned aside by 45 degrees (two rotors in line), up to {}", 6.0, "m/s",
              Level::free_air, [](double t, double k) { return at(k * run(t, 6.0), 0, 0, 0.25 * std::numbers::pi); }},
    Manoeuvre{"pass_turning", "straight runs and back while the heading turns evenly, up to {}", 6.0, "m/s", Level::free_air,
              [](double t, double k) { return at(k * run(t, 6.0), 0, 0, 0.7 * eased(t, 1.0)); }},
    Manoeuvre{"pass_pulsed", "straight runs nose first and back with pulses of thrust of half the weight, up to {}", 6.0, "m/s",
              Level::free_air, [](double t, double k) { return at(k * run(t, 6.0), 0, k * heaving(t, 0.5, 1.1)); }},
    Manoeuvre{"pass_loaded", "straight runs nose first and back with a weighed load of a quarter of the mass, up to {}", 6.0, "m/s",
              Level::free_air, [](double t, double k) { return at(k * run(t, 6.0), 0, 0); }, kPayload},
    Manoeuvre{"pass_climbing", "straight runs and back while climbing and descending at 2.5 m/s, up to {} level", 6.0, "m/s",
              Level::free_air, [](double t, double k) { return at(k * run(t, 6.0), 0, k * to_and_fro(t, 2.5, 3.5)); }},
    Manoeuvre{"pass_yawing", "straight runs and back while yawing to and fro at 2 rad/s, up to {}", 5.0, "m/s", Level::free_air,
              [](double t, double k) { return at(k * run(t, 5.0), 0, 0, k * yawing(t, 2.0, 0.7)); }},
    Manoeuvre{"pass_low", "straight runs and back low above the ground (hubs at 0.2 m on a 5-inch vehicle), up to {}", 3.0, "m/s",
              Level::ground, [](double t, double k) { return at(k * run(t, 3.0), 0, 0.2); }},
    Manoeuvre{"stop_and_wait", "a short run, a hard stop, three seconds of hover, and back; up to {}", 4.0, "m/s", Level::free_air,
              [](double t, double k) { return at(k * 2.8 * (smooth(t / 1.5) - smooth((t - 5.0) / 1.5)), 0, 0); }},
    Manoeuvre{
        "circle", "circles with the heading kept, at {}", 5.0, "m/s", Level::free_air,
        [](double t, double k) { return at(k * 2.5 * (std::cos(2.0 * eased(t, 2.0)) - 1.0), k * 2.5 * std::sin(2.0 * eased(t, 2.0)), 0); }},
    Manoeuvre{"circle_nose_first", "circles nose first, at {}", 5.0, "m/s", Level::free_air,
              [](double t, double k) {
                const double phi = 2.0 * eased(t, 2.0);
                return at(k * 2.5 * (std::cos(phi) - 1.0), k * 2.5 * std::sin(phi), 0, phi + 0.25 * kTau);
              }},
    Manoeuvre{"figure_eight", "a figure of eight with the heading kept, up to {}", 6.0, "m/s", Level::free_air,
              [](double t, double k) {
                const double phi = 1.5 * eased(t, 2.0);
                return at(k * 2.9 * std::sin(phi), k * 1.4 * std::sin(2.0 * phi), 0);
              }},
};

}  // namespace

std::span<const Manoeuvre> manoeuvres() { return kManoeuvres; }

PathPoint path_point(const Manoeuvre& m, double t_s, double length_ratio, double share) {
  PathPoint out = m.at(t_s / std::sqrt(length_ratio), share);
  out.p_m *= length_ratio;
  return out;
}

std::string manoeuvre_words(const Manoeuvre& m, double length_ratio, double share) {
  const std::string_view words = m.words, unit = m.unit;
  const auto gap = words.find("{}");
  if (gap == std::string_view::npos) return std::string(words);
  const double root = std::sqrt(length_ratio), size = unit == "m/s"     ? root * share
                                                      : unit == "rad/s" ? share / root
                                                      : unit == "m"     ? length_ratio
                                                                        : share;
  return fmt::format("{}{:.2g}{}{}{}", words.substr(0, gap), m.figure * size, unit.empty() ? "" : " ", unit, words.substr(gap + 2));
}

}  // namespace rotorloop::diagnose
