#include "bench/stand/evaluate/estimate/credibility.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/stand/evaluate/estimate/still_air.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kPowerMargin = 0.05;  // of the electrical power: gains of voltage, current and torque together
constexpr double kLoaded = 0.3;        // of the largest power: below, a wrong zero of the current outweighs the rest
constexpr double kMostBeyond = 0.2;    // share of the loaded points
constexpr std::array<double, 2> kStaticThrustCoefficient{0.03, 0.3};  // C_T of propellers at rest, from flat to square ones
constexpr double kCurrentSeen_A = 0.05;                               // below this throughout, no current was measured

std::string anyway(std::string_view check) { return fmt::format("; where it is right all the same: --accept {}", check); }

void drop_all(StandEstimate& e, std::string fault) {
  e.thrust.reset();
  e.torque.reset();
  e.motor.reset();
  e.dynamics.reset();
  e.C_T = e.C_Q = e.C_P = e.reduced_c_t = e.reduced_c_q = e.grams_per_watt = kNotMeasured;
  e.faults.push_back(std::move(fault));
}

struct Balance {
  std::size_t loaded = 0, beyond = 0;
  double worst = 0.0, at_rad_s = 0.0, useful_W = 0.0, electrical_W = 0.0;
};

// `useful`: the least power that the rotor takes at a point, W; not-a-number where it is not known.
template <class Useful>
Balance balance_of(const StandEstimate& e, const Useful& useful) {
  Balance b;
  double most = 0.0;
  for (const OperatingPoint& p : e.points)
    if (const double w = useful(p); w == w) most = std::max(most, w);
  for (const OperatingPoint& p : e.points) {
    const double w = useful(p), electrical = p.electrical_W();
    if (!(w > kLoaded * most) || !(electrical == electrical)) continue;
    ++b.loaded;
    const double ratio = w / electrical;
    b.beyond += w > electrical * (1.0 + kPowerMargin);
    if (ratio > b.worst) {
      b.worst = ratio;
      b.at_rad_s = p.omega_rad_s;
      b.useful_W = w;
      b.electrical_W = electrical;
    }
  }
  return b;
}

bool power_balances(StandEstimate& e) {
  const auto refuse = [&](const Balance& b, const char* what, const char* likely) {
    if (b.loaded == 0 || static_cast<double>(b.beyond) <= kMostBeyond * static_cast<double>(b.loaded)) return false;
    drop_all(e, fmt::format(
                    "power balance: {} exceeds the electrical power in {} of {} loaded points, at {:.0f} rad/s {:.3g} W against {:.3g} W "
                    "({:.0f} %, allowed 100 %); likely: {}; correct unit, scale or channel in a mapping and read it again{}",
                    what, b.beyond, b.loaded, b.at_rad_s, b.useful_W, b.electrical_W, 100.0 * b.worst, likely, anyway("power_balance")));
    return true;
  };
  if (refuse(balance_of(e, [](const OperatingPoint& p) { return p.shaft_W(); }), "shaft power (torque times rotor speed)",
             "the unit of the torque, a speed that is read as a multiple, or a current that is read too low"))
    return false;
  const double area = 0.25 * std::numbers::pi * e.facts.diameter_m * e.facts.diameter_m, rho = e.facts.air_density_kg_m3;
  const auto induced_W = [&](const OperatingPoint& p) { return std::pow(std::max(0.0, p.thrust_N), 1.5) / std::sqrt(2.0 * rho * area); };
  return !(area > 0.0 && rho > 0.0 &&
           refuse(balance_of(e, induced_W), "the least power that momentum theory allows for the thrust",
                  "the unit of the thrust, the diameter, or a current that is read too low"));
}

// A rotor that turns while the supply gives no current is driven by something else.
bool is_driven(StandEstimate& e, const StandRun& run) {
  double most = 0.0, negative = 0.0, n = 0.0;
  for (const StandStep& s : run.steps) {
    if (!(s.omega_rad_s > 0.0) || s.current_A != s.current_A) continue;
    most = std::max(most, std::abs(s.current_A));
    negative += s.current_A <= 0.0;
    n += 1.0;
  }
  if (n == 0.0 || most < kCurrentSeen_A || negative < 0.8 * n) return false;
  drop_all(
      e, fmt::format("power balance: the rotor turns in {:.0f} steps and the current is not above 0 in {:.0f} of them; likely: wind drives "
                     "it, or the current's sign; coefficients of a rotor that drives need a current above 0 A{}",
                     n, negative, anyway("power_balance")));
  return true;
}

// Where nobody gave the diameter: that of any propeller with this c_t, from the largest C_T to the smallest, bounds the figure of merit.
double nearest_figure_of_merit(const StandEstimate& e) {
  if (!e.thrust || !e.torque) return kNotMeasured;
  const double rho = e.facts.air_density_kg_m3, c_t = e.thrust->value;
  const auto with = [&](double C_T) {
    const double diameter_m = std::pow(4.0 * std::numbers::pi * std::numbers::pi * c_t / (rho * C_T), 0.25);
    return std::pow(c_t, 1.5) / (e.torque->value * std::sqrt(0.5 * std::numbers::pi * rho) * diameter_m);
  };
  return std::clamp(0.5 * (kFigureOfMerit[0] + kFigureOfMerit[1]), with(kStaticThrustCoefficient[0]), with(kStaticThrustCoefficient[1]));
}

