#include "bench/sysid/diagnose/residual_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::diagnose {
namespace {

// Effects that change the scatter and not the mean: named when the mean is as the model has it, and when they matter. One that flights
// like these cannot show for certain stays a remark, and so does what is found after the first: it shares its blocks.
void add_scatter(const VarianceResult& variance, const std::vector<std::string>& without, const Criteria& criteria, Diagnosis& d) {
  const host::EffectCatalogue& catalogue = host::builtin_effect_catalogue();
  for (const VarianceEffect& v : variance.effects) {
    const host::CatalogueEffect* row = catalogue.find(v.id);
    if (!v.found || !row || row->observability == "not_observable" || std::find(without.begin(), without.end(), v.id) != without.end())
      continue;
    const double matters = criteria.relevant * std::fabs(row->parameter.typical_value);
    if (v.size < matters) continue;
    CandidateEvidence e;
    e.id = v.id;
    e.one_step = {{v.parameter, v.unit, v.size, v.u}};
    e.wald = v.t * v.t;
    e.degrees = 1;
    e.p = v.p;
    e.p_holm = v.p_holm;
    e.typical = matters;
    AddedEffect a{.id = v.id, .parameters = e.one_step, .evidence = e};
    for (const auto& [alias, correlation] : v.aliases) {
      if (catalogue.find(alias)) a.aliases.push_back({alias, correlation, 1.0, {}});
    }
    if (!a.aliases.empty()) a.manoeuvre = row->manoeuvre;
    d.added.push_back(std::move(a));
    return;
  }
}

double beyond_noise(const AxisUnexplained& x) { return std::sqrt(std::max(0.0, x.rms * x.rms - x.rms_expected * x.rms_expected)); }

// The residual beyond noise, squared over what matters, summed over the axes of force and torque.
double missing_power(const ResidualFindings& left, const estimate::ModelValues& vehicle, const Criteria& criteria) {
  double sum = 0.0;
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& axis = left.unexplained.axis[a];
    const double matters = size_that_matters(a, vehicle, criteria);
    sum += beyond_noise(axis) * beyond_noise(axis) / (matters * matters);
  }
  return sum;
}

// Where the bursts of an axis are, about the largest of them: many at one place are something that stands or blows there.
std::string where_bursts_are(const UnexplainedResult& u, const std::vector<std::string>& flights, std::size_t axis) {
  constexpr double kSamePlace_m = 1.0;
  const Burst* largest = nullptr;
  std::size_t all = 0;
  for (const Burst& b : u.bursts) {
    if (b.axis != axis) continue;
    ++all;
    if (!largest || std::fabs(b.peak) > std::fabs(largest->peak)) largest = &b;
  }
  if (!largest) return "";
  std::string out = fmt::format("The largest is {:+.2g} {} in {} at {:.1f} s, {:.0f} times what is usual", largest->peak, kAxisUnits[axis],
                                largest->flight < flights.size() ? flights[largest->flight] : "", largest->from_s, largest->ratio);
  if (!largest->place_W_m) return out;
  const Eigen::Vector3d& p = *largest->place_W_m;
  const auto near = std::count_if(u.bursts.begin(), u.bursts.end(), [&](const Burst& b) {
    return b.axis == axis && b.place_W_m && (*b.place_W_m - p).norm() < kSamePlace_m;
  });
  return out + fmt::format(", at x {:.1f}, y {:.1f}, z {:.1f} m; {} of {} are within {:.0f} m of there", p.x(), p.y(), p.z(), near, all,
                           kSamePlace_m);
}

// Over all flights, and where that says nothing of an axis, flight by flight.
void add_remains_of_axis(const ResidualFindings& left, std::size_t a, double matters, const Criteria& criteria,
                         std::vector<RemainingResidual>& out) {
  const UnexplainedResult& u = left.unexplained;
  const std::string axis = kAxisNames[a], unit = kAxisUnits[a];
  bool bursts = false, systematic = false;
  const auto look = [&](const AxisUnexplained& x, ResidualKind kind, const std::string& flight) {
    const double beyond = beyond_noise(x);
    if (!bursts && (x.burst_rms > matters || (kind == ResidualKind::bursts && beyond > matters))) {
      bursts = true;
      out.push_back({RemainingKind::bursts, axis, unit, x.burst_share, std::max(x.burst_rms, beyond), matters, flight,
                     where_bursts_are(u, left.series.samples.flights, a)});
    } else if (!systematic && kind == ResidualKind::systematic && beyond > matters) {
      systematic = true;
      out.push_back({RemainingKind::systematic, axis, unit, x.explainable.share, beyond, matters, flight});
    }
  };
  look(u.axis[a], u.kind[a], "");
  if (!bursts && !systematic) {
    for (const FlightUnexplained& f : u.flights) look(f.axis[a], f.kind[a], left.series.samples.flights[f.flight]);
  }
  const AxisUnexplained& x = u.axis[a];
  if (x.rms < criteria.larger_part * x.rms_expected && x.rms_expected > matters)
    out.push_back({RemainingKind::noise, axis, unit, x.rms_expected / x.rms, x.rms_expected, x.rms});
}

