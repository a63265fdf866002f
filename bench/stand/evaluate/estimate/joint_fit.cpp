#include "bench/stand/evaluate/estimate/joint_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"
#include "host/base/random.hpp"
#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::stand {
namespace {

constexpr int kMostRounds = 60;
constexpr double kSettled = 1e-9;  // relative change of c that ends the search
constexpr double kCauchy = 2.385;  // 95 % efficiency for normal errors (Rey 1983)
constexpr double kSteepest = 2.0;  // exponents beyond ω^0 … ω^4 are no rotor's
// Standard deviations of exponent, curvature and its change between propellers: root mean squares of C_T and C_P over rotor speed in the
// static tables of six propellers of 4 to 28 inches (UIUC vol. 1 to 3, pyBEMT's T-Motor 28).
constexpr double kPriorExponent = 0.10, kPriorCurvature = 0.09, kPriorThird = 0.09;
// Of a load cell's zero over a run, as a share of the largest reading: where speed and time go together, a free drift would take
// thrust for itself.
constexpr double kPriorDrift = 0.02;
constexpr std::uint64_t kDrawsModule = 0x64726177;  // "draw"

struct Work {
  const FitRows& rows;
  FitLaw law;
  double c = 0.0, e = 0.0, f = 0.0, g = 0.0;
  Eigen::MatrixXd X;       // derivatives by the terms
  Eigen::VectorXd linear;  // of the terms after c, e and f
  std::vector<std::string> names;

  Work(const FitRows& r, const FitLaw& l) : rows(r), law(l) {
    names = {"c"};
    if (l.exponent) names.emplace_back("exponent");
    if (l.curved) {
      names.emplace_back("curvature");
      names.emplace_back("change of curvature");
    }
    if (l.zero) names.emplace_back("zero");
    if (l.running) names.emplace_back("running offset");
    if (l.drift) names.emplace_back("drift");
    if (l.hysteresis) names.emplace_back("hysteresis");
    X = Eigen::MatrixXd::Zero(r.y.size(), static_cast<Eigen::Index>(names.size()));
    linear = Eigen::VectorXd::Zero(X.cols() - shape());
    Eigen::Index k = shape();
    const Eigen::VectorXd on = (r.omega_rad_s.array() > 0.0).cast<double>();
    if (l.zero) X.col(k++).setOnes();
    if (l.running) X.col(k++) = on;
    if (l.drift) X.col(k++) = (r.t_s.array() - r.t_s.mean()) / std::max(1e-9, r.t_s.maxCoeff() - r.t_s.minCoeff());
    if (l.hysteresis) X.col(k++) = r.direction;
  }
  Eigen::Index running_column() const { return shape() + law.zero; }
  Eigen::Index drift_column() const { return X.cols() - 1 - law.hysteresis; }
  Eigen::Index shape() const { return 1 + law.exponent + 2 * law.curved; }
  double log_ratio(Eigen::Index i) const { return std::log(rows.omega_rad_s(i) / rows.centre_rad_s); }
  double square(Eigen::Index i) const {  // what c multiplies
    const double w = rows.omega_rad_s(i);
    if (!(w > 0.0)) return 0.0;
    const double l = log_ratio(i);
    return w * w * std::exp((e + (f + g * l) * l) * l);
  }
  void differentiate() {
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
      const double s = square(i);
      X(i, 0) = s;
      if (law.exponent) X(i, 1) = s > 0.0 ? c * s * log_ratio(i) : 0.0;
      const double l = s > 0.0 ? log_ratio(i) : 0.0;
      if (law.curved) {
        X(i, 2) = c * s * l * l;
        X(i, 3) = c * s * l * l * l;
      }
    }
  }
  void move(const Eigen::VectorXd& change) {
    c += change(0);
    if (law.exponent) e = std::clamp(e + change(1), -kSteepest, kSteepest);
    if (law.curved) {
      f = std::clamp(f + change(2), -kSteepest, kSteepest);
      g = std::clamp(g + change(3), -kSteepest, kSteepest);
    }
    linear += change.tail(linear.size());
  }
  Eigen::VectorXd predicted() const {
    Eigen::VectorXd p = X.rightCols(linear.size()) * linear;
    for (Eigen::Index i = 0; i < p.size(); ++i) p(i) += c * square(i);
    return p;
  }
};

