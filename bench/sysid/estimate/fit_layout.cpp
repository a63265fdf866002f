#include "bench/sysid/estimate/fit_layout.hpp"

#include <fmt/format.h>

#include "host/base/error.hpp"

namespace rotorloop::estimate {

using Eigen::MatrixXd;
using Eigen::VectorXd;

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
  if (l.columns.size() > kMaxColumns) {
    throw Error({"the fit", fmt::format("{} free parameters; at most {} can be fitted at once", l.columns.size(), kMaxColumns), "",
                 "hold some of them (--hold)"});
  }
  return l;
}

std::vector<ModelValues> flight_values(const FitProblem& p, const Layout& l, const VectorXd& theta) {
  std::vector<ModelValues> out(p.flights.size(), p.start);
  for (std::size_t f = 0; f < out.size(); ++f) {
    if (!p.flight_start.empty()) out[f].values = p.flight_start[f];
    for (std::size_t c = 0; c < l.columns.size(); ++c) out[f][l.columns[c]] = theta[l.of_flight[f][c]];
  }
  return out;
}

Priors::Priors(const FitProblem& p, const Layout& l) : size_(static_cast<Eigen::Index>(l.estimates.size())) {
  VectorXd weight = VectorXd::Zero(size_), mean = VectorXd::Zero(size_);
  for (Eigen::Index i = 0; i < size_; ++i) {
    const Estimate& e = l.estimates[static_cast<std::size_t>(i)];
    mean[i] = e.value;
    for (const FreeParameter& f : p.free) {
      if (f.parameter == e.parameter && f.prior_u > 0.0) weight[i] = 1.0 / (f.prior_u * f.prior_u);
    }
  }
  parts_.push_back({mean, weight.asDiagonal()});
  information_ = scatter_ = parts_.front().information;
  for (const JointPrior& prior : p.priors) {
    parts_.push_back(spread(prior, l));
    information_ += parts_.back().information;
    scatter_ += prior.weight * parts_.back().information;
  }
}

VectorXd Priors::score(const VectorXd& theta) const {
  VectorXd sum = VectorXd::Zero(size_);
  for (const Part& part : parts_) sum += part.information * (theta - part.mean);
  return sum;
}

double Priors::cost(const VectorXd& theta) const {
  double sum = 0.0;
  for (const Part& part : parts_) sum += 0.5 * (theta - part.mean).dot(part.information * (theta - part.mean));
  return sum;
}

Priors::Part Priors::spread(const JointPrior& prior, const Layout& l) const {
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
    for (std::size_t b = 0; b < to.size(); ++b) out.information(to[a], to[b]) = prior.weight * prior.information(from[a], from[b]);
  }
  return out;
}

}  // namespace rotorloop::estimate