// What may still be missing where nothing was found: all that is left, flight by flight.
std::string clean_up_to(const ResidualFindings& left) {
  std::string out;
  const auto add = [&](const std::string& flight, const std::array<AxisUnexplained, kAxes>& axis) {
    double force = 0.0, torque = 0.0;
    for (std::size_t a = 0; a < kAxes; ++a) (a < 3 ? force : torque) = std::max(a < 3 ? force : torque, axis[a].rms);
    out += fmt::format("{}{}{:.2g} N and {:.2g} N m", out.empty() ? "" : ", ", flight.empty() ? "" : flight + " ", force, torque);
  };
  for (const FlightUnexplained& f : left.unexplained.flights) add(left.series.samples.flights[f.flight], f.axis);
  if (left.unexplained.flights.empty()) add("", left.unexplained.axis);
  return "Clean up to what is left, noise and all (largest axis, rms of 0.2 s): " + out + ".";
}

}  // namespace

std::string_view name(RemainingKind kind) {
  switch (kind) {
    case RemainingKind::systematic:
      return "systematic";
    case RemainingKind::bursts:
      return "bursts";
    case RemainingKind::noise:
      return "noise";
    case RemainingKind::held_out:
      return "held_out";
  }
  return "";
}

void judge_explained(const ResidualFindings& before, const ResidualFindings& left, const estimate::ModelValues& vehicle, Diagnosis& d,
                     const Criteria& criteria) {
  const auto of_wrench = [](const RemainingResidual& r) { return r.kind == RemainingKind::systematic || r.kind == RemainingKind::bursts; };
  if (d.added.empty() || std::none_of(d.remains.begin(), d.remains.end(), of_wrench)) return;
  const double was = missing_power(before, vehicle, criteria), is = missing_power(left, vehicle, criteria),
               explained = was > 0.0 ? 1.0 - is / was : 0.0;
  if (explained >= criteria.larger_part) return;
  d.verdict = DiagnosisVerdict::unexplained;
  d.remarks.insert(d.remarks.begin(), fmt::format("What was found explains {:.0f} % of the power of the force and torque that the model "
                                                  "lacks: no explanation, though it lowers the error.",
                                                  100.0 * std::max(0.0, explained)));
}

void judge_residuals(const ResidualFindings& left, const estimate::ModelValues& vehicle, Diagnosis& d,
                     const std::vector<std::string>& without, const Criteria& criteria) {
  for (std::size_t a = 0; a < kAxes; ++a) add_remains_of_axis(left, a, size_that_matters(a, vehicle, criteria), criteria, d.remains);
  if (d.added.empty()) {
    add_scatter(left.variance, without, criteria, d);
    if (!d.added.empty()) {
      d.verdict = DiagnosisVerdict::named;
      std::erase_if(d.remains, [](const RemainingResidual& r) { return r.kind == RemainingKind::bursts; });  // what gusts do
    } else if (!d.remains.empty()) {
      d.verdict = DiagnosisVerdict::unexplained;
    } else {
      d.remarks.insert(d.remarks.begin(), clean_up_to(left));
    }
  }
  d.remarks.insert(d.remarks.end(), left.words.begin(), left.words.end());
}

void judge_held_out(const identify::HeldOutScores& scores, Diagnosis& d, const Criteria& criteria) {
  constexpr double kHorizon_s = 0.5;
  constexpr const char* kQuantity[] = {"position", "velocity", "attitude", "rates"};
  for (const identify::HeldOutRow& r : scores.rows) {
    if (r.quantity == score::kPredictedVelocity || std::fabs(r.horizon_s - kHorizon_s) > 1e-6 || !(r.floor > 0.0)) continue;
    const double ratio = r.after / r.floor;
    if (ratio <= criteria.fewest_u && ratio >= 1.0 - criteria.law_error) continue;
    d.remains.push_back({RemainingKind::held_out, fmt::format("{} after {} s", kQuantity[r.quantity], r.horizon_s),
                         score::kPredictedUnits[r.quantity], ratio, r.after, r.floor});
  }
  if (d.verdict == DiagnosisVerdict::clean && !d.remains.empty()) d.verdict = DiagnosisVerdict::unexplained;
}

}  // namespace rotorloop::diagnose
