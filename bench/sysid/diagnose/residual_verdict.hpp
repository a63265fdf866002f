// What the residuals of a model change in the verdict of a diagnosis.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/diagnose/decision_rules.hpp"
#include "bench/sysid/diagnose/diagnosis.hpp"
#include "bench/sysid/diagnose/residuals/residual_findings.hpp"
#include "bench/sysid/estimate/model/parameters.hpp"

namespace rotorloop::diagnose {

// What the residuals of the last model say by themselves: a systematic rest or bursts stand in `remains`, and make it `unexplained` when no
// effect was found. Only where it matters to this vehicle: half a per cent of its weight, or of its weight times the arm of its rotors,
// beyond the noise; of all flights together, else of one of them. Bursts count by what they alone make of the rms, however much else there
// is. So does an axis whose fitted noise is far above its residual. `without`: effects on the scatter that are not considered.
void judge_residuals(const ResidualFindings& left, const estimate::ModelValues& vehicle, Diagnosis& diagnosis,
                     const std::vector<std::string>& without = {}, const Criteria& criteria = {});

// Whether the effects that were added are an explanation where something remains: when they leave the larger part of what was missing
// before them (power of residual force and torque beyond noise, each over what matters), the verdict is `unexplained`, and a remark says
// the share.
void judge_explained(const ResidualFindings& before, const ResidualFindings& left, const estimate::ModelValues& vehicle,
                     Diagnosis& diagnosis, const Criteria& criteria = {});

// Errors after half a second on flights held out (position, attitude, rates) that are not those of a model that is right: too large by
// Criteria::fewest_u floors, or below the floor by more than Criteria::law_error, where the noise that the floor is made of is too large.
// They stand in `remains`, and no such model is clean.
void judge_held_out(const identify::HeldOutScores& scores, Diagnosis& diagnosis, const Criteria& criteria = {});

}  // namespace rotorloop::diagnose
