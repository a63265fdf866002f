// Hover: four rotors lift the weight and leave no moment. That identifies the unit of the speeds, and a rotor that reads a wrong number
// all the time (pole pairs, pulses), without a thrust model.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "bench/sysid/log/check/check_moments.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::log {
namespace {

// Sums over quasi-hover: level, slow, little turning.
struct Hover {
  RotorValues square{};  // mean ω², rad²/s²
  double up_m_s2 = 0.0;
  double seconds = 0.0;
};

Hover hover_of(const FlightGrid& g, const std::vector<double>& up, const std::vector<char>& airborne, bool strict) {
  Hover h;
  for (std::size_t i = 0; i < g.grid.count; ++i) {
    if (!g.valid[i] || !airborne[i]) continue;
    if (strict) {
      const Eigen::Vector3d v = g.has_velocity ? g.velocity_W_m_s[i] : g.has_position ? g.position_rate_W_m_s[i] : Eigen::Vector3d::Zero();
      if (std::abs(up[i] - kGravity_m_s2) > 1.5 || v.norm() > 1.0) continue;
      if (g.has_attitude && (g.q_WB[i] * Eigen::Vector3d::UnitZ()).z() < 0.97) continue;
      if (g.has_gyro && g.gyro_B_rad_s[i].norm() > 0.7) continue;
    }
    for (std::size_t k = 0; k < 4; ++k) h.square[k] += g.omega_rad_s[i][k] * g.omega_rad_s[i][k];
    h.up_m_s2 += up[i];
    h.seconds += g.grid.dt_s;
  }
  const double n = std::max(1.0, std::round(h.seconds / g.grid.dt_s));
  for (double& q : h.square) q /= n;
  h.up_m_s2 /= n;
  return h;
}

// Thrust coefficient T / (ρ A (ω R)²) of a rotor for a multirotor. Slow-fly and racing propellers of the UIUC collection and the flown
// vehicles of docs reach 0.006 to 0.032 (0.125 times the propeller coefficient T/(ρ n² D⁴) of 0.05 to 0.25); a unit mistake moves it by 36
// at least.
constexpr double kLeastCT = 0.003, kMostCT = 0.045;

struct SpeedUnit {
  double factor;  // shown / true
  const char* words;
};
const SpeedUnit kSpeedUnits[] = {
    {kRpm_per_rad_s, "the speeds are in rev/min, read as rad/s"},
    {1.0 / kRpm_per_rad_s, "the speeds are in rad/s, converted from rev/min once too often"},
    {0.5 / std::numbers::pi, "the speeds are in rev/s, read as rad/s"},
    {6.0, "electrical speeds of a motor with 6 pole pairs (12 magnets): the pole pairs are missing"},
    {7.0, "electrical speeds of a motor with 7 pole pairs (14 magnets): the pole pairs are missing"},
    {11.0, "electrical speeds of a motor with 11 pole pairs (22 magnets): the pole pairs are missing"},
    {6.0 * kRpm_per_rad_s, "electrical rev/min of a motor with 6 pole pairs, read as rad/s"},
    {7.0 * kRpm_per_rad_s, "electrical rev/min of a motor with 7 pole pairs, read as rad/s"},
    {0.07 * kRpm_per_rad_s, "the speeds are in hundreds of electrical rev/min (DShot telemetry), 7 pole pairs, read as rad/s"},
    {1.0 / 6.0, "the speeds were divided by 6 pole pairs once too often"},
    {1.0 / 7.0, "the speeds were divided by 7 pole pairs once too often"},
};

void check_speed_unit(CheckState& s, const Hover& h) {
  const host::ThrustModel& t = s.vehicle.thrust;
  if (!(t.radius_m > 0.0) || !(t.air_density_kg_m3 > 0.0)) return;
  double sum = 0.0;
  for (const double q : h.square) sum += q;
  const double tip2 = 0.25 * sum * t.radius_m * t.radius_m;
  const double c_t = 0.25 * s.vehicle.mass_kg * h.up_m_s2 / (t.air_density_kg_m3 * t.disk_area_m2() * tip2);
  const std::string what = fmt::format(
      "hover of {:.4g} kg at {:.4g} rad/s gives a thrust coefficient of {:.2g} at a tip speed of {:.3g} m/s (allowed {:.3g} to {:.3g})",
      s.vehicle.mass_kg, std::sqrt(0.25 * sum), c_t, std::sqrt(tip2), kLeastCT, kMostCT);
  if (c_t >= kLeastCT && c_t <= kMostCT) {
    s.note(stream_name::rotors, what, s.span());
    return;
  }
  std::string likely;
  for (const SpeedUnit& u : kSpeedUnits) {
    const double corrected = c_t * u.factor * u.factor;
    if (corrected < 0.006 || corrected > 0.035) continue;
    likely += fmt::format("{}{} (then {:.3f})", likely.empty() ? "" : "; or ", u.words, corrected);
  }
  s.refuse(stream_name::rotors, what, s.span(), likely.empty() ? "mass, rotor radius or the unit of the speeds" : likely,
           "give the unit (rad/s, rpm, erpm with pole_pairs) in the mapping; check mass and radius in the vehicle file");
}

// One rotor read `k` times its speed leaves the same imbalance in roll, pitch and yaw; a centre of mass off the middle leaves none in
// yaw, twisted arms none in roll and pitch. So all three must agree on one rotor before it is named.
struct HoverBalance {
  double roll = 0.0, pitch = 0.0, yaw = 0.0;  // shares of the sum of squares, over the mean arms
};

std::optional<HoverBalance> balance_of(const Hover& h, const host::VehicleModel& vehicle, double& arm_x_m, double& arm_y_m) {
  double sum = 0.0;
  arm_x_m = arm_y_m = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    sum += h.square[k];
    arm_x_m += 0.25 * std::abs(vehicle.arm_m(static_cast<int>(k)).x());
    arm_y_m += 0.25 * std::abs(vehicle.arm_m(static_cast<int>(k)).y());
  }
  if (!(sum > 0.0) || !(arm_x_m > 0.0) || !(arm_y_m > 0.0)) return std::nullopt;
  HoverBalance b;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d arm = vehicle.arm_m(static_cast<int>(k));
    const double share = h.square[k] / sum;
    b.roll += share * arm.y() / arm_y_m;
    b.pitch += share * arm.x() / arm_x_m;
    b.yaw += share * vehicle.rotors[k].reaction;
  }
  return b;
}