void check_figure_of_merit(StandEstimate& e) {
  const double fm = e.figure_of_merit == e.figure_of_merit ? e.figure_of_merit : nearest_figure_of_merit(e);
  if (!(fm == fm) || (fm >= kFigureOfMerit[0] && fm <= kFigureOfMerit[1])) return;
  const double in_rpm = fm * kRpm_per_rad_s;
  const char* likely = fm > kFigureOfMerit[1] ? "diameter or density belongs to another propeller, or torque is read too low"
                       : in_rpm > kFigureOfMerit[0] && in_rpm < kFigureOfMerit[1]
                           ? "the speeds are RPM taken as rad/s, or the diameter is far off"
                           : "diameter, density or the torque channel is wrong";
  drop_all(e, fmt::format("figure of merit {:.3g}, credible is {} to {}; likely: {}; correct unit, scale or diameter{}", fm,
                          kFigureOfMerit[0], kFigureOfMerit[1], likely, anyway("figure_of_merit")));
}

void check_coefficient(StandEstimate& e, std::optional<CoefficientEstimate>& c, const std::set<std::string, std::less<>>& accepted) {
  if (!c) return;
  std::string fault;
  if (!(c->value > 0.0))
    fault = fmt::format("{} {} = {:.3g} {} is not above 0; a rotor that turns pulls and takes torque: look at sign, zero and speed",
                        c->channel, c->name, c->value, c->unit);
  else if (!(c->u <= kMostRelativeU * c->value) && !accepted.contains("uncertainty"))
    fault =
        fmt::format("{} {} = {:.3g} ± {:.2g} {} (u): {:.0f} % of the value, allowed {:.0f} %; measure more speeds, or tare{}", c->channel,
                    c->name, c->value, c->u, c->unit, 100.0 * c->u / c->value, 100.0 * kMostRelativeU, anyway("uncertainty"));
  else if (std::abs(c->exponent - 2.0) > kMostBeyondSquare + 2.0 * c->exponent_u && !accepted.contains("speed_law"))
    fault = fmt::format(
        "{} goes with the speed to the power of {:.2f} ± {:.2f} (u), credible is {} to {}; likely: no propeller, or loads that something "
        "else "
        "than the speed changed; look at the curve of {} over speed{}",
        c->channel, c->exponent, c->exponent_u, 2.0 - kMostBeyondSquare, 2.0 + kMostBeyondSquare, c->channel, anyway("speed_law"));
  if (fault.empty()) return;
  e.faults.push_back(std::move(fault));
  c.reset();
}

// A duty gives the motor its voltage, which goes into back-EMF and drop; a throttle is what an ESC's maker made of it.
void check_motor(StandEstimate& e) {
  if (!e.motor) return;
  constexpr double kMostMisfit = 0.03;  // of the voltage, rms
  const MotorValue& R = e.motor->resistance_ohm;
  const bool positive = R.value > 2.0 * R.u, fits = e.motor->relative_rms <= kMostMisfit;
  if (positive && fits) return;
  e.remarks.push_back(fmt::format(
      "motor: no K_v and no R are given: as back-EMF and drop, supply voltage times command gives R = {:.3g} ± {:.2g} ohm (u, must be "
      "above 0) "
      "and leaves {:.1f} % of the voltage (rms, allowed {:.0f} %); likely the command is a throttle and not the duty of the bridge",
      R.value, R.u, 100.0 * e.motor->relative_rms, 100.0 * kMostMisfit));
  e.motor.reset();
}

}  // namespace

void refuse_incredible(StandEstimate& e, const StandRun& run, const std::set<std::string, std::less<>>& accepted) {
  check_motor(e);
  if (e.dynamics && e.dynamics->inertia_kg_m2 && !(*e.dynamics->inertia_kg_m2 > 2.0 * e.dynamics->inertia_u_kg_m2.value_or(0.0))) {
    e.remarks.push_back(fmt::format("J = {:.3g} ± {:.2g} kg m² (u) is not above 0 beyond its u, and is left out",
                                    *e.dynamics->inertia_kg_m2, e.dynamics->inertia_u_kg_m2.value_or(0.0)));
    e.dynamics->inertia_kg_m2.reset();
    e.dynamics->inertia_u_kg_m2.reset();
  }
  if (!accepted.contains("still_air"))
    for (const auto& fault : {no_propeller(run), moving_air(e, run)})
      if (fault) return drop_all(e, *fault + anyway("still_air"));
  check_coefficient(e, e.thrust, accepted);
  check_coefficient(e, e.torque, accepted);
  if (!e.thrust && !e.torque) return;
  if (!accepted.contains("power_balance") && (is_driven(e, run) || !power_balances(e))) return;
  if (!accepted.contains("figure_of_merit")) check_figure_of_merit(e);
}

}  // namespace rotorloop::stand
