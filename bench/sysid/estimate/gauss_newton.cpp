#include "bench/sysid/estimate/gauss_newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/sysid/estimate/newton_step.hpp"
#include "bench/sysid/estimate/noise_limits.hpp"
#include "bench/sysid/estimate/open_directions.hpp"
#include "host/base/error.hpp"
#include "host/base/parallel.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSingularAtStart = 1e-9;  // as kSingular of the result, away from the optimum, where directions are not quite flat
constexpr double kShorten = 0.05;          // of the cost: a decrement below it is near the optimum
constexpr double kStatesFirst = 0.5;       // of the cost, by the states' own step
constexpr double kCertain = 1.0;           // a decrement below it is a step that cannot fail: its cost need not be looked at
// A fit whose cost has not fallen by this in each of several iterations has ended: no decision hangs on a fiftieth of a unit of the
// log-likelihood. Slopes that are not exact go to and fro by more.
constexpr double kDecides = 0.02, kDecidesRough = 0.1;
constexpr int kPatience = 3;        // iterations that stall; after them one without damping must gain nothing either
constexpr double kNoiseGain = 0.1;  // of the likelihood, by a round of the noise: below it the figures only chase each other
constexpr int kNoisePatience = 2, kFewestRounds = 3;
constexpr int kTries = 16;  // of a step, each shorter or more damped
// The trust region (Marquardt 1963): the damping where one is needed at all, the largest, and the gain over the promise that ends or begins
// it.
constexpr double kFirstDamping = 1e-3, kLastDamping = 1e3, kFirstStateDamping = 1e-4, kNoDamping = 1e-5;
constexpr double kGoodGain = 0.75, kPoorGain = 0.25;
constexpr double kNone = std::numeric_limits<double>::infinity();

// Runs the work of one flight, and names the flight when its states cannot be found.
template <class Act>
void for_flight(const GridFlight& flight, Act&& act) {
  try {
    act();
  } catch (const std::domain_error& e) {
    throw Error({flight.name, std::string("the fit cannot go on: ") + e.what(),
                 "a state that no measurement and no model step ties down, or values that are not finite",
                 "check the log (`rotorloop log info`) and the start values"},
                ExitCode::data_quality);
  }
}

}  // namespace

GaussNewton::GaussNewton(const FitProblem& problem, const FitOptions& options)
    : problem_(problem),
      options_(options),
      layout_(make_layout(problem)),
      priors_(problem, layout_),
      exact_slopes_(std::none_of(problem.flights.begin(), problem.flights.end(), [](const GridFlight* g) { return g->slopes_by_middle; })),
      near_optimum_(exact_slopes_ ? 1e-3 : 5e-3),
      theta_(static_cast<Eigen::Index>(layout_.estimates.size())),
      cost_before_(kNone),
      cost_before_unchecked_(kNone),
      noise_done_(options.noise.rounds == 0),
      best_likelihood_(-kNone) {
  const std::size_t flights = problem.flights.size();
  for (Eigen::Index i = 0; i < theta_.size(); ++i) theta_[i] = layout_.estimates[static_cast<std::size_t>(i)].value;
  for (const Estimate& e : layout_.estimates) names_.push_back(estimate_name(e, problem));
  fit_.noise = problem.flight_noise.empty() ? std::vector<NoiseModel>(flights, problem.noise) : problem.flight_noise;
  fit_.noise_settled = noise_done_;
  for (const GridFlight* g : problem.flights) noise_limits_.push_back(noise_limits(*g));
  if (!options.noise.per_flight) noise_limits_.assign(flights, pooled_limits(noise_limits_));
  for (std::size_t f = 0; f < flights && !noise_done_ && options.noise.measurements; ++f)
    fit_.noise[f] = within(fit_.noise[f], noise_limits_[f]);
  fit_.values = flight_values(problem, layout_, theta_);
  fit_.states.resize(flights);
  fit_.reduced.resize(flights);
  guess_.resize(flights);
  chains_.reserve(flights);
  for (std::size_t f = 0; f < flights; ++f) {
    guess_[f] = guess_states(*problem.flights[f], fit_.values[f]);
    fit_.states[f] = problem.states.empty() ? guess_[f] : problem.states[f];
    chains_.emplace_back(*problem.flights[f], fit_.states[f], guess_[f]);
  }
}

