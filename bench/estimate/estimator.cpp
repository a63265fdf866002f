#include "bench/estimate/estimator.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <thread>

#include "host/base/error.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSingular = 1e-11;        // of the information scaled to unit diagonal: below it lies rounding
constexpr double kSingularAtStart = 1e-9;  // the same away from the optimum, where directions are not quite flat

void for_each_flight(std::size_t flights, int threads, const std::function<void(std::size_t)>& act) {
  std::vector<std::exception_ptr> failures(flights);
  const auto guarded = [&](std::size_t f) {
    try {
      act(f);
    } catch (...) {
      failures[f] = std::current_exception();
    }
  };
  if (threads <= 1 || flights < 2) {
    for (std::size_t f = 0; f < flights; ++f) guarded(f);
  } else {
    const std::size_t workers = std::min<std::size_t>(static_cast<std::size_t>(threads), flights);
    std::vector<std::thread> pool;
    for (std::size_t w = 0; w < workers; ++w) {
      pool.emplace_back([&, w] {
        for (std::size_t f = w; f < flights; f += workers) guarded(f);
      });
    }
    for (auto& t : pool) t.join();
  }
  for (const auto& f : failures) {
    if (f) std::rethrow_exception(f);
  }
}

// Everything about the free numbers: which column of the whole each column of a flight is.
struct Layout {
  std::vector<Estimate> estimates;
  std::vector<std::vector<Eigen::Index>> of_flight;  // flight's column -> estimate
  Columns columns;                                   // of every flight
};

Layout make_layout(const FitProblem& p) {
  Layout l;
  const int flights = static_cast<int>(p.flights.size());
  l.of_flight.resize(p.flights.size());
  for (const FreeParameter& f : p.free) {
    l.columns.push_back(f.parameter);
    for (int i = 0; i < (f.per_flight ? flights : 1); ++i) {
      const auto at = static_cast<Eigen::Index>(l.estimates.size());
      const bool own_start = f.per_flight && !p.flight_start.empty();
      const double value =
          own_start ? p.flight_start[static_cast<std::size_t>(i)][static_cast<std::size_t>(f.parameter)] : p.start[f.parameter];
      l.estimates.push_back({.parameter = f.parameter, .flight = f.per_flight ? i : -1, .value = value});
      if (f.per_flight) {
        l.of_flight[static_cast<std::size_t>(i)].push_back(at);
      } else {
        for (auto& own : l.of_flight) own.push_back(at);
      }
    }
  }
  return l;
}

// Gaussian knowledge about the estimates, in their order.
class Priors {
 public:
  Priors(const FitProblem& p, const Layout& l) : size_(static_cast<Eigen::Index>(l.estimates.size())) {
    VectorXd weight = VectorXd::Zero(size_), mean = VectorXd::Zero(size_);
    for (Eigen::Index i = 0; i < size_; ++i) {
      const Estimate& e = l.estimates[static_cast<std::size_t>(i)];
      mean[i] = e.value;
      for (const FreeParameter& f : p.free) {
        if (f.parameter == e.parameter && f.prior_u > 0.0) weight[i] = 1.0 / (f.prior_u * f.prior_u);
      }
    }
    parts_.push_back({mean, weight.asDiagonal()});
    for (const JointPrior& prior : p.priors) parts_.push_back(spread(prior, l));
    information_ = MatrixXd::Zero(size_, size_);
    for (const Part& part : parts_) information_ += part.information;
  }
  const MatrixXd& information() const { return information_; }
  VectorXd score(const VectorXd& theta) const {
    VectorXd sum = VectorXd::Zero(size_);
    for (const Part& part : parts_) sum += part.information * (theta - part.mean);
    return sum;
  }
  double cost(const VectorXd& theta) const {
    double sum = 0.0;
    for (const Part& part : parts_) sum += 0.5 * (theta - part.mean).dot(part.information * (theta - part.mean));
    return sum;
  }