double scale_of(const Eigen::VectorXd& v) { return robust_deviation({v.data(), v.data() + v.size()}); }

// Error of each row before any outlier: the samples' own where it is known, else the rows' common scatter; and what speed adds.
Eigen::VectorXd deviations(const Work& w, const Eigen::VectorXd& residual) {
  const FitRows& r = w.rows;
  const double common = std::max(scale_of(residual), 1e-6 * r.y.cwiseAbs().maxCoeff());
  Eigen::VectorXd s(r.y.size());
  for (Eigen::Index i = 0; i < s.size(); ++i) {
    const double own = r.u(i) == r.u(i) ? r.u(i) : common;
    s(i) = std::hypot(std::max(own, 0.1 * common), (2.0 + w.e) * w.c * w.square(i) * r.u_omega);
  }
  return s;
}

// What the terms have of their own beside the rows: information, and what it asks for.
struct Prior {
  Eigen::VectorXd information, pull;
};
// `s2`: variance of a row of weight 1; the rows' weights know no unit, and it brings the priors to theirs.
Prior prior_of(const Work& w, double s2) {
  Prior p{.information = Eigen::VectorXd::Zero(w.X.cols()), .pull = Eigen::VectorXd::Zero(w.X.cols())};
  const auto hold_at_zero = [&](Eigen::Index column, double now, double sd) {
    p.information(column) = s2 / (sd * sd);
    p.pull(column) = -p.information(column) * now;
  };
  const auto hold_linear = [&](Eigen::Index column, double sd) { hold_at_zero(column, w.linear(column - w.shape()), sd); };
  if (w.law.exponent) hold_at_zero(1, w.e, kPriorExponent);
  if (w.law.curved) {
    hold_at_zero(2, w.f, kPriorCurvature);
    hold_at_zero(3, w.g, kPriorThird);
  }
  if (w.law.running && w.rows.running_sd > 0.0) hold_linear(w.running_column(), w.rows.running_sd);
  if (w.law.drift) hold_linear(w.drift_column(), kPriorDrift * w.rows.y.cwiseAbs().maxCoeff());
  return p;
}

struct Solved {
  Eigen::VectorXd change;
  Eigen::MatrixXd inverse;  // of the normal equations, in the terms' units
};
Solved solve(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Eigen::VectorXd& w, const Prior& prior) {
  Eigen::VectorXd scale = (X.array().square().colwise() * w.array()).colwise().sum().sqrt().transpose();
  for (auto& v : scale) v = v > 0.0 ? v : 1.0;
  const Eigen::VectorXd back = scale.cwiseInverse();
  const Eigen::MatrixXd A = X * back.asDiagonal();
  Eigen::MatrixXd information = A.transpose() * w.asDiagonal() * A;
  information.diagonal() += prior.information.cwiseProduct(back.cwiseAbs2());
  const LdltFactor normal(information);
  const Eigen::VectorXd right = A.transpose() * w.cwiseProduct(y) + back.cwiseProduct(prior.pull);
  return {back.cwiseProduct(normal.solve(right)), back.asDiagonal() * normal.inverse() * back.asDiagonal()};
}

void start(Work& w) {
  double yw = 0.0, ww = 0.0;
  for (Eigen::Index i = 0; i < w.rows.y.size(); ++i) {
    yw += w.rows.y(i) * w.square(i);
    ww += w.square(i) * w.square(i);
  }
  w.c = yw / ww;
}

