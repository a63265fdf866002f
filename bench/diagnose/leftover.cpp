#include "bench/diagnose/leftover.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/diagnose/refit.hpp"
#include "bench/estimate/flight_motion.hpp"
#include "bench/estimate/model/rotations.hpp"
#include "host/effects/rotor_groups.hpp"

namespace rotorloop::diagnose {
namespace {

using Index = ScoreTable::Index;

constexpr std::size_t kAxesOfWrench = 6, kVariations = 6;
// Of the largest load among forces, or among torques, root mean square: an axis with less is not one that the law acts on.
constexpr double kActs = 1e-3;

using Wrench = Eigen::Matrix<double, 6, 1>;

// What the effect does in each step of a flight, and what it is varied with.
struct LoadSeries {
  std::vector<Wrench> load;
  std::vector<std::array<double, kVariations>> by;
};

LoadSeries load_series(const estimate::GridFlight& g, const std::vector<estimate::BodyState>& states, const estimate::ModelValues& values,
                       const std::vector<int>& parameters, const Eigen::VectorXd& size) {
  const estimate::Model model(values, parameters);
  estimate::RotorInput input = g.input;
  if (values.terms.memory() > 0) input.follow(std::make_shared<const estimate::Motion>(estimate::motion_of(g, states)));
  input.prepare(values);
  LoadSeries out{std::vector<Wrench>(g.nodes - 1, Wrench::Zero()), std::vector<std::array<double, kVariations>>(g.nodes - 1)};
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(6, static_cast<Index>(parameters.size()));
  std::size_t hint = 0;
  for (std::size_t k = 0; k + 1 < g.nodes; ++k) {
    if (!g.linked[k]) continue;
    const double from = g.time_s(k), to = g.time_s(k + 1);
    const estimate::BodyState x = estimate::moved(states[k], 0.5 * estimate::difference(states[k], states[k + 1]));
    const estimate::RotorInputSample u = input.mean(from, to, g.substeps, hint, false);
    by.setZero();
    model.wrench_by_extras(x, u, 0.5 * (from + to), by);
    out.load[k] = by * size;
    const Eigen::Vector3d v = x.q_WB.conjugate() * x.v_W_m_s;
    double omega = 0.0;
    for (const double w : u.omega_rad_s) omega += 0.25 * w;
    out.by[k] = {1.0, v.x(), v.y(), v.z(), std::hypot(v.x(), v.y()), omega};
  }
  return out;
}

// The axes on which the effect acts on any flight.
std::vector<Index> acting_axes(const std::vector<LoadSeries>& flights) {
  Wrench power = Wrench::Zero();
  for (const LoadSeries& f : flights) {
    for (const Wrench& w : f.load) power += w.cwiseAbs2();
  }
  std::vector<Index> out;
  for (Index a = 0; a < 6; ++a) {
    const double largest = a < 3 ? power.head<3>().maxCoeff() : power.tail<3>().maxCoeff();
    if (power[a] > 0.0 && power[a] > kActs * kActs * largest) out.push_back(a);
  }
  return out;
}

// The columns of one term of the screening behind those of `out`.
void append(const estimate::ExtraColumns& all, const ColumnSet& which, Index first, estimate::ExtraColumns& out) {
  const auto widened = [&](const std::vector<double>& from, std::size_t rows, std::vector<double>& to, std::size_t items_if_empty) {
    const auto old_width = static_cast<std::size_t>(all.count) * rows, kept = static_cast<std::size_t>(out.count) * rows,
               added = which.size() * rows;
    if (from.empty() && to.empty()) return;
    const std::size_t items = from.empty() ? items_if_empty : from.size() / old_width;
    std::vector<double> wide(items * (kept + added), 0.0);
    for (std::size_t i = 0; i < items; ++i) {
      if (!to.empty()) std::copy_n(&to[i * kept], kept, &wide[i * (kept + added)]);
      if (from.empty()) continue;
      for (std::size_t c = 0; c < which.size(); ++c)
        std::copy_n(&from[i * old_width + static_cast<std::size_t>(which[c] - first) * rows], rows,
                    &wide[i * (kept + added) + kept + c * rows]);
    }
    to = std::move(wide);
  };
  const auto items = [&](const std::vector<double>& list, std::size_t rows) {
    return out.count > 0 ? list.size() / (static_cast<std::size_t>(out.count) * rows) : 0;
  };
  widened(all.wrench, 6, out.wrench, items(out.wrench, 6));
  widened(all.pose, 6, out.pose, items(out.pose, 6));
  widened(all.gyro, 3, out.gyro, items(out.gyro, 3));
  widened(all.accel, 3, out.accel, items(out.accel, 3));
  out.count += static_cast<Index>(which.size());
}

}  // namespace

std::vector<estimate::ExtraColumns> law_variations(const identify::Identification& r, const Candidate& found) {
  if (!found.term) return {};
  const std::vector<int> parameters = parameters_of(found, r.problem.start.terms);
  std::vector<LoadSeries> flights;
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    const estimate::ModelValues& values = r.fit.values[f];
    Eigen::VectorXd size(static_cast<Index>(parameters.size()));
    for (std::size_t k = 0; k < parameters.size(); ++k) size[static_cast<Index>(k)] = values[parameters[k]] - found.parameters[k].neutral;
    flights.push_back(load_series(*r.problem.flights[f], r.fit.states[f], values, parameters, size));
  }
  const std::vector<Index> axes = acting_axes(flights);
  if (axes.empty()) return {};
  std::vector<estimate::ExtraColumns> out;
  for (const LoadSeries& f : flights) {
    estimate::ExtraColumns& c = out.emplace_back();
    const std::size_t columns = axes.size() * kVariations, wide = columns * kAxesOfWrench;
    c.count = static_cast<Index>(columns);
    c.wrench.assign(f.load.size() * wide, 0.0);
    for (std::size_t k = 0; k < f.load.size(); ++k) {
      for (std::size_t a = 0; a < axes.size(); ++a) {
        for (std::size_t m = 0; m < kVariations; ++m)
          c.wrench[k * wide + (a * kVariations + m) * kAxesOfWrench + static_cast<std::size_t>(axes[a])] = f.load[k][axes[a]] * f.by[k][m];
      }
    }
  }
  return out;
}