double scale_of_imbalance(double imbalance) { return std::sqrt((1.0 + 3.0 * imbalance) / (1.0 - imbalance)); }  // (k² - 1) / (k² + 3)

// Does the flight turn as if this rotor read `scale` times its speed? A scaled rotor asks for roll when the vehicle pitches or yaws; a
// centre of mass off the middle does not, and hub inflow goes with the rates. Both are fitted, to the speeds as read and with the rotor
// put right: what is left then says which of the two it is.
bool turns_as_scaled(const CheckState& s, const FlightGrid& g, const std::vector<char>& in_flight, std::size_t rotor, double scale) {
  constexpr double kBetter = 0.95;  // of the mean square: less is noise
  const auto left = [&](const FlightGrid& grid) {
    const std::vector<MomentSample> samples = moment_samples(grid, in_flight, s.vehicle);
    return samples.empty() ? 0.0 : unexplained_moments(samples, [](std::size_t) { return true; }).mean_square;
  };
  FlightGrid right = g;
  for (RotorValues& w : right.omega_rad_s) w[rotor] /= scale;
  return left(right) < kBetter * left(g);
}

void check_balance(CheckState& s, const FlightGrid& g, const std::vector<char>& in_flight, const Hover& h) {
  // A scale of 0.931 or 1.073. The clean measured flights leave up to 0.023, with less agreement of the three axes than asked for.
  constexpr double kLeastImbalance = 0.035;
  constexpr double kNoCentreOfMass = 0.12;  // of the arm: further off, no one builds a vehicle, and yaw shows the same
  constexpr double kSameRatio = 0.03;       // 6/7 is distinguished from 0.9, which says nothing of pole pairs
  double arm_x_m = 0.0, arm_y_m = 0.0;
  const auto b = balance_of(h, s.vehicle, arm_x_m, arm_y_m);
  if (!b) return;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d arm = s.vehicle.arm_m(static_cast<int>(k));
    const std::array<double, 3> d{std::copysign(1.0, arm.y()) * b->roll, std::copysign(1.0, arm.x()) * b->pitch,
                                  s.vehicle.rotors[k].reaction * b->yaw};
    const double mean = (d[0] + d[1] + d[2]) / 3.0;
    const double spread = *std::max_element(d.begin(), d.end()) - *std::min_element(d.begin(), d.end());
    if (std::abs(mean) < kLeastImbalance || spread > 0.6 * std::abs(mean)) continue;
    const double scale = scale_of_imbalance(mean);
    const std::string seen =
        fmt::format("hover leaves imbalances of {:+.3f} in roll, {:+.3f} in pitch, {:+.3f} in yaw", b->roll, b->pitch, b->yaw);
    if (std::abs(mean) < kNoCentreOfMass && !turns_as_scaled(s, g, in_flight, k, scale)) {
      s.note(stream_name::rotors,
             seen + fmt::format(
                        ": a centre of mass {:+.1f} % of the arm forward and {:+.1f} % to the left of the file's would; the flight does "
                        "not turn as if rotor {} read {:.3f} times its speed",
                        100.0 * b->pitch, 100.0 * b->roll, k + 1, scale),
             s.span());
      continue;
    }
    constexpr std::pair<double, const char*> kRatios[] = {
        {6.0 / 7.0, "6 pole pairs counted as 7"}, {7.0 / 6.0, "7 pole pairs counted as 6"},   {0.5, "every second pulse missed"},
        {2.0, "every pulse counted twice"},       {7.0 / 11.0, "7 pole pairs counted as 11"}, {11.0 / 7.0, "11 pole pairs counted as 7"}};
    std::string likely = "a speed sensor that is scaled, or a rotor unlike the others (chipped, or of another pitch)";
    for (const auto& [ratio, words] : kRatios)
      if (std::abs(scale / ratio - 1.0) < kSameRatio) likely = words;
    s.refuse(fmt::format("rotor {} speed", k + 1),
             seen + fmt::format(", as if it read {:.3f} times its speed (allowed {:.3f} to {:.3f})", scale,
                                scale_of_imbalance(-kLeastImbalance), scale_of_imbalance(kLeastImbalance)),
             s.span(), likely, "give the pole pairs of each rotor, or repair the sensor; do not fit thrust through it");
  }
}

}  // namespace

void check_hover(CheckState& s, const FlightGrid& g, const std::vector<double>& up, const std::vector<char>& in_flight) {
  constexpr double kLeast_s = 0.5;
  Hover h = hover_of(g, up, in_flight, true);
  if (h.seconds < kLeast_s) h = hover_of(g, up, in_flight, false);
  if (h.seconds < kLeast_s) return;
  check_speed_unit(s, h);
  check_balance(s, g, in_flight, h);
}

}  // namespace rotorloop::log