// `frozen`: weights of outliers that stay as they are; empty: Cauchy's.
JointFit run(Work& w, const Eigen::VectorXd& frozen) {
  const FitRows& rows = w.rows;
  const Eigen::Index n = rows.y.size(), k = w.X.cols();
  if (n < k + 1)
    throw Error({"fit", fmt::format("{} steps for {} unknowns", n, k), "a short run", "measure more speeds, up and down"},
                ExitCode::data_quality);
  start(w);
  JointFit f;
  f.law = w.law;
  f.weight = frozen.size() == n ? frozen : Eigen::VectorXd::Ones(n);
  Solved solved;
  Eigen::VectorXd total;
  double s2 = 1.0;
  for (int round = 0; round < kMostRounds && !f.converged; ++round) {
    w.differentiate();
    f.residual = rows.y - w.predicted();
    const Eigen::VectorXd s = deviations(w, f.residual);
    if (frozen.size() != n && round > 0) {
      const Eigen::VectorXd z = f.residual.cwiseQuotient(s);
      const double scale = kCauchy * std::max(scale_of(z), 0.2);
      f.weight = (1.0 + (z.array() / scale).square()).inverse();
    }
    total = f.weight.array() / s.array().square();
    if (round > 0) s2 = std::max(1e-12, total.dot(f.residual.cwiseAbs2()) / std::max(1.0, f.weight.sum() - static_cast<double>(k)));
    solved = solve(w.X, f.residual, total, prior_of(w, s2));
    const double before = w.c;
    w.move(solved.change);
    f.converged = round > 2 && std::abs(w.c - before) <= kSettled * std::abs(w.c);
  }
  w.differentiate();
  f.residual = rows.y - w.predicted();
  f.rms = std::sqrt(f.residual.squaredNorm() / static_cast<double>(n));
  f.degrees = std::max(1.0, f.weight.sum() - static_cast<double>(k));
  s2 = total.dot(f.residual.cwiseAbs2()) / f.degrees;
  f.covariance = solved.inverse * s2;
  f.influence = (solved.inverse.row(0) * w.X.transpose() * total.asDiagonal()).transpose();
  Eigen::VectorXd value(k);
  value(0) = w.c;
  if (w.law.exponent) value(1) = w.e;
  if (w.law.curved) {
    value(2) = w.f;
    value(3) = w.g;
  }
  value.tail(w.linear.size()) = w.linear;
  for (Eigen::Index i = 0; i < k; ++i)
    f.terms.push_back({w.names[static_cast<std::size_t>(i)], value(i), std::sqrt(std::max(0.0, f.covariance(i, i)))});
  return f;
}

FitRows drawn(const FitRows& rows, const std::vector<Eigen::Index>& which) {
  FitRows out = rows;
  const auto n = static_cast<Eigen::Index>(which.size());
  for (auto* v : {&out.y, &out.omega_rad_s, &out.t_s, &out.direction, &out.u}) v->resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index j = which[static_cast<std::size_t>(i)];
    out.y(i) = rows.y(j);
    out.omega_rad_s(i) = rows.omega_rad_s(j);
    out.t_s(i) = rows.t_s(j);
    out.direction(i) = rows.direction(j);

    out.u(i) = rows.u(j);
  }
  return out;
}

// Rows of each block; zeros, and running blocks of about one speed, are drawn apart, so that each draw is a run of the same design.
std::vector<std::vector<std::vector<Eigen::Index>>> strata(const FitRows& rows) {
  constexpr std::size_t kBlocksOfASpeed = 4;
  std::vector<std::vector<Eigen::Index>> zeros, running;
  int last_zero = -1, last_running = -1;
  for (Eigen::Index i = 0; i < rows.y.size(); ++i) {
    const bool runs = rows.omega_rad_s(i) > 0.0;
    auto& in = runs ? running : zeros;
    int& last = runs ? last_running : last_zero;
    const int b = rows.block[static_cast<std::size_t>(i)];
    if (in.empty() || last != b) in.emplace_back();
    last = b;
    in.back().push_back(i);
  }
  std::stable_sort(running.begin(), running.end(),
                   [&](const auto& a, const auto& b) { return rows.omega_rad_s(a.front()) < rows.omega_rad_s(b.front()); });
  std::vector<std::vector<std::vector<Eigen::Index>>> out{zeros};
  const std::size_t groups = std::max<std::size_t>(1, running.size() / kBlocksOfASpeed);
  for (std::size_t g = 0; g < groups; ++g)
    out.emplace_back(running.begin() + static_cast<std::ptrdiff_t>(g * running.size() / groups),
                     running.begin() + static_cast<std::ptrdiff_t>((g + 1) * running.size() / groups));
  return out;
}

}  // namespace