std::vector<double> left_beside(const identify::Identification& r, const Candidate& found, const Screening& s,
                                const std::vector<const Candidate*>& candidates, double block_s, int threads, estimate::StopFit stop) {
  std::vector<double> out(candidates.size(), 1.0);
  std::vector<estimate::ExtraColumns> columns = law_variations(r, found);
  if (columns.empty()) return out;
  const auto first_of_terms = static_cast<Index>(s.table.information.rows()) - s.series.front().count;
  const auto base = static_cast<Index>(r.fit.estimates.size());
  ColumnSet variations;
  for (Index c = 0; c < columns.front().count; ++c) variations.push_back(base + c);
  std::vector<ColumnSet> group(candidates.size());
  Index next = base + columns.front().count;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!candidates[i]->term) continue;
    for (std::size_t f = 0; f < columns.size(); ++f) append(s.series[f], candidates[i]->columns, first_of_terms, columns[f]);
    for (std::size_t k = 0; k < candidates[i]->columns.size(); ++k) group[i].push_back(next++);
  }
  ScoreTable table = table_with(r, columns, block_s, threads, stop);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!group[i].empty() && !host::common_part(candidates[i]->id).empty()) table.sums_held.push_back(group[i]);
  }
  const ColumnSet model = base_columns(table), beside = with(model, variations);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (group[i].empty()) continue;
    const Eigen::VectorXd size = test_group(table, model, group[i]).estimate;
    const double alone = information_along(table, model, group[i], size);
    if (alone > 0.0) out[i] = std::clamp(information_along(table, beside, group[i], size) / alone, 0.0, 1.0);
  }
  return out;
}

}  // namespace rotorloop::diagnose
