#include "bench/sysid/diagnose/law_remainder.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/sysid/diagnose/ranking/refit.hpp"
#include "bench/sysid/estimate/flight_motion.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/effects/rotor_groups.hpp"
#include "host/effects/term_size.hpp"

namespace rotorloop::diagnose {
namespace {

using Index = ScoreTable::Index;

constexpr std::size_t kAxesOfWrench = 6, kVariations = 9;
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
    const auto& w = u.omega_rad_s;
    out.by[k] = {1.0, v.x(), v.y(), v.z(), v.norm(), w[0], w[1], w[2], w[3]};
  }
  return out;
}

// What the law is varied with, in units of its own root mean square over all flights, each moment as heavy as the load is there.
void scale(std::vector<LoadSeries>& flights) {
  std::array<double, kVariations> power{};
  double weight = 0.0;
  for (const LoadSeries& f : flights) {
    for (std::size_t k = 0; k < f.load.size(); ++k) {
      const double w = f.load[k].squaredNorm();
      weight += w;
      for (std::size_t m = 0; m < kVariations; ++m) power[m] += w * f.by[k][m] * f.by[k][m];
    }
  }
  for (LoadSeries& f : flights) {
    for (auto& by : f.by) {
      for (std::size_t m = 0; m < kVariations; ++m) by[m] *= power[m] > 0.0 ? std::sqrt(weight / power[m]) : 0.0;
    }
  }
}

// One load of the law on one axis: `from` is the axis on which the law has it.
struct Varied {
  Index from = 0, on = 0;
};

// The loads that stand on the axes asked for. An axis' own load, and what a force or a torque leaves on another axis.
std::vector<Varied> varied_loads(const std::vector<LoadSeries>& flights, const AxesOfWrench& on) {
  Wrench power = Wrench::Zero();
  for (const LoadSeries& f : flights) {
    for (const Wrench& w : f.load) power += w.cwiseAbs2();
  }
  Index force = 0, torque = 0;
  const double largest_force = power.head<3>().maxCoeff(&force), largest_torque = power.tail<3>().maxCoeff(&torque);
  torque += 3;
  std::vector<Varied> out;
  for (Index a = 0; a < 6; ++a) {
    if (!on[static_cast<std::size_t>(a)]) continue;
    const double largest = a < 3 ? largest_force : largest_torque;
    if (power[a] > 0.0 && power[a] > kActs * kActs * largest) out.push_back({a, a});
    if (largest_force > 0.0 && a != force && a != force + 3) out.push_back({force, a});  // no force has a moment about its own line
    if (largest_torque > 0.0 && a >= 3 && a != torque) out.push_back({torque, a});
  }
  return out;
}

// Of what the data say of a group at a size, the share that is left beside variations of a given standard deviation.
double left_to(ScoreTable& table, const ColumnSet& model, const ColumnSet& group, const ColumnSet& variations, const Eigen::VectorXd& size,
               double law_error) {
  const double alone = information_along(table, model, group, size);
  if (alone <= 0.0) return 1.0;
  for (const Index c : variations) table.information(c, c) += 1.0 / (law_error * law_error);
  return std::clamp(information_along(table, with(model, variations), group, size) / alone, 0.0, 1.0);
}

// The loads of an effect that the fit has, at its size.
std::vector<LoadSeries> loads_of(const identify::Identification& r, const Candidate& found) {
  const std::vector<int> parameters = parameters_of(found, r.problem.start.terms);
  std::vector<LoadSeries> flights;
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    const estimate::ModelValues& values = r.fit.values[f];
    Eigen::VectorXd size(static_cast<Index>(parameters.size()));
    for (std::size_t k = 0; k < parameters.size(); ++k) size[static_cast<Index>(k)] = values[parameters[k]] - found.parameters[k].neutral;
    flights.push_back(load_series(*r.problem.flights[f], r.fit.states[f], values, parameters, size));
  }
  return flights;
}

// Those with a part in forces, or in torques, that counts; all where there is none, for what only sensors read.
AxesOfWrench axes_of(const std::array<double, kAxesOfWrench>& power) {
  const double force = *std::max_element(power.begin(), power.begin() + 3), torque = *std::max_element(power.begin() + 3, power.end());
  AxesOfWrench out{};
  for (std::size_t a = 0; a < kAxesOfWrench; ++a) out[a] = power[a] > 0.0 && power[a] > kActs * kActs * (a < 3 ? force : torque);
  return force > 0.0 || torque > 0.0 ? out : kEveryAxis;
}
AxesOfWrench axes_of(const std::vector<LoadSeries>& flights) {
  std::array<double, kAxesOfWrench> power{};
  for (const LoadSeries& f : flights) {
    for (const Wrench& w : f.load) {
      for (std::size_t a = 0; a < kAxesOfWrench; ++a) power[a] += w[static_cast<Index>(a)] * w[static_cast<Index>(a)];
    }
  }
  return axes_of(power);
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

// The axes on which a term acts on any flight of the screening.
AxesOfWrench acting_axes(const Screening& s, const ColumnSet& which, Index first) {
  std::array<double, kAxesOfWrench> power{};
  for (const estimate::ExtraColumns& c : s.series) {
    const auto wide = static_cast<std::size_t>(c.count) * kAxesOfWrench;
    for (std::size_t at = 0; at + wide <= c.wrench.size(); at += wide) {
      for (const Index k : which) {
        for (std::size_t a = 0; a < kAxesOfWrench; ++a) {
          const double x = c.wrench[at + static_cast<std::size_t>(k - first) * kAxesOfWrench + a];
          power[a] += x * x;
        }
      }
    }
  }
  return axes_of(power);
}

}  // namespace