double JointFit::value(const std::string& name) const {
  for (const FittedTerm& t : terms)
    if (t.name == name) return t.value;
  return 0.0;
}

std::string law_text(const FitLaw& law, const std::string& c) {
  std::string s = c + (law.curved ? " ω^p(ω)" : law.exponent ? " ω^p" : " ω²");
  if (law.zero) s += " + zero";
  if (law.running) s += " + running offset";
  if (law.drift) s += " + drift";
  if (law.hysteresis) s += " + hysteresis";
  return s;
}

JointFit fit_jointly(const FitRows& rows, const FitLaw& law) {
  Work w(rows, law);
  return run(w, {});
}

std::vector<JointFit> compare_laws(const FitRows& rows, const std::vector<FitLaw>& laws) {
  std::vector<JointFit> out;
  Eigen::VectorXd weight;
  std::size_t most = 0;
  for (const FitLaw& law : laws) {
    Work w(rows, law);
    const JointFit f = run(w, {});
    if (f.terms.size() >= most) {
      most = f.terms.size();
      weight = f.weight;
    }
  }
  for (const FitLaw& law : laws) {
    Work w(rows, law);
    JointFit f = run(w, weight);
    const double n = weight.sum(), k = static_cast<double>(f.terms.size()) + 1.0;  // and the scatter
    const double rss = std::max(weight.dot(f.residual.cwiseAbs2()), 1e-300);
    f.aicc = n * std::log(rss / n) + 2.0 * k + (n > k + 1.0 ? 2.0 * k * (k + 1.0) / (n - k - 1.0) : 1e3);
    out.push_back(std::move(f));
  }
  return out;
}

Bootstrap bootstrap_c(const FitRows& rows, const JointFit& fit, int draws, std::uint64_t seed) {
  const auto parts = strata(rows);
  const RandomStream random(seed, kDrawsModule);
  std::uint64_t sample = 0;
  std::vector<double> c;
  double blocks = 0.0;
  for (const auto& p : parts) blocks += static_cast<double>(p.size());
  for (int d = 0; d < draws; ++d) {
    std::vector<Eigen::Index> which;
    for (const auto& part : parts)
      for (std::size_t b = 0; b < part.size(); ++b) {
        const auto pick = std::min(part.size() - 1, static_cast<std::size_t>(random.uniform(sample++) * static_cast<double>(part.size())));
        which.insert(which.end(), part[pick].begin(), part[pick].end());
      }
    const FitRows again = drawn(rows, which);
    Work w(again, fit.law);
    const JointFit f = run(w, {});
    if (f.converged && f.terms[0].value > 0.0) c.push_back(f.terms[0].value);
  }
  Bootstrap out;
  out.draws = static_cast<int>(c.size());
  out.seed = seed;
  if (c.size() < 20) return out;
  // Half the width between the quantiles of ±1σ, as draws that miss a level altogether have long tails; and the plain factor by which
  // residuals of a fit of k terms fall short of the errors.
  const double k = static_cast<double>(fit.terms.size()), widen = blocks > k + 1.0 ? std::sqrt(blocks / (blocks - k)) : 2.0;
  out.u = 0.5 * (quantile(c, 0.8413) - quantile(c, 0.1587)) * widen;
  const double middle = fit.terms[0].value;
  out.low = middle + (quantile(c, 0.025) - middle) * widen;
  out.high = middle + (quantile(c, 0.975) - middle) * widen;
  return out;
}

}  // namespace rotorloop::stand
