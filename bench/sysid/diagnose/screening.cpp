#include "bench/sysid/diagnose/screening.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/diagnose/dynamic_term_scan.hpp"
#include "bench/sysid/estimate/fit_layout.hpp"
#include "bench/sysid/estimate/flight_motion.hpp"
#include "bench/sysid/estimate/model/measurement_terms.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "bench/sysid/identify/gauge.hpp"
#include "host/base/error.hpp"
#include "host/base/parallel.hpp"
#include "host/effects/rotor_groups.hpp"
#include "host/effects/surroundings.hpp"
#include "host/effects/term_size.hpp"

namespace rotorloop::diagnose {
namespace {

using Index = ScoreTable::Index;

constexpr double kFoldBlocks = 4;  // neighbouring blocks that stay in one fold
constexpr int kFolds = 5;

// The model with every term of the library in it: those that it lacks at their neutral values.
estimate::ModelValues with_library(const estimate::ModelValues& values, const std::vector<Candidate>& candidates,
                                   std::vector<int>& parameters) {
  estimate::ModelValues all = values;
  for (const Candidate& c : candidates) {
    if (!c.term) continue;
    if (!all.terms.add(*c.term)) {
      throw Error(
          {c.id, fmt::format("the library has more terms than a model can hold ({})", host::kMaxTerms), "", "leave some out (--without)"});
    }
    const std::size_t first = all.terms.first_parameter(all.terms.size() - 1);
    for (std::size_t k = 0; k < c.parameters.size(); ++k) {
      parameters.push_back(estimate::kCoreParameters + static_cast<int>(first + k));
      all.values.push_back(c.parameters[k].neutral);
    }
    all.values.resize(estimate::kCoreParameters + all.terms.parameters(), 0.0);  // its state starts at rest
  }
  return all;
}

estimate::BodyState between(const estimate::BodyState& a, const estimate::BodyState& b, double share) {
  return {a.p_W_m + share * (b.p_W_m - a.p_W_m), a.v_W_m_s + share * (b.v_W_m_s - a.v_W_m_s), a.q_WB.slerp(share, b.q_WB),
          a.w_B_rad_s + share * (b.w_B_rad_s - a.w_B_rad_s)};
}

// What the candidates would add to each reading.
void add_measurements(const estimate::GridFlight& g, const std::vector<estimate::BodyState>& states, const estimate::ModelValues& values,
                      const std::vector<int>& parameters, const estimate::Model& model, const estimate::RotorInput& input,
                      estimate::ExtraColumns& out) {
  std::vector<int> sensor_parameters;
  std::vector<std::size_t> place;
  for (const int p : estimate::measurement_parameters(values.terms)) {
    const auto found = std::find(parameters.begin(), parameters.end(), p);
    if (found == parameters.end()) continue;
    sensor_parameters.push_back(p);
    place.push_back(static_cast<std::size_t>(found - parameters.begin()));
  }
  if (sensor_parameters.empty()) return;
  const auto width = static_cast<std::size_t>(out.count);
  std::vector<estimate::MeasurementChange> by(sensor_parameters.size());
  std::size_t hint = 0;
  const auto at = [&](double t_s, const estimate::BodyState& x) {
    const estimate::RotorInputSample u = input.at(t_s, hint, false);
    estimate::measurement_change(values, x, u, estimate::sensed_moment(model, x, u, t_s, t_s - g.time_s(0)), sensor_parameters, by);
  };
  const auto put = [](double* to, const Eigen::Vector3d& v) { std::copy(v.data(), v.data() + 3, to); };
  const Eigen::Quaterniond to_sensor = values.q_BS().conjugate();
  out.pose.assign(g.pose.size() * width * 6, 0.0);
  for (std::size_t i = 0; i < g.pose.size(); ++i) {
    at(g.time_s(g.pose[i].node), states[g.pose[i].node]);
    for (std::size_t k = 0; k < by.size(); ++k) {
      put(&out.pose[(i * width + place[k]) * 6], by[k].position_W_m);
      put(&out.pose[(i * width + place[k]) * 6 + 3], to_sensor * by[k].turn_B_rad);
    }
  }
  const auto vectors = [&](const std::vector<estimate::VectorFix>& list, std::vector<double>& to,
                           Eigen::Vector3d estimate::MeasurementChange::*what) {
    to.assign(list.size() * width * 3, 0.0);
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::size_t k0 = list[i].node, k1 = estimate::neighbour(g, list[i]);
      at(g.time_s(k0) + list[i].late_s, k0 == k1 ? states[k0] : between(states[k0], states[k1], std::fabs(list[i].late_s) / g.step_s));
      for (std::size_t k = 0; k < by.size(); ++k) put(&to[(i * width + place[k]) * 3], by[k].*what);
    }
  };
  vectors(g.gyro, out.gyro, &estimate::MeasurementChange::gyro_B_rad_s);
  vectors(g.accel, out.accel, &estimate::MeasurementChange::accel_B_m_s2);
}

estimate::ExtraColumns series_of(const estimate::GridFlight& g, const std::vector<estimate::BodyState>& states,
                                 const estimate::ModelValues& fitted, const std::vector<Candidate>& candidates) {
  std::vector<int> parameters;
  const estimate::ModelValues values = with_library(fitted, candidates, parameters);
  estimate::ExtraColumns out;
  out.count = static_cast<Index>(parameters.size());
  if (out.count == 0) return out;
  const estimate::Model model(values, parameters);
  estimate::RotorInput input = g.input;
  if (values.terms.memory() > 0) input.follow(std::make_shared<const estimate::Motion>(estimate::motion_of(g, states)));
  input.prepare(values);
  const auto per_step = static_cast<std::size_t>(6 * out.count);
  out.wrench.assign((g.nodes - 1) * per_step, 0.0);
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(6, out.count);
  std::size_t hint = 0;
  for (std::size_t k = 0; k + 1 < g.nodes; ++k) {
    if (!g.linked[k]) continue;
    const double from = g.time_s(k), to = g.time_s(k + 1);
    model.wrench_by_extras(between(states[k], states[k + 1], 0.5), input.mean(from, to, g.substeps, hint, false), 0.5 * (from + to), by);
    Eigen::Map<Eigen::MatrixXd>(&out.wrench[k * per_step], 6, out.count) = by;
  }
  add_measurements(g, states, values, parameters, model, input, out);
  return out;
}

// Sums the sweeps of all flights into one table. `beside`: columns that each sweep has behind those of its free parameters.
ScoreTable gathered(const estimate::FitProblem& p, const estimate::Fit& fit, std::vector<estimate::Reduced> reduced, Index beside) {
  const estimate::Layout layout = estimate::make_layout(p);
  const estimate::Priors priors(p, layout);
  ScoreTable table;
  table.base = static_cast<Index>(layout.estimates.size());
  const Index n = table.base + beside;
  table.information = Eigen::MatrixXd::Zero(n, n);
  table.score = Eigen::VectorXd::Zero(n);
  for (std::size_t f = 0; f < reduced.size(); ++f) {
    std::vector<Index> at = layout.of_flight[f];
    for (Index c = 0; c < beside; ++c) at.push_back(table.base + c);
    table.score(at) += reduced[f].score;
    table.information(at, at) += reduced[f].information;
    table.measurements += static_cast<double>(reduced[f].residuals) - 12.0 * static_cast<double>(p.flights[f]->tied_nodes());
    for (estimate::ScoreBlock& b : reduced[f].blocks) {
      table.fold.push_back(static_cast<int>(static_cast<double>(table.blocks.size()) / kFoldBlocks) % kFolds);
      table.blocks.push_back({f, b.from_s, b.to_s, at, std::move(b.information), std::move(b.score)});
    }
  }
  Eigen::VectorXd theta(table.base);
  for (Index i = 0; i < table.base; ++i) theta[i] = fit.estimates[static_cast<std::size_t>(i)].value;
  table.information.topLeftCorner(table.base, table.base) += priors.information();
  table.score.head(table.base) += priors.score(theta);
  for (const auto& group : identify::rotor_groups(p.start.terms, p.free)) {
    ColumnSet held;
    for (std::size_t i = 0; i < fit.estimates.size(); ++i) {
      if (std::find(group.begin(), group.end(), fit.estimates[i].parameter) != group.end()) held.push_back(static_cast<Index>(i));
    }
    table.sums_held.push_back(std::move(held));
  }
  return table;
}

// One more sweep. `held`: core parameters beside the free ones, in the order of their columns.
ScoreTable swept_table(const identify::Identification& r, const estimate::Columns& held, const std::vector<estimate::ExtraColumns>& extra,
                       double block_s, int threads, estimate::StopFit stop) {
  const estimate::FitProblem& p = r.problem;
  estimate::Columns columns;
  for (const estimate::FreeParameter& f : p.free) columns.push_back(f.parameter);
  columns.insert(columns.end(), held.begin(), held.end());
  std::vector<estimate::Reduced> reduced(p.flights.size());
  parallel_for(
      p.flights.size(), threads,
      [&](std::size_t f) {
        std::vector<estimate::BodyState> states = r.fit.states[f];
        estimate::Chain chain(*p.flights[f], states, states);
        reduced[f] = chain.sweep(estimate::Residuals(*p.flights[f], r.fit.values[f], r.fit.noise[f], columns, &extra[f]),
                                 {.keep_factors = false, .block_s = block_s});
      },
      stop.flag);
  stop.check();
  return gathered(p, r.fit, std::move(reduced), static_cast<Index>(held.size()) + extra.front().count);
}

}  // namespace