 private:
  struct Part {
    VectorXd mean;
    MatrixXd information;
  };
  Part spread(const JointPrior& prior, const Layout& l) const {
    Part out{VectorXd::Zero(size_), MatrixXd::Zero(size_, size_)};
    std::vector<Eigen::Index> from, to;
    for (std::size_t k = 0; k < prior.parameters.size(); ++k) {
      for (Eigen::Index i = 0; i < size_; ++i) {
        const Estimate& e = l.estimates[static_cast<std::size_t>(i)];
        if (e.parameter != prior.parameters[k] || e.flight >= 0) continue;
        from.push_back(static_cast<Eigen::Index>(k));
        to.push_back(i);
      }
    }
    for (std::size_t a = 0; a < to.size(); ++a) {
      out.mean[to[a]] = prior.mean[from[a]];
      for (std::size_t b = 0; b < to.size(); ++b) out.information(to[a], to[b]) = prior.information(from[a], from[b]);
    }
    return out;
  }
  Eigen::Index size_;
  std::vector<Part> parts_;
  MatrixXd information_;
};

// Values of each flight for the estimates of the moment.
std::vector<ModelValues> flight_values(const FitProblem& p, const Layout& l, const VectorXd& theta) {
  std::vector<ModelValues> out(p.flights.size(), p.start);
  for (std::size_t f = 0; f < out.size(); ++f) {
    if (!p.flight_start.empty()) out[f].values = p.flight_start[f];
    for (std::size_t c = 0; c < l.columns.size(); ++c) out[f][l.columns[c]] = theta[l.of_flight[f][c]];
  }
  return out;
}

// Scaled to unit diagonal, so that grams and kilometres may stand side by side.
VectorXd scaling(const MatrixXd& s) {
  VectorXd d = s.diagonal();
  for (Eigen::Index i = 0; i < d.size(); ++i) d[i] = d[i] > 0.0 ? 1.0 / std::sqrt(d[i]) : 1.0;
  return d;
}
VectorXd solve_scaled(const MatrixXd& s, const VectorXd& rhs, double damping) {
  const VectorXd k = scaling(s);
  MatrixXd a = k.asDiagonal() * s * k.asDiagonal();
  a.diagonal().array() *= 1.0 + damping;
  const VectorXd scaled_rhs = k.asDiagonal() * rhs;
  return k.asDiagonal() * a.ldlt().solve(scaled_rhs);
}
MatrixXd inverse_scaled(const MatrixXd& s) {
  const VectorXd k = scaling(s);
  const MatrixXd a = k.asDiagonal() * s * k.asDiagonal();
  return k.asDiagonal() * a.ldlt().solve(MatrixXd::Identity(s.rows(), s.cols())) * k.asDiagonal();
}

// The Newton step that keeps every value inside its range: a value that would leave it stops at its bound, and the others make the
// best of that. A positive value loses at most four fifths in one step, for its curvature is known here only.
VectorXd step_inside(const FitProblem& p, const Layout& l, const VectorXd& theta, const MatrixXd& s, const VectorXd& score,
                     double damping) {
  const Eigen::Index n = theta.size();
  VectorXd step = VectorXd::Zero(n), lowest(n), highest(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const ParameterInfo info = parameter_info(l.estimates[static_cast<std::size_t>(i)].parameter, p.start.terms);
    lowest[i] = info.min > 0.0 ? std::max(info.min - theta[i], -0.8 * theta[i]) : info.min - theta[i];
    highest[i] = info.max - theta[i];
  }
  std::vector<Eigen::Index> open(static_cast<std::size_t>(n)), held;
  for (Eigen::Index i = 0; i < n; ++i) open[static_cast<std::size_t>(i)] = i;
  while (!open.empty()) {
    VectorXd rhs = -score(open);
    if (!held.empty()) rhs -= s(open, held) * step(held);
    step(open) = solve_scaled(s(open, open), rhs, damping);
    // The one that goes too far by the most, in units of its way to the bound, is held; then the rest is solved anew.
    double worst = 1.0 + 1e-9;
    auto stops = open.end();
    for (auto i = open.begin(); i != open.end(); ++i) {
      const double way = step[*i] < 0.0 ? lowest[*i] : highest[*i], excess = way != 0.0 ? step[*i] / way : (step[*i] != 0.0 ? 1e300 : 0.0);
      if (excess > worst) worst = excess, stops = i;
    }
    if (stops == open.end()) break;
    step[*stops] = step[*stops] < 0.0 ? lowest[*stops] : highest[*stops];
    held.push_back(*stops);
    open.erase(stops);
  }
  return step;
}

