#include "bench/stand/evaluate/estimate/still_air.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/base/constants.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kFast = 0.8, kSlow = 0.6;     // of the fastest step
constexpr double kLeastPower_W = 2.0;          // less is indistinguishable from a sensor's zero
constexpr double kLeastThrust_N_per_W = 0.01;  // 1 g/W: propellers of all sizes, loaded to their limit, give more
constexpr double kLeastMotorEfficiency = 0.2;  // of a motor that is loaded at all
constexpr double kLoadedThrust = 0.3;          // of the largest thrust: below, the zero outweighs the rest
constexpr double kThrustVaries = 0.08;         // of the thrust at one speed, which a quarter of the steps exceed: no gust of a room
constexpr double kBelowRest = 0.02;            // of the largest thrust
constexpr double kBeyondSquare = 0.4;          // of the exponents: beyond, the speed law itself is refused (credibility.hpp)
constexpr double kExponentsApart = 0.3;        // Reynolds number bends both; the advance ratio bends thrust far more than torque
constexpr double kMostBeyondRest = 0.15;       // of the largest thrust; friction of a mount is a few hundredths
constexpr std::size_t kFewestOfAir = 3;

struct Group {
  double speed = 0.0, power_W = 0.0, thrust_N = 0.0, shaft_W = 0.0, torque_N_m = 0.0;
  std::size_t steps = 0;
};
template <class Take>
Group middle_of(const StandRun& run, const Take& take) {
  std::vector<double> speed, power, thrust, torque;
  for (const StandStep& s : run.steps) {
    if (!take(s) || std::isnan(s.voltage_V * s.current_A * s.thrust_N)) continue;
    speed.push_back(s.omega_rad_s);
    power.push_back(s.voltage_V * s.current_A);
    thrust.push_back(s.thrust_N);
    torque.push_back(s.torque_N_m);
  }
  if (speed.empty()) return {};
  return {median(speed), median(power), median(thrust), 0.0, median(torque), speed.size()};
}

}  // namespace

std::optional<std::string> no_propeller(const StandRun& run) {
  double most = 0.0;
  for (const StandStep& s : run.steps) most = std::max(most, s.omega_rad_s);
  const Group fast = middle_of(run, [&](const StandStep& s) { return s.omega_rad_s > kFast * most; });
  Group base = middle_of(run, [](const StandStep& s) { return !(s.omega_rad_s > 0.0); });
  if (base.steps == 0) base = middle_of(run, [&](const StandStep& s) { return s.omega_rad_s < kSlow * most; });
  const double power_W = fast.power_W - base.power_W, thrust_N = fast.thrust_N - base.thrust_N;
  if (fast.steps == 0 || base.steps == 0 || !(power_W > kLeastPower_W)) return std::nullopt;
  const double shaft_W = fast.speed * (fast.torque_N_m - base.torque_N_m);
  if (std::abs(thrust_N) > kLeastThrust_N_per_W * power_W || std::abs(shaft_W) > kLeastMotorEfficiency * power_W) return std::nullopt;
  return fmt::format(
      "no propeller shows: from {:.0f} to {:.0f} RPM the electrical power rises by {:.3g} W and the thrust changes by {:.2g} N ({:.2g} "
      "g/W, "
      "propellers give more than 1 g/W); likely: a motor without a propeller, or a load cell that is held; coefficients need a propeller",
      base.speed * kRpm_per_rad_s, fast.speed * kRpm_per_rad_s, power_W, thrust_N, 1000.0 * std::abs(thrust_N) / kGravity_m_s2 / power_W);
}

std::optional<std::string> moving_air(const StandEstimate& e, const StandRun& run) {
  const std::string air =
      "likely: wind or a wind tunnel, whose airspeed is not in the file, a thrust that drifts or speeds that are misread; coefficients "
      "hold "
      "in still air, or with the airspeed in a column";
  for (const StandFault& f : run.checked.faults)
    if (f.channel == "thrust" && f.beyond_rest > kMostBeyondRest)
      return fmt::format(
          "the air moves: thrust of the turning rotor has a constant that differs from its reading at rest by {:.0f} % of the "
          "largest reading (allowed {:.0f} %); {}",
          100.0 * f.beyond_rest, 100.0 * kMostBeyondRest, air);
  if (!e.thrust) return std::nullopt;
  const CoefficientEstimate& c = *e.thrust;
  double most = 0.0;
  const Eigen::Index n = c.rows.y.size();
  const double constant = c.fit.value("zero") + c.fit.value("running offset");
  for (Eigen::Index i = 0; i < n; ++i)
    if (c.rows.omega_rad_s(i) > 0.0) most = std::max(most, of_rotor_alone(c, i) - c.fit.residual(i));
  std::vector<double> varies;
  std::size_t below = 0;
  double slowest = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!(c.rows.omega_rad_s(i) > 0.0)) continue;
    const double law = of_rotor_alone(c, i) - c.fit.residual(i);
    if (law > kLoadedThrust * most) varies.push_back(std::abs(c.rows.y(i) - constant - law) / law);
    const bool is_below = c.fit.law.zero && c.rows.y(i) - c.fit.value("zero") < -kBelowRest * most;
    below += is_below;
    if (is_below) slowest = std::max(slowest, c.rows.omega_rad_s(i));
  }
  if (e.torque && e.torque->exponent_u > 0.0 && c.exponent_u > 0.0)
    if (const double apart = std::abs(c.exponent - e.torque->exponent), u = std::hypot(c.exponent_u, e.torque->exponent_u);
        apart > kExponentsApart + 2.0 * u && std::abs(c.exponent - 2.0) < kBeyondSquare)
      return fmt::format("the air moves: thrust goes with the power {:.2f} of the speed and torque with {:.2f} (allowed {} apart); {}",
                         c.exponent, e.torque->exponent, kExponentsApart, air);
  if (below >= kFewestOfAir)
    return fmt::format("the air moves: thrust is below its reading at rest in {} steps that turn, up to {:.0f} RPM; {}", below,
                       slowest * kRpm_per_rad_s, air);
  if (varies.size() >= kFewestOfAir && quantile(varies, 0.75) > kThrustVaries)
    return fmt::format(
        "the air moves: thrust at one speed is not one thrust, a quarter of the loaded steps are more than {:.0f} % from the law (allowed "
        "{:.0f} %); {}",
        100.0 * quantile(varies, 0.75), 100.0 * kThrustVaries, air);
  return std::nullopt;
}

}  // namespace rotorloop::stand