ScoreTable table_of(const identify::Identification& r) { return gathered(r.problem, r.fit, r.fit.reduced, 0); }

ScoreTable table_with(const identify::Identification& r, const std::vector<estimate::ExtraColumns>& columns, double block_s, int threads,
                      estimate::StopFit stop, const std::vector<int>& held) {
  return swept_table(r, held, columns, block_s, threads, stop);
}

Screening screen(const identify::Identification& r, const std::vector<std::string>& without, std::span<const host::Term* const> library,
                 double block_s, int threads, estimate::StopFit stop) {
  const estimate::FitProblem& p = r.problem;
  Screening out;
  out.candidates = candidates_for(r, without, library);
  estimate::Columns held;
  for (const Candidate& c : out.candidates) held.insert(held.end(), c.core.begin(), c.core.end());
  for (Candidate& c : out.candidates) {
    stop.check();
    if (c.term && !c.term->info.scan.empty()) start_where_scan_is_best(r, c, threads);
  }
  auto next = static_cast<Index>(r.fit.estimates.size());
  for (Candidate& c : out.candidates) {
    for (std::size_t k = 0; k < c.parameters.size(); ++k) c.columns.push_back(next++);
  }
  out.series.resize(p.flights.size());
  parallel_for(
      p.flights.size(), threads,
      [&](std::size_t f) { out.series[f] = series_of(*p.flights[f], r.fit.states[f], r.fit.values[f], out.candidates); }, stop.flag);
  stop.check();
  out.table = swept_table(r, held, out.series, block_s, threads, stop);
  for (const Candidate& c : out.candidates) {
    if (!host::common_part(c.id).empty()) out.table.sums_held.push_back(c.columns);
  }
  return out;
}

}  // namespace rotorloop::diagnose