// Sum of logs of all assumed standard deviations: the part of the likelihood that keeps the noise from growing.
double log_sd(const GridFlight& g, const NoiseModel& n) {
  std::size_t linked = 0;
  for (const auto l : g.linked) linked += l;
  const auto logs = [](const Eigen::Vector3d& v) { return v.array().log().sum(); };
  const double h = g.step_s, per_axis = std::log(h * h * h / 3.0) / 2.0 + std::log(h / 4.0) / 2.0;
  double sum = static_cast<double>(linked) * (2.0 * logs(n.force_m_s2_rtHz) + 2.0 * logs(n.angular_rad_s2_rtHz) + 6.0 * per_axis);
  sum += static_cast<double>(g.pose.size()) * (logs(n.position_m) + logs(n.attitude_rad));
  sum += static_cast<double>(g.position.size()) * logs(n.position_m) + static_cast<double>(g.velocity.size()) * logs(n.velocity_m_s);
  sum += static_cast<double>(g.gyro.size()) * logs(n.gyro_rad_s) + static_cast<double>(g.accel.size()) * logs(n.accel_m_s2);
  return sum;
}

}  // namespace

const Estimate* Fit::find(int parameter, int flight) const {
  for (const Estimate& e : estimates) {
    if (e.parameter == parameter && (e.flight == flight || e.flight == -1)) return &e;
  }
  return nullptr;
}

std::string estimate_name(const Estimate& e, const FitProblem& p) {
  const std::string symbol = parameter_info(e.parameter, p.start.terms).symbol;
  return e.flight < 0 ? symbol : symbol + " (" + p.flights[static_cast<std::size_t>(e.flight)]->name + ")";
}

std::vector<OpenDirection> open_directions(const MatrixXd& information, const std::vector<std::string>& names, double limit) {
  std::vector<OpenDirection> out;
  const VectorXd k = scaling(information);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eig(MatrixXd(k.asDiagonal() * information * k.asDiagonal()));
  for (Eigen::Index i = 0; i < information.rows() && eig.eigenvalues()[i] < limit; ++i) {
    OpenDirection d{eig.eigenvalues()[i], {}};
    std::vector<Eigen::Index> order(static_cast<std::size_t>(information.rows()));
    for (std::size_t j = 0; j < order.size(); ++j) order[j] = static_cast<Eigen::Index>(j);
    const VectorXd v = eig.eigenvectors().col(i);
    std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return std::fabs(v[a]) > std::fabs(v[b]); });
    for (const Eigen::Index j : order) {
      if (std::fabs(v[j]) < 0.1) break;
      d.parts.emplace_back(names[static_cast<std::size_t>(j)], v[j]);
    }
    out.push_back(std::move(d));
  }
  return out;
}