std::vector<estimate::ExtraColumns> law_variations(const identify::Identification& r, const Candidate& found, const AxesOfWrench& on) {
  if (!found.term) return {};
  std::vector<LoadSeries> flights = loads_of(r, found);
  scale(flights);
  const std::vector<Varied> loads = varied_loads(flights, on);
  const double arm_m = host::arm_m(r.problem.start.geometry);
  if (loads.empty()) return {};
  std::vector<estimate::ExtraColumns> out;
  for (const LoadSeries& f : flights) {
    estimate::ExtraColumns& c = out.emplace_back();
    const std::size_t columns = loads.size() * kVariations, wide = columns * kAxesOfWrench;
    c.count = static_cast<Index>(columns);
    c.wrench.assign(f.load.size() * wide, 0.0);
    for (std::size_t k = 0; k < f.load.size(); ++k) {
      for (std::size_t i = 0; i < loads.size(); ++i) {
        const double load = f.load[k][loads[i].from] * (loads[i].from < 3 && loads[i].on >= 3 ? arm_m : 1.0);
        for (std::size_t m = 0; m < kVariations; ++m)
          c.wrench[k * wide + (i * kVariations + m) * kAxesOfWrench + static_cast<std::size_t>(loads[i].on)] = load * f.by[k][m];
      }
    }
  }
  return out;
}

double share_beside_law(const identify::Identification& r, const Candidate& found, const Screening& s, const Candidate& candidate,
                        double law_error, double block_s, int threads, estimate::StopFit stop) {
  const auto first_of_terms = static_cast<Index>(s.table.information.rows()) - s.series.front().count;
  std::vector<estimate::ExtraColumns> columns =
      law_variations(r, found, candidate.term ? acting_axes(s, candidate.columns, first_of_terms) : kEveryAxis);
  if (columns.empty()) return 1.0;
  // Behind the free parameters: the candidate's, where it is a quantity of the fit; the variations; the candidate's, where it is a term.
  const auto base = static_cast<Index>(r.fit.estimates.size());
  const auto held = static_cast<Index>(candidate.core.size()), varied = columns.front().count;
  ColumnSet variations, group;
  for (Index c = 0; c < varied; ++c) variations.push_back(base + held + c);
  for (Index c = 0; c < static_cast<Index>(candidate.columns.size()); ++c) group.push_back(candidate.term ? base + varied + c : base + c);
  if (candidate.term) {
    for (std::size_t f = 0; f < columns.size(); ++f) append(s.series[f], candidate.columns, first_of_terms, columns[f]);
  }
  ScoreTable table = table_with(r, columns, block_s, threads, stop, candidate.core);
  if (!host::common_part(candidate.id).empty()) table.sums_held.push_back(group);
  const ColumnSet model = base_columns(table);
  return left_to(table, model, group, variations, test_group(table, model, group).estimate, law_error);
}

double share_beside_law(const identify::Identification& r, const Candidate& found, const Candidate& other, double law_error, double block_s,
                        int threads, estimate::StopFit stop) {
  const std::vector<int> parameters = parameters_of(other, r.problem.start.terms);
  const std::vector<estimate::ExtraColumns> columns = law_variations(r, found, other.term ? axes_of(loads_of(r, other)) : kEveryAxis);
  if (columns.empty()) return 1.0;
  ScoreTable table = table_with(r, columns, block_s, threads, stop);
  ColumnSet model, group, variations;
  std::vector<double> size;
  for (Index c = 0; c < table.base; ++c) {
    const estimate::Estimate& e = r.fit.estimates[static_cast<std::size_t>(c)];
    const auto k = static_cast<std::size_t>(std::find(parameters.begin(), parameters.end(), e.parameter) - parameters.begin());
    (k < parameters.size() ? group : model).push_back(c);
    if (k < parameters.size()) size.push_back(e.value - other.parameters[k].neutral);
  }
  for (Index c = 0; c < columns.front().count; ++c) variations.push_back(table.base + c);
  return left_to(table, model, group, variations, Eigen::Map<const Eigen::VectorXd>(size.data(), static_cast<Index>(size.size())),
                 law_error);
}

}  // namespace rotorloop::diagnose
