#include "bench/sysid/diagnose/dynamic_term_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "bench/sysid/estimate/flight_motion.hpp"
#include "host/base/error.hpp"
#include "host/base/parallel.hpp"

namespace rotorloop::diagnose {
namespace {

using Rows = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Wrench = Eigen::Matrix<double, 6, 1>;

constexpr double kEvery_s = 0.02;  // of the residual: loads that swing are slower

// What the model leaves on the body, in units of its own noise over a step: force in the world, torque in the body.
struct UnexplainedRows {
  std::vector<std::size_t> node;
  Rows value;  // accelerations over the process noise
};

UnexplainedRows unexplained_rows(const estimate::GridFlight& g, const std::vector<estimate::BodyState>& states,
                                 const estimate::ModelValues& values, const estimate::NoiseModel& noise) {
  estimate::RotorInput input = g.input;
  if (values.terms.memory() > 0) input.follow(std::make_shared<const estimate::Motion>(estimate::motion_of(g, states)));
  input.prepare(values, false);
  const estimate::Model model(values);
  const auto stride = static_cast<std::size_t>(std::max(1.0, std::round(kEvery_s / g.step_s)));
  UnexplainedRows out;
  std::vector<Wrench> rows;
  std::size_t hint = 0;
  for (std::size_t k = 0; k + stride < g.nodes; k += stride) {
    Wrench sum = Wrench::Zero();
    bool whole = true;
    for (std::size_t j = k; j < k + stride && whole; ++j) {
      whole = g.linked[j];
      if (!whole) break;
      const estimate::StateError d =
          estimate::difference(model.step(states[j], input, hint, g.time_s(j), g.time_s(j + 1), g.substeps), states[j + 1]);
      sum.head<3>() += d.segment<3>(3).cwiseQuotient(noise.force_m_s2_rtHz);
      sum.tail<3>() += d.segment<3>(9).cwiseQuotient(noise.angular_rad_s2_rtHz);
    }
    if (!whole) continue;
    out.node.push_back(k + stride / 2);
    rows.push_back(sum / (static_cast<double>(stride) * g.step_s));
  }
  out.value.resize(6, static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) out.value.col(static_cast<Eigen::Index>(i)) = rows[i];
  return out;
}

void without_means(Rows& x) {
  if (x.cols() > 0) x.colwise() -= Wrench(x.rowwise().mean());
}

constexpr double kProbeShare = 1e-3;  // of a size that matters: what the term is given to see what it does

// Force and torque (N, N m, body axes) of a model along the states of a flight, at its nodes.
Rows wrench_along(const estimate::GridFlight& g, const std::vector<estimate::BodyState>& states,
                  const std::shared_ptr<const estimate::Motion>& motion, const estimate::ModelValues& values) {
  estimate::RotorInput input = g.input;
  if (values.terms.memory() > 0) input.follow(motion);
  input.prepare(values, false);
  const estimate::Model model(values);
  Rows out(6, static_cast<Eigen::Index>(g.nodes));
  std::size_t hint = 0;
  for (std::size_t k = 0; k < g.nodes; ++k) {
    const estimate::Instant now = model.instant(states[k], input.at(g.time_s(k), hint, false), g.time_s(k));
    out.col(static_cast<Eigen::Index>(k)) << now.force_B_N, now.torque_B_N_m;
  }
  return out;
}

// The model with one term more. Throws Error when it holds as many as there can be: its values would then belong to other terms.
estimate::ModelValues with_term(const estimate::ModelValues& model, const host::Term& term, const std::vector<double>& parameters) {
  estimate::ModelValues out = model;
  if (!out.terms.add(term))
    throw Error({std::string(term.info.id),
                 fmt::format("cannot be tried beside the model's {} effects with {} parameters: no room for another", out.terms.size(),
                             out.terms.parameters()),
                 "", "take an effect out of the vehicle file, or leave this one out with --without"});
  out.values.insert(out.values.end(), parameters.begin(), parameters.end());
  out.values.resize(estimate::kCoreParameters + out.terms.parameters(), 0.0);
  return out;
}

}  // namespace

std::vector<ScanPoint> scan_dynamic_term(const identify::Identification& r, const host::Term& term, int threads) {
  const std::size_t flights = r.flights.size(), width = term.info.parameters.size(), points = term.info.scan.size() / width;
  const host::TermParameter& size_of = term.info.parameters.front();
  const double given = size_of.scale * kProbeShare;
  std::vector<UnexplainedRows> left(flights);
  std::vector<Rows> without(flights);
  std::vector<std::shared_ptr<const estimate::Motion>> motion(flights);
  double all = 0.0;
  for (std::size_t f = 0; f < flights; ++f) {
    motion[f] = std::make_shared<const estimate::Motion>(estimate::motion_of(r.flights[f], r.fit.states[f]));
    without[f] = wrench_along(r.flights[f], r.fit.states[f], motion[f], r.fit.values[f]);
    left[f] = unexplained_rows(r.flights[f], r.fit.states[f], r.fit.values[f], r.fit.noise[f]);
    without_means(left[f].value);
    all += left[f].value.squaredNorm();
  }
  std::vector<ScanPoint> out(points);
  const auto try_point = [&](std::size_t i) {
    const auto row = term.info.scan.subspan(i * width, width);
    ScanPoint& p = out[i];
    p.parameters.assign(row.begin(), row.end());
    p.parameters.front() = size_of.neutral + given;
    double along = 0.0, size = 0.0;
    for (std::size_t f = 0; f < flights; ++f) {
      const estimate::ModelValues& v = r.fit.values[f];
      const Rows with = wrench_along(r.flights[f], r.fit.states[f], motion[f], with_term(v, term, p.parameters));
      const Rows wrench = (with - without[f]) / given;
      const Eigen::Matrix3d inverse_inertia = v.inertia_kg_m2().inverse();
      Rows a(6, left[f].value.cols());
      for (Eigen::Index c = 0; c < a.cols(); ++c) {
        const std::size_t k = left[f].node[static_cast<std::size_t>(c)];
        const Wrench w = wrench.col(static_cast<Eigen::Index>(k));
        a.col(c).head<3>() =
            (r.fit.states[f][k].q_WB * Eigen::Vector3d(w.head<3>() / v[estimate::kMass])).cwiseQuotient(r.fit.noise[f].force_m_s2_rtHz);
        a.col(c).tail<3>() = (inverse_inertia * w.tail<3>()).cwiseQuotient(r.fit.noise[f].angular_rad_s2_rtHz);
      }
      without_means(a);
      along += a.cwiseProduct(left[f].value).sum();
      size += a.squaredNorm();
    }
    const double estimate = size > 0.0 ? along / size : 0.0;
    p.parameters.front() = size_of.neutral + estimate;
    p.gain = all > 0.0 && p.parameters.front() > size_of.min ? estimate * along / all : 0.0;
  };
  parallel_for(points, threads, try_point);
  std::stable_sort(out.begin(), out.end(), [](const ScanPoint& a, const ScanPoint& b) { return a.gain > b.gain; });
  return out;
}

void start_where_scan_is_best(const identify::Identification& fitted, Candidate& c, int threads) {
  const std::vector<ScanPoint> points = scan_dynamic_term(fitted, *c.term, threads);
  if (points.empty()) return;
  for (std::size_t k = 1; k < c.parameters.size(); ++k) c.parameters[k].neutral = points.front().parameters[k];
}

}  // namespace rotorloop::diagnose
