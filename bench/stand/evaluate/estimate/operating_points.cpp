#include "bench/stand/evaluate/estimate/operating_points.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/constants.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kOneLevel = 0.03;      // of the speed
constexpr double kLeastThrust = 0.002;  // of the largest: below, ratios to it are noise of the load cell
constexpr double kNoDivisor = 1e-9;     // W, A: no ratio

double or_nothing(double value) { return value > kNoDivisor ? value : kNotMeasured; }

// The voltage that an ESC reports along the torque axis lacks the drop across the inductance, which stands at right angles to it.
double motor_voltage(const StandStep& s, const RunFacts& facts) {
  const double reported = s.duty * s.voltage_V;
  if (!facts.duty_along || !facts.winding) return reported;
  const double along = reported / std::sqrt(3.0);  // of a phase
  const double amplitude_A = 2.0 * s.voltage_V * s.current_A / (3.0 * along);
  const double across = s.omega_rad_s * facts.pole_pairs * facts.winding->inductance_q_H * amplitude_A;
  return std::sqrt(3.0) * std::hypot(along, across);
}

}  // namespace

double OperatingPoint::thrust_g() const { return 1000.0 * thrust_N / kGravity_m_s2; }

double of_rotor_alone(const CoefficientEstimate& c, Eigen::Index row) {
  const double w = c.rows.omega_rad_s(row), l = std::log(w / c.rows.centre_rad_s);
  const double law =
      c.value * w * w * std::exp((c.fit.value("exponent") + (c.fit.value("curvature") + c.fit.value("change of curvature") * l) * l) * l);
  return law + c.fit.residual(row);
}

std::vector<OperatingPoint> operating_points(const StandRun& run, const CoefficientEstimate* thrust, const CoefficientEstimate* torque) {
  std::vector<OperatingPoint> all(run.steps.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const StandStep& s = run.steps[i];
    all[i].omega_rad_s = s.omega_rad_s;
    all[i].supply_V = s.voltage_V;
    all[i].current_A = or_nothing(s.current_A);
    all[i].motor_V = motor_voltage(s, run.facts);
  }
  const auto take = [&](const CoefficientEstimate* c, double OperatingPoint::*value) {
    if (!c) return;
    double most = 0.0;
    for (std::size_t row = 0; row < c->rows.step.size(); ++row)
      if (OperatingPoint& p = all[c->rows.step[row]]; p.omega_rad_s > 0.0) {
        p.*value = of_rotor_alone(*c, static_cast<Eigen::Index>(row));
        most = std::max(most, p.*value);
      }
    for (OperatingPoint& p : all)
      if (!(p.*value > kLeastThrust * most)) p.*value = kNotMeasured;
  };
  take(thrust, &OperatingPoint::thrust_N);
  take(torque, &OperatingPoint::torque_N_m);
  std::erase_if(all,
                [](const OperatingPoint& p) { return !(p.omega_rad_s > 0.0) || (std::isnan(p.thrust_N) && std::isnan(p.torque_N_m)); });
  return all;
}

std::vector<OperatingPoint> levels_of(std::vector<OperatingPoint> points) {
  std::sort(points.begin(), points.end(), [](const OperatingPoint& a, const OperatingPoint& b) { return a.omega_rad_s < b.omega_rad_s; });
  if (points.empty()) return {};
  const double slowest = points.front().omega_rad_s, width = (points.back().omega_rad_s - slowest) / static_cast<double>(kMostLevels);
  std::vector<std::vector<const OperatingPoint*>> groups;
  const auto group_by = [&](const auto& same) {
    groups.clear();
    for (const OperatingPoint& p : points) {
      if (groups.empty() || !same(*groups.back().front(), p)) groups.emplace_back();
      groups.back().push_back(&p);
    }
  };
  group_by([](const OperatingPoint& first, const OperatingPoint& p) { return p.omega_rad_s <= first.omega_rad_s * (1.0 + kOneLevel); });
  const auto slot = [&](const OperatingPoint& p) {
    return std::min(std::floor((p.omega_rad_s - slowest) / width), static_cast<double>(kMostLevels - 1));
  };
  if (groups.size() > kMostLevels) group_by([&](const OperatingPoint& first, const OperatingPoint& p) { return slot(first) == slot(p); });
  std::vector<OperatingPoint> out;
  for (const auto& group : groups) {
    OperatingPoint mean;
    for (double OperatingPoint::*value : {&OperatingPoint::omega_rad_s, &OperatingPoint::thrust_N, &OperatingPoint::torque_N_m,
                                          &OperatingPoint::supply_V, &OperatingPoint::current_A, &OperatingPoint::motor_V}) {
      double sum = 0.0, n = 0.0;
      for (const OperatingPoint* p : group)
        if (std::isfinite(p->*value)) {
          sum += p->*value;
          n += 1.0;
        }
      mean.*value = n > 0.0 ? sum / n : kNotMeasured;
    }
    out.push_back(mean);
  }
  return out;
}

}  // namespace rotorloop::stand
