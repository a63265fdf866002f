#include "bench/propeller/validation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/propeller/rotor_coefficients.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kDensity_kg_m3 = 1.225;  // cancels in the coefficients; its part in Reynolds number is below the polars' errors
}

Coefficients predict(const sim::Rotor& rotor, double diameter_m, const MeasuredRow& row) {
  const double n = row.rpm / 60.0;
  sim::RotorCondition c;
  c.omega_rad_s = 2.0 * std::numbers::pi * n;
  c.v_R_m_s.z() = row.j * n * diameter_m;
  c.density_kg_m3 = kDensity_kg_m3;
  sim::RotorWarmStart cold;
  const sim::RotorLoads loads = sim::solve_rotor(rotor, c, cold);
  const RotorCoefficients k = rotor_coefficients(loads, c, 0.5 * diameter_m);
  return {k.c_t, k.c_p};
}

std::vector<BoundedParameter> blade_parameters(double pitch_bound_deg) {
  return {
      {"pitch offset", "deg", 0.0, -pitch_bound_deg, pitch_bound_deg, 0.02},
      // XFOIL's lift slope at these Reynolds numbers against measured ones; thickness and camber of a moulded blade.
      {"lift scale", "1", 1.0, 0.8, 1.2, 0.002},
      // XFOIL gives too little drag below Reynolds number 8e4, by up to a half; a rough blade adds some.
      {"drag scale", "1", 1.0, 0.8, 2.0, 0.005},
      // 0: none; 3 is published, for wind turbines (Snel and others).
      {"stall delay", "1", sim::kSnelFactor, 0.0, 5.0, 0.02},
  };
}

sim::Blade with_parameters(sim::Blade blade, const std::vector<double>& values) {
  blade.pitch_offset_deg = values.at(0);
  blade.lift_scale = values.at(1);
  blade.drag_scale = values.at(2);
  blade.stall_delay = values.at(3);
  return blade;
}

LeastSquaresFit fit_blade(const sim::Blade& blade, double diameter_m, const std::vector<MeasuredRow>& rows, double pitch_bound_deg) {
  const auto residuals = [&](const std::vector<double>& values) {
    const sim::Rotor rotor(with_parameters(blade, values));
    std::vector<double> r;
    for (const MeasuredRow& row : rows) {
      if (row.ct <= kLeastThrust) continue;
      const Coefficients c = predict(rotor, diameter_m, row);
      r.push_back(c.ct / row.ct - 1.0);
      r.push_back(c.cp / row.cp - 1.0);
    }
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(r.data(), static_cast<Eigen::Index>(r.size())));
  };
  return fit_least_squares(blade_parameters(pitch_bound_deg), residuals);
}

ErrorRms score(const sim::Rotor& rotor, double diameter_m, const std::vector<MeasuredRow>& rows) {
  ErrorRms e;
  for (const MeasuredRow& row : rows) {
    if (row.ct <= kLeastThrust) continue;
    const Coefficients c = predict(rotor, diameter_m, row);
    e.ct += (c.ct / row.ct - 1.0) * (c.ct / row.ct - 1.0);
    e.cp += (c.cp / row.cp - 1.0) * (c.cp / row.cp - 1.0);
    ++e.rows;
  }
  e.ct = std::sqrt(e.ct / e.rows);
  e.cp = std::sqrt(e.cp / e.rows);
  return e;
}

std::vector<MeasuredRow> rows_of(const MeasuredSet& set, Part part) {
  if (!set.fitted) return part == Part::fitted ? std::vector<MeasuredRow>{} : set.rows;
  std::vector<MeasuredRow> rows;
  for (std::size_t i = part == Part::fitted ? 0 : 1; i < set.rows.size(); i += 2) rows.push_back(set.rows[i]);
  return rows;
}

PropellerResult validate(const MeasuredPropeller& propeller) {
  PropellerResult result{propeller, {}};
  const double diameter_m = propeller.entry.diameter_m;
  std::vector<MeasuredRow> training;
  for (const MeasuredSet& set : propeller.sets) {
    const auto rows = rows_of(set, Part::fitted);
    training.insert(training.end(), rows.begin(), rows.end());
  }
  for (const GeometryChoice& g : propeller.geometries) {
    GeometryResult r;
    r.source = g.source;
    r.fit = fit_blade(g.blade, diameter_m, training, propeller.entry.pitch_bound_deg);
    r.unfitted_blade = g.blade;
    r.fitted_blade = with_parameters(g.blade, r.fit.values);
    const sim::Rotor unfitted(r.unfitted_blade), fitted(r.fitted_blade);
    for (const MeasuredSet& set : propeller.sets)
      for (const Part part : {Part::fitted, Part::held_out}) {
        const auto rows = rows_of(set, part);
        if (rows.empty()) continue;
        r.scores.push_back({.label = set.label,
                            .is_static = &set == &propeller.sets.front(),
                            .judged = set.judged,
                            .whole = !set.fitted,
                            .part = part,
                            .unfitted = score(unfitted, diameter_m, rows),
                            .fitted = score(fitted, diameter_m, rows)});
      }
    result.geometries.push_back(std::move(r));
  }
  const auto best = std::min_element(result.geometries.begin(), result.geometries.end(),
                                     [](const GeometryResult& a, const GeometryResult& b) { return a.fit.rms < b.fit.rms; });
  best->judged = propeller.entry.judged;
  return result;
}

std::vector<ValidationLimit> judge(const std::vector<PropellerResult>& results) {
  std::vector<ValidationLimit> limits;
  const auto at_most = [&](const std::string& name, double measured, double limit) {
    limits.push_back({name, measured, limit, false, measured <= limit});
  };
  int sweeps = 0, good = 0;
  double worst_ct = 0.0, worst_cp = 0.0;
  for (const PropellerResult& p : results)
    for (const GeometryResult& g : p.geometries) {
      if (!g.judged) continue;
      for (const SetScore& s : g.scores) {
        if (!s.judged || s.part == Part::fitted) continue;
        if (s.is_static) {
          at_most(p.propeller.entry.title + ", held-out static C_T", s.fitted.ct, kStaticThrustMost);
          at_most(p.propeller.entry.title + ", held-out static C_P", s.fitted.cp, kStaticPowerMost);
        } else if (s.whole) {
          ++sweeps;
          good += s.fitted.ct <= kSweepThrustMost && s.fitted.cp <= kSweepPowerMost;
          worst_ct = std::max(worst_ct, s.fitted.ct);
          worst_cp = std::max(worst_cp, s.fitted.cp);
        }
      }
    }
  if (sweeps == 0) return limits;
  at_most("worst sweep not used in a fit, C_T", worst_ct, kWorstThrustMost);
  at_most("worst sweep not used in a fit, C_P", worst_cp, kWorstPowerMost);
  const double share = static_cast<double>(good) / sweeps;
  // A share of the sweeps of a single propeller would be another limit.
  if (results.size() == propeller_catalogue().size())
    limits.push_back({"share of these sweeps within 8 % (C_T) and 10 % (C_P)", share, kSweepShare, true, share >= kSweepShare});
  return limits;
}

}  // namespace rotorloop::propeller
