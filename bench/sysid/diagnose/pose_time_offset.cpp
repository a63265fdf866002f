#include "bench/sysid/diagnose/pose_time_offset.hpp"

#include <cmath>

#include "bench/sysid/diagnose/candidate.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"

namespace rotorloop::diagnose {

std::optional<AddedEffect> pose_time_offset(const estimate::Fit& fit, const Criteria& criteria) {
  const host::CatalogueEffect& row = effect_of_parameter(estimate::kPoseDelay);
  double information = 0.0, sum = 0.0;
  for (const estimate::Estimate& e : fit.estimates) {
    const double u_s = identify::reported_u(e);
    if (e.parameter != estimate::kPoseDelay || u_s <= 0.0) continue;
    information += 1.0 / (u_s * u_s);
    sum += e.value / (u_s * u_s);
  }
  if (information <= 0.0) return std::nullopt;
  const double delay_s = sum / information, u_s = 1.0 / std::sqrt(information), matters_s = std::fabs(row.parameter.typical_value);
  if (std::fabs(delay_s) < criteria.relevant * matters_s || std::fabs(delay_s) < criteria.fewest_u * u_s) return std::nullopt;
  CandidateEvidence e;
  e.id = row.id;
  e.one_step = {{row.parameter.name, row.parameter.unit, delay_s, u_s}};
  e.wald = delay_s * delay_s / (u_s * u_s);
  e.degrees = 1;
  e.typical = matters_s;
  e.detectable = criteria.fewest_u * u_s;
  return AddedEffect{.id = row.id, .parameters = e.one_step, .evidence = e};
}

}  // namespace rotorloop::diagnose