void GaussNewton::iterate(const std::function<void(const FitProgress&)>& progress) {
  for (fit_.iterations = 0; fit_.iterations < options_.max_iterations; ++fit_.iterations) {
    if (options_.stop.asked_at_iteration()) return;
    if (stalled_ == kPatience)
      damping_ = state_damping_ = 0.0;  // a damped sweep makes the states surer than they are, and the noise too small
    linearise(state_damping_);
    if (fit_.iterations == 0) observable_at_start_ = open_directions(information_with_priors(), names_, kSingularAtStart).empty();
    trust_small_steps_ = trust_small_steps_ && cost_ <= cost_before_unchecked_ + kCertain;
    cost_before_unchecked_ = kNone;
    count_stalls();
    // States of an earlier fit that no longer suit the measurements (poses associated anew) settle before the parameters follow them.
    const bool states_first = !problem_.states.empty() && fit_.iterations == 0 && states_gain_ > kStatesFirst * cost_;
    const VectorXd step = states_first ? VectorXd::Zero(theta_.size()).eval() : newton_step();
    const double promised = decrement(step);
    if (progress) progress({fit_.iterations, cost_, promised, fit_.noise_rounds});
    fit_.converged = at_optimum(promised);
    if (fit_.converged) return;
    const bool noise_next = ready_for_noise(promised);
    if (noise_next && likelihood_settled(promised)) continue;
    // No step of any length lowers the cost: it is looked at once more without damping, then this is the optimum.
    if (!descend(step, promised)) stalled_ = std::max(stalled_, kPatience);
    if (noise_next) estimate_noise();
  }
}

void GaussNewton::linearise_for_results() {
  if (!undamped_here_ || options_.innovations) linearise(0.0, options_.innovations);
}

void GaussNewton::linearise(double damping, bool innovations) {
  const SweepOptions sweep{.damping = damping,
                           .keep_rows = options_.noise.rounds > 0,
                           .block_s = options_.block_s,
                           .innovations = innovations,
                           .robust_scale = options_.robust_scale};
  parallel_for(chains_.size(), options_.threads, [&](std::size_t f) {
    const GridFlight& flight = *problem_.flights[f];
    const Residuals res(flight, fit_.values[f], fit_.noise[f], layout_.columns);
    for_flight(flight, [&] { fit_.reduced[f] = chains_[f].sweep(res, sweep); });
  });
  sum_normal_equations();
  undamped_here_ = damping == 0.0;
  if (!std::isfinite(cost_)) {
    throw Error({problem_.flights.front()->name, "the misfit of the flights is not a finite number",
                 "a measurement or a start value is not one, or a value ran away",
                 "let the checks look at the log, and give start values nearer to the vehicle"},
                ExitCode::data_quality);
  }
}

void GaussNewton::sum_normal_equations() {
  const Eigen::Index n = theta_.size();
  information_ = MatrixXd::Zero(n, n);
  score_ = VectorXd::Zero(n);
  cost_ = states_gain_ = 0.0;
  for (std::size_t f = 0; f < chains_.size(); ++f) {
    const auto& at = layout_.of_flight[f];
    const Reduced& reduced = fit_.reduced[f];
    score_(at) += reduced.score;
    information_(at, at) += reduced.information;
    cost_ += reduced.cost;
    states_gain_ += reduced.cost - reduced.predicted_cost;
  }
  cost_ += priors_.cost(theta_);
}

// Back-substitution: the states' steps for a share of the parameters' step. theta_ stays until the step is accepted.
void GaussNewton::move_to(const VectorXd& theta, const VectorXd& step, double share) {
  for (std::size_t f = 0; f < chains_.size(); ++f) chains_[f].apply(step(layout_.of_flight[f]), share);
  fit_.values = flight_values(problem_, layout_, theta);
  undamped_here_ = false;
}

double GaussNewton::cost_here(const VectorXd& theta) const {
  std::vector<double> part(chains_.size());
  parallel_for(chains_.size(), options_.threads, [&](std::size_t f) {
    part[f] = chains_[f].cost(Residuals(*problem_.flights[f], fit_.values[f], fit_.noise[f], {}), options_.robust_scale);
  });
  double sum = priors_.cost(theta);
  for (const double c : part) sum += c;
  return sum;
}

VectorXd GaussNewton::newton_step() const {
  return step_inside(problem_, layout_, theta_, information_with_priors(), score_with_priors(), damping_);
}

double GaussNewton::decrement(const VectorXd& step) const {
  return states_gain_ - score_with_priors().dot(step) - 0.5 * step.dot(information_with_priors() * step);
}

// By the costs of the sweeps, which hold those of steps that were not looked at, against the lowest so far: to and fro is no progress.
void GaussNewton::count_stalls() {
  const double little = !noise_done_ ? near_optimum_ * cost_ : exact_slopes_ ? kDecides : kDecidesRough;
  stalled_ = cost_before_ - cost_ < little ? stalled_ + 1 : 0;
  cost_before_ = std::min(cost_before_, cost_);
}

bool GaussNewton::at_optimum(double promised) const {
  return noise_done_ && ((undamped() && promised < options_.tolerance) || stalled_ > kPatience);
}

bool GaussNewton::ready_for_noise(double promised) const {
  return !noise_done_ && ((undamped() && promised < near_optimum_ * cost_) || stalled_ > kPatience);
}

