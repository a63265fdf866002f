#include "bench/sysid/diagnose/residual_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/constants.hpp"
#include "host/effects/term_size.hpp"
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

// The residual beyond noise, squared over what matters, summed over the axes of force and torque.
double missing_power(const ResidualFindings& left, const estimate::ModelValues& vehicle, const Criteria& criteria) {
  const double weight_N = vehicle[estimate::kMass] * kGravity_m_s2, arm_m = host::arm_m(vehicle.geometry);
  double sum = 0.0;
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& axis = left.unexplained.axis[a];
    const double matters = a < 3 ? criteria.force_matters * weight_N : criteria.torque_matters * weight_N * arm_m;
    sum += std::max(0.0, axis.rms * axis.rms - axis.rms_expected * axis.rms_expected) / (matters * matters);
  }
  return sum;
}

}  // namespace

void judge_explained(const ResidualFindings& before, const ResidualFindings& left, const estimate::ModelValues& vehicle, Diagnosis& d,
                     const Criteria& criteria) {
  if (d.added.empty() || d.remains.empty()) return;
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
  const double weight_N = vehicle[estimate::kMass] * kGravity_m_s2, arm_m = host::arm_m(vehicle.geometry);
  for (std::size_t a = 0; a < kAxes; ++a) {
    const AxisUnexplained& axis = left.unexplained.axis[a];
    const double beyond = std::sqrt(std::max(0.0, axis.rms * axis.rms - axis.rms_expected * axis.rms_expected));
    const double matters = a < 3 ? criteria.force_matters * weight_N : criteria.torque_matters * weight_N * arm_m;
    const bool bursts = left.unexplained.kind[a] == ResidualKind::bursts;
    const bool systematic = left.unexplained.kind[a] == ResidualKind::systematic;
    if (beyond > matters && (bursts || systematic)) {
      d.remains.push_back({std::string(kAxisNames[a]), std::string(kAxisUnits[a]), bursts,
                           bursts ? axis.burst_share : axis.explainable.share, beyond, matters});
    }
  }
  if (d.added.empty()) {
    add_scatter(left.variance, without, criteria, d);
    if (!d.added.empty()) {
      d.verdict = DiagnosisVerdict::named;
      std::erase_if(d.remains, [](const RemainingResidual& r) { return r.bursts; });  // what gusts do
    } else if (!d.remains.empty()) {
      d.verdict = DiagnosisVerdict::unexplained;
    }
  }
  d.remarks.insert(d.remarks.end(), left.words.begin(), left.words.end());
}

}  // namespace rotorloop::diagnose
