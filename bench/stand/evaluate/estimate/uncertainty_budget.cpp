#include "bench/stand/evaluate/estimate/uncertainty_budget.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

// What an error of this pattern over the steps, not allowed for by a term of the fit, does to the coefficient; relative.
double carried(const CoefficientEstimate& e, const Eigen::VectorXd& pattern) { return std::abs(e.fit.influence.dot(pattern)) / e.value; }

double largest(const CoefficientEstimate& e) { return e.rows.y.cwiseAbs().maxCoeff(); }

// Laws that the run's own data leave open differ at the window's middle: their spread is of no step's scatter.
double law_spread(const CoefficientEstimate& e) {
  double low = e.value, high = e.value;
  // Only laws as good as the chosen one to within evidence of 1 to 3 count: others have been refuted.
  for (const LawRow& l : e.laws)
    if (l.aicc_loss < 2.0) {
      low = std::min(low, l.c);
      high = std::max(high, l.c);
    }
  return (high - low) / e.value / std::sqrt(12.0);
}

}  // namespace

double coverage_factor(double degrees) { return student_quantile(0.95, std::max(1.0, degrees)); }

void add_budget(CoefficientEstimate& e, const StandRun& run, const CoefficientEstimate* thrust) {
  const StandUncertainty& k = run.known;
  const bool is_thrust = e.name == "c_t";
  const auto add = [&](const std::string& name, double u, const std::string& source) {
    if (u > 0.0) e.budget.push_back({name, u, BudgetKind::B, source});
  };
  const double blocks = static_cast<double>(e.rows.y.size()), terms = static_cast<double>(e.fit.terms.size());
  // What the priors of the exponents hold back, no drawing of steps shows: there the larger of the two.
  const bool by_draws = e.bootstrap.u > 0.0 && !(e.fit.law.exponent && e.model_based_u > e.bootstrap.u);
  const double scatter = by_draws ? e.bootstrap.u : e.model_based_u;
  e.budget.push_back({by_draws ? "scatter of the steps (bootstrap)" : "scatter of the steps (model-based)", scatter / e.value,
                      BudgetKind::A, "run", std::max(1.0, blocks - terms)});
  const KnownU& gain = is_thrust ? k.thrust_calibration : k.torque_calibration;
  add("calibration", gain.u, gain.source);
  if (!is_thrust) add("arm length", k.arm_length.u, k.arm_length.source);
  add("alignment", 0.5 * k.alignment_rad.u * k.alignment_rad.u, k.alignment_rad.source);
  add("rotor speed, twice", 2.0 * k.rotor_speed.u, k.rotor_speed.source);
  add("air density", k.air_density.u, k.air_density.source);
  const FitLaw& law = e.fit.law;
  const KnownU& zero = is_thrust ? k.zero_thrust : k.zero_torque;
  if (!law.zero && !law.running) add("zero", zero.u * carried(e, Eigen::VectorXd::Constant(e.rows.y.size(), largest(e))), zero.source);
  // Friction in the mount turns with the direction of the change; at rest it has none, so that zeros do not take it up.
  if (!law.hysteresis) add("hysteresis", k.hysteresis.u * carried(e, largest(e) * e.rows.direction), k.hysteresis.source);
  if (!is_thrust && thrust) add("cross-talk of thrust", k.cross_talk_m.u * thrust->value / e.value, k.cross_talk_m.source);
  if (!is_thrust) add("cross-talk of thrust", k.cross_talk_share.u, k.cross_talk_share.source);
  // Where the widest law stands, its priors hold what is not known of the law: it is in the scatter (model-based) already.
  if (!(law.curved && law.running)) add("law of speed", law_spread(e), "run");
  double squares = 0.0, over_degrees = 0.0;
  for (const BudgetTerm& t : e.budget) {
    squares += t.u * t.u;
    over_degrees += std::pow(t.u, 4) / t.degrees;
  }
  e.u = e.value * std::sqrt(squares);
  e.degrees = over_degrees > 0.0 ? squares * squares / over_degrees : 1e6;
  const double half = coverage_factor(std::min(e.degrees, 1e6)) * e.u;
  e.low = e.value - half;
  e.high = e.value + half;
}

}  // namespace rotorloop::stand
