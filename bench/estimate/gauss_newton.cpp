#include "bench/estimate/gauss_newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/estimate/newton_step.hpp"
#include "bench/estimate/open_directions.hpp"
#include "host/base/error.hpp"
#include "host/base/parallel.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSingularAtStart = 1e-9;  // as kSingular of the result, away from the optimum, where directions are not quite flat
constexpr double kShorten = 0.05;          // of the cost: a decrement below it is near the optimum
constexpr double kCertain = 1.0;           // a decrement below it is a step that cannot fail: its cost need not be looked at
// Slopes that are not exact predict more than there is: damped steps that lower the cost by less than this, in turn, are the end.
// With exact ones they end nothing, but where they gain less than `near_optimum_` the noise is read all the same: a fit that stays damped
// would else keep the noise it began with, and what that weighs too much (torque, by forty) draws it into a lesser optimum. Only where even
// an undamped step promises less than this and damped ones bring nothing is the rest rounding (a heading and a gyro's bias without poses).
constexpr double kStalledCost = 0.1, kSettledCost = 1e-3;
constexpr int kPatience = 2;  // steps that stall
constexpr int kTries = 12;    // of a step, each shorter or more damped
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
      cost_before_unchecked_(kNone),
      noise_done_(options.noise.rounds == 0) {
  const std::size_t flights = problem.flights.size();
  for (Eigen::Index i = 0; i < theta_.size(); ++i) theta_[i] = layout_.estimates[static_cast<std::size_t>(i)].value;
  for (const Estimate& e : layout_.estimates) names_.push_back(estimate_name(e, problem));
  fit_.noise = problem.flight_noise.empty() ? std::vector<NoiseModel>(flights, problem.noise) : problem.flight_noise;
  fit_.noise_settled = noise_done_;
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
    if (options_.stop.asked()) return;
    if (stalled_steps_ == kPatience) damping_ = 0.0;  // a damped sweep makes the states surer than they are, and the noise too small
    linearise(damping_);
    if (fit_.iterations == 0) observable_at_start_ = open_directions(information_with_priors(), names_, kSingularAtStart).empty();
    trust_small_steps_ = trust_small_steps_ && cost_ <= cost_before_unchecked_ + kCertain;
    cost_before_unchecked_ = kNone;
    const VectorXd step = newton_step();
    const double promised = decrement(step);
    if (progress) progress({fit_.iterations, cost_, promised, fit_.noise_rounds});
    fit_.converged = at_optimum(promised);
    if (fit_.converged) return;
    const bool noise_next = ready_for_noise(promised);
    if (!descend(step, promised)) return;
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

bool GaussNewton::at_optimum(double promised) const {
  if (!noise_done_) return false;
  const bool converged = damping_ == 0.0 && promised < options_.tolerance;
  return converged || (stalled_steps_ == kPatience && (!exact_slopes_ || promised < kStalledCost));
}

bool GaussNewton::ready_for_noise(double promised) const {
  return !noise_done_ && ((damping_ == 0.0 && promised < near_optimum_ * cost_) || stalled_steps_ == kPatience);
}

// A step that does not lower the cost is taken back and damped. Near the optimum it is shortened first: where a scale and all places
// that it scales move together the way is right and only too long, and damping would hold each place by itself. False: none lowers it.
bool GaussNewton::descend(VectorXd step, double promised) {
  const int shorter = promised < kShorten * cost_ ? 2 : 0;
  const auto states = fit_.states;
  const double before = cost_;
  for (int tries = 0; tries < kTries + shorter; ++tries) {
    const double share = damping_ == 0.0 ? std::ldexp(1.0, -tries) : 1.0;
    const VectorXd moved_theta = theta_ + share * step;
    move_to(moved_theta, step, share);
    const bool certain = trust_small_steps_ && tries == 0 && damping_ == 0.0 && promised >= 0.0 && promised < kCertain;
    if (certain) cost_before_unchecked_ = before;
    const double after = certain ? before : cost_here(moved_theta);
    if (certain || after <= before * (1.0 + 1e-12) + 1e-9) {
      theta_ = moved_theta;
      if (tries == 0) damping_ = damping_ < 1e-6 ? 0.0 : 0.1 * damping_;
      count_stalls(before - after, before);
      return true;
    }
    fit_.states = states;
    fit_.values = flight_values(problem_, layout_, theta_);
    if (damping_ == 0.0 && tries < shorter) continue;
    damping_ = damping_ == 0.0 ? 1e-4 : 10.0 * damping_;
    linearise(damping_);
    step = newton_step();
  }
  return false;
}

void GaussNewton::count_stalls(double gained, double before) {
  const double little = !exact_slopes_ ? kStalledCost : noise_done_ ? kSettledCost : near_optimum_ * before;
  const bool stalls = damping_ > 0.0 && gained < little;
  stalled_steps_ = stalls ? std::min(stalled_steps_ + 1, kPatience) : 0;
}

void GaussNewton::estimate_noise() {
  std::vector<FlightRows> rows;
  for (std::size_t f = 0; f < chains_.size(); ++f) {
    const GridFlight& flight = *problem_.flights[f];
    rows.push_back({flight, chains_[f].rows_here(Residuals(flight, fit_.values[f], fit_.noise[f], {}))});
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
  cost_before_unchecked_ = kNone;
  stalled_steps_ = 0;
  damping_ = 0.0;
}

}  // namespace rotorloop::estimate