Fit fit(const FitProblem& p, const FitOptions& o, const std::function<void(const FitProgress&)>& progress) {
  Layout layout = make_layout(p);
  if (layout.columns.size() > kMaxColumns) {
    throw Error({"the fit", fmt::format("{} free parameters; at most {} can be fitted at once", layout.columns.size(), kMaxColumns), "",
                 "hold some of them (--hold)"});
  }
  const Priors priors(p, layout);
  const std::size_t flights = p.flights.size();
  const auto n = static_cast<Eigen::Index>(layout.estimates.size());
  VectorXd theta(n);
  for (Eigen::Index i = 0; i < n; ++i) theta[i] = layout.estimates[static_cast<std::size_t>(i)].value;

  Fit out;
  out.noise = p.flight_noise.empty() ? std::vector<NoiseModel>(flights, p.noise) : p.flight_noise;
  out.values = flight_values(p, layout, theta);
  out.states.resize(flights);
  out.reduced.resize(flights);
  std::vector<std::vector<BodyState>> guess(flights);
  std::vector<Chain> chains;
  chains.reserve(flights);
  for (std::size_t f = 0; f < flights; ++f) {
    guess[f] = guess_states(*p.flights[f], out.values[f]);
    out.states[f] = p.states.empty() ? guess[f] : p.states[f];
    chains.emplace_back(*p.flights[f], out.states[f], guess[f]);
  }

  std::vector<std::string> names;
  for (const Estimate& e : layout.estimates) names.push_back(estimate_name(e, p));
  std::string where;
  for (const GridFlight* g : p.flights) where += (where.empty() ? "" : ", ") + g->name;

  MatrixXd information;
  VectorXd score;
  double cost = 0.0, states_gain = 0.0;
  bool want_innovations = false;
  const auto guarded = [&](std::size_t f, auto&& act) {
    try {
      act();
    } catch (const std::domain_error& e) {
      throw Error({p.flights[f]->name, std::string("the fit cannot go on: ") + e.what(),
                   "a state that no reading and no model step ties down, or values that are not finite",
                   "check the log (`rotorloop log info`) and the start values"},
                  ExitCode::data_quality);
    }
  };
  const auto sweep = [&](double damping) {
    const SweepOptions sweep_options{.damping = damping,
                                     .keep_rows = o.noise.rounds > 0,
                                     .block_s = o.block_s,
                                     .innovations = want_innovations,
                                     .robust_scale = o.robust_scale};
    for_each_flight(flights, o.threads, [&](std::size_t f) {
      const Residuals res(*p.flights[f], out.values[f], out.noise[f], layout.columns);
      guarded(f, [&] { out.reduced[f] = chains[f].sweep(res, sweep_options); });
    });
    information = MatrixXd::Zero(n, n);
    score = VectorXd::Zero(n);
    cost = states_gain = 0.0;
    for (std::size_t f = 0; f < flights; ++f) {
      const auto& at = layout.of_flight[f];
      for (std::size_t a = 0; a < at.size(); ++a) {
        score[at[a]] += out.reduced[f].score[static_cast<Eigen::Index>(a)];
        for (std::size_t b = 0; b < at.size(); ++b)
          information(at[a], at[b]) += out.reduced[f].information(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
      }
      cost += out.reduced[f].cost;
      states_gain += out.reduced[f].cost - out.reduced[f].predicted_cost;
    }
    cost += priors.cost(theta);
    if (!std::isfinite(cost)) {
      throw Error({p.flights.front()->name, "the misfit of the flights is not a finite number",
                   "a reading or a start value is not one, or a value ran away",
                   "let the checks look at the log, and give start values nearer to the vehicle"},
                  ExitCode::data_quality);
    }
  };
  const auto with_priors = [&] { return MatrixXd(information + priors.information()); };
  const auto prior_score = [&] { return VectorXd(score + priors.score(theta)); };
  const auto total_cost = [&](const VectorXd& at) {
    std::vector<double> part(flights);
    for_each_flight(flights, o.threads, [&](std::size_t f) {
      part[f] = chains[f].cost(Residuals(*p.flights[f], out.values[f], out.noise[f], {}), o.robust_scale);
    });
    double sum = priors.cost(at);
    for (const double c : part) sum += c;
    return sum;
  };

  // The noise is found along with the rest: between two steps of the fit, once the states are near their best values.
  const auto update_noise = [&] {
    std::vector<FlightRows> rows;
    for (std::size_t f = 0; f < flights; ++f)
      rows.push_back({*p.flights[f], chains[f].rows_here(Residuals(*p.flights[f], out.values[f], out.noise[f], {}))});
    SettledNoise found = settle_noise(rows, out.noise, o.noise, [&](const auto& act) {
      for_each_flight(flights, o.threads, [&](std::size_t f) { guarded(f, [&] { act(f); }); });
    });
    for (std::size_t f = 0; f < flights; ++f) chains[f].move(found.moves[f]);
    out.noise = std::move(found.noise);
    ++out.noise_rounds;
    return found.change < o.noise.tolerance;
  };
  const bool exact = std::none_of(p.flights.begin(), p.flights.end(), [](const GridFlight* g) { return g->slopes_by_middle; });
  const double near = exact ? 1e-3 : 5e-3;  // of the cost: a decrement below it leaves residuals that say how large the noise is
  constexpr double kShorten = 0.05;         // of the cost: a decrement below it is near the optimum
  constexpr double kCertain = 1.0;          // a decrement below it is a step that cannot fail: its cost need not be looked at …
  // Slopes that are not exact foretell more than there is: damped steps that lower the cost by less than this, in turn, are the end.
  // With exact ones they end nothing, but where they gain less than `near` the noise is read all the same: a fit that stays damped would
  // else keep the noise it began with, and what that weighs too much (torque, by forty) draws it into a lesser optimum. Only where even an
  // undamped step promises less than this and damped ones bring nothing is the rest rounding (a heading and a gyro's bias without poses).
  constexpr double kStill = 0.1, kRest = 1e-3;
  constexpr int kPatience = 2;
  bool told = true;  // by the flights at the start values: every direction
  double damping = 0.0;
  int still = 0;
  bool swept = false;  // the last sweep was at these very values
  // … unless one did: slopes that are not exact can lead to and fro between two points for ever.
  bool trusted = true;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double unseen = kNone;  // the cost before a step that was taken so, with this noise
  bool noise_settled = o.noise.rounds == 0;
  out.noise_settled = noise_settled;
  for (out.iterations = 0; out.iterations < o.max_iterations; ++out.iterations) {
    if (still == kPatience) damping = 0.0;  // a damped sweep makes the states surer than they are, and the noise too small
    sweep(damping);
    if (out.iterations == 0) told = open_directions(with_priors(), names, kSingularAtStart).empty();
    trusted = trusted && cost <= unseen + kCertain;
    unseen = kNone;
    VectorXd step = step_inside(p, layout, theta, with_priors(), prior_score(), damping);
    const double decrement = states_gain - prior_score().dot(step) - 0.5 * step.dot(with_priors() * step);
    if (progress) progress({out.iterations, cost, decrement, out.noise_rounds});
    if (noise_settled && damping == 0.0 && decrement < o.tolerance) {
      out.converged = swept = true;
      break;
    }
    if (still == kPatience && noise_settled && (!exact || decrement < kStill)) {
      out.converged = true;
      break;
    }
    const bool tells_noise = !noise_settled && ((damping == 0.0 && decrement < near * cost) || still == kPatience);
    // A step that does not lower the cost is taken back and damped. Near the optimum it is shortened first: where a scale and all places
    // that it scales move together the way is right and only too long, and damping would hold each place by itself.
    const int shorter = decrement < kShorten * cost ? 2 : 0;
    const auto states = out.states;
    const double before = cost;
    double after = cost;
    bool taken = false;
    for (int tries = 0; tries < 12 + shorter; ++tries) {
      const double share = damping == 0.0 ? std::ldexp(1.0, -tries) : 1.0;
      const VectorXd moved_theta = theta + share * step;
      for (std::size_t f = 0; f < flights; ++f) {
        VectorXd own(static_cast<Eigen::Index>(layout.columns.size()));
        for (std::size_t c = 0; c < layout.columns.size(); ++c) own[static_cast<Eigen::Index>(c)] = step[layout.of_flight[f][c]];
        chains[f].apply(own, share);
      }
      out.values = flight_values(p, layout, moved_theta);
      const bool certain = trusted && tries == 0 && damping == 0.0 && decrement >= 0.0 && decrement < kCertain;
      if (certain) unseen = before;
      if (certain || (after = total_cost(moved_theta)) <= before * (1.0 + 1e-12) + 1e-9) {
        theta = moved_theta;
        taken = true;
        if (tries == 0) damping = damping < 1e-6 ? 0.0 : 0.1 * damping;
        break;
      }
      out.states = states;
      out.values = flight_values(p, layout, theta);
      if (damping == 0.0 && tries < shorter) continue;
      damping = damping == 0.0 ? 1e-4 : 10.0 * damping;
      sweep(damping);
      step = step_inside(p, layout, theta, with_priors(), prior_score(), damping);
    }
    if (!taken) break;
    const double gained = before - after, little = !exact ? kStill : noise_settled ? kRest : near * before;
    const bool stalls = damping > 0.0 && gained < little;
    still = stalls ? std::min(still + 1, kPatience) : 0;
    if (tells_noise) {
      unseen = kNone;
      still = 0;
      damping = 0.0;
      out.noise_settled = update_noise();
      noise_settled = out.noise_settled || out.noise_rounds == o.noise.rounds;
    }
  }
  if (!swept || o.innovations) {
    want_innovations = o.innovations;
    sweep(0.0);
  }
  const MatrixXd with = with_priors();
  if (const auto open = open_directions(with, names, kSingular); !open.empty()) {
    std::string text;
    for (const OpenDirection& d : open) {
      text += text.empty() ? "" : "; ";
      for (std::size_t i = 0; i < d.parts.size(); ++i)
        text += fmt::format("{}{} ({:+.2f})", i ? ", " : "", d.parts[i].first, d.parts[i].second);
    }
    if (told && !out.converged) {
      throw Error(
          {where,
           fmt::format("the fit ran away: after {} iterations it can no longer tell {}, which these flights told at the start values",
                       out.iterations, text),
           "a model that is not these flights': rotor columns exchanged, a rotor speed that is scaled or lost for a while, a stream whose "
           "stamps are off, or start values far from the vehicle",
           "look at `rotorloop log info`, try each flight alone, hold what is known (--hold), or start from a better vehicle file"},
          ExitCode::data_quality);
    }
    throw Error({where, fmt::format("{} direction(s) of the parameters leave every residual unchanged: {}", open.size(), text),
                 "the flights do not excite them, or they cannot be told apart on any flight (mass and all forces; rotor arms and inertia)",
                 "hold one of each direction at a measured value, or fly the manoeuvre that tells them apart (docs/manual.md)"},
                ExitCode::data_quality);
  }
  out.covariance = inverse_scaled(with);
  out.information = information;
  // Scatter of the block scores, with neighbours: S⁻¹ V S⁻¹.
  MatrixXd v = MatrixXd::Zero(n, n);
  for (std::size_t f = 0; f < flights; ++f) {
    std::vector<VectorXd> scores;
    for (const ScoreBlock& b : out.reduced[f].blocks) {
      VectorXd u = VectorXd::Zero(n);
      for (std::size_t c = 0; c < layout.columns.size(); ++c) u[layout.of_flight[f][c]] = b.score[static_cast<Eigen::Index>(c)];
      scores.push_back(u);
    }
    for (std::size_t b = 0; b < scores.size(); ++b) {
      v += scores[b] * scores[b].transpose();
      if (b + 1 < scores.size()) {
        const MatrixXd cross = scores[b] * scores[b + 1].transpose();
        v += 0.5 * (cross + cross.transpose());
      }
    }
    out.blocks += scores.size();
  }
  if (out.blocks > 1) v *= static_cast<double>(out.blocks) / static_cast<double>(out.blocks - 1);
  out.robust_covariance = out.covariance * (v + priors.information()) * out.covariance;

  const VectorXd prior_share = (priors.information() * out.covariance).diagonal();
  out.estimates = layout.estimates;
  for (Eigen::Index i = 0; i < n; ++i) {
    Estimate& e = out.estimates[static_cast<std::size_t>(i)];
    e.value = theta[i];
    e.u = std::sqrt(std::max(0.0, out.covariance(i, i)));
    e.u_robust = std::sqrt(std::max(0.0, out.robust_covariance(i, i)));
    e.prior_share = prior_share[i];
    for (const FreeParameter& f : p.free) {
      if (f.parameter == e.parameter && f.prior_u > 0.0)
        e.prior_z = (e.value - layout.estimates[static_cast<std::size_t>(i)].value) / f.prior_u;
    }
    const ParameterInfo info = parameter_info(e.parameter, p.start.terms);
    e.at_bound = e.value <= info.min || e.value >= info.max;
  }
  out.cost = cost;
  double residuals = 0.0, states = 0.0;
  out.log_likelihood = -cost;
  for (std::size_t f = 0; f < flights; ++f) {
    residuals += static_cast<double>(out.reduced[f].residuals);
    states += 12.0 * static_cast<double>(p.flights[f]->tied_knots());
    out.log_likelihood -= 0.5 * out.reduced[f].log_det_states + log_sd(*p.flights[f], out.noise[f]);
  }
  out.degrees_of_freedom = residuals - states - static_cast<double>(n);
  return out;
}

}  // namespace rotorloop::estimate