// Noise figures can chase each other for ever without making the flights any likelier. True, with the noise that made them likeliest,
// when the last rounds did not.
bool GaussNewton::likelihood_settled(double promised) {
  if (state_damping_ > 0.0) return false;
  double likelihood = promised - cost_;
  for (std::size_t f = 0; f < chains_.size(); ++f)
    likelihood -= 0.5 * fit_.reduced[f].log_det_states + log_standard_deviations(*problem_.flights[f], fit_.noise[f]);
  if (likelihood > best_likelihood_ + kNoiseGain) {
    rounds_since_best_ = 0;
    best_likelihood_ = likelihood;
    best_noise_ = fit_.noise;
  } else {
    ++rounds_since_best_;
  }
  if (rounds_since_best_ < kNoisePatience || fit_.noise_rounds < kFewestRounds) return false;
  if (likelihood < best_likelihood_ - kNoiseGain) fit_.noise = best_noise_;
  noise_done_ = fit_.noise_settled = true;
  cost_before_ = cost_before_unchecked_ = kNone;
  stalled_ = 0;
  return true;
}

// A step that does not lower the cost is taken back. Near the optimum it is shortened first: where a scale and all places that it scales
// move together the way is right and only too long, and damping would hold each place by itself. Then the parameters are damped, the
// states follow them undamped: damping of 1e-4 on a chain of states holds whole trajectories. Last the states. False: none lowers it.
bool GaussNewton::descend(VectorXd step, double promised) {
  const int shorter = promised < kShorten * cost_ ? 2 : 0;
  const auto states = fit_.states;
  const double before = cost_;
  for (int tries = 0; tries < kTries + shorter; ++tries) {
    const double share = undamped() ? std::ldexp(1.0, -tries) : 1.0;
    const VectorXd moved_theta = theta_ + share * step;
    move_to(moved_theta, step, share);
    const bool certain = trust_small_steps_ && tries == 0 && undamped() && promised >= 0.0 && promised < kCertain;
    if (certain) cost_before_unchecked_ = before;
    const double after = certain ? before : cost_here(moved_theta);
    if (certain || after <= before * (1.0 + 1e-12) + 1e-9) {
      theta_ = moved_theta;
      if (!certain) adapt(before - after, promised, tries == 0);
      return true;
    }
    move_back(states);
    if (undamped() && tries < shorter) continue;
    if (damping_ < kLastDamping) {
      damping_ = damping_ == 0.0 ? kFirstDamping : 10.0 * damping_;
    } else {
      state_damping_ = state_damping_ == 0.0 ? kFirstStateDamping : 10.0 * state_damping_;
      linearise(state_damping_);
    }
    step = newton_step();
    promised = decrement(step);
  }
  damping_ = state_damping_ = 0.0;
  return false;
}

void GaussNewton::move_back(const std::vector<std::vector<BodyState>>& states) {
  fit_.states = states;
  fit_.values = flight_values(problem_, layout_, theta_);
}

// The size of the trust region after a step: larger where the first try gained what the linear model promised, smaller where it gained
// little of it.
void GaussNewton::adapt(double gained, double promised, bool at_once) {
  if (!at_once) return;
  state_damping_ = state_damping_ < kNoDamping ? 0.0 : 0.1 * state_damping_;
  if (gained > kGoodGain * promised || promised < kCertain) {
    damping_ = damping_ < kNoDamping ? 0.0 : 0.1 * damping_;
  } else if (gained < kPoorGain * promised) {
    damping_ = std::min(damping_ == 0.0 ? kFirstDamping : 4.0 * damping_, kLastDamping);
  }
}

void GaussNewton::estimate_noise() {
  std::vector<FlightRows> rows;
  for (std::size_t f = 0; f < chains_.size(); ++f) {
    const GridFlight& flight = *problem_.flights[f];
    rows.push_back({flight, chains_[f].rows_here(Residuals(flight, fit_.values[f], fit_.noise[f], {})), noise_limits_[f]});
  }
  SettledNoise found = settle_noise(rows, fit_.noise, options_.noise, [&](const auto& act) {
    parallel_for(chains_.size(), options_.threads, [&](std::size_t f) { for_flight(*problem_.flights[f], [&] { act(f); }); });
  });
  for (std::size_t f = 0; f < chains_.size(); ++f) chains_[f].move(found.moves[f]);
  fit_.noise = std::move(found.noise);
  ++fit_.noise_rounds;
  fit_.noise_settled = found.change < options_.noise.tolerance;
  noise_done_ = fit_.noise_settled || fit_.noise_rounds == options_.noise.rounds;
  undamped_here_ = false;
  cost_before_ = cost_before_unchecked_ = kNone;
  stalled_ = 0;
  damping_ = state_damping_ = 0.0;
}

}  // namespace rotorloop::estimate
