// What a diagnosis comes to, in words: the verdict, what speaks against it, and what to do next.
#pragma once
#include <string>

#include "bench/render/outcome.hpp"
#include "bench/sysid/diagnose/diagnosis.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"

namespace rotorloop::diagnose {

// "named: the model lacks what stands below"
std::string verdict_words(const std::string& verdict);

// provenance.ended where the command knows more than the diagnosis says (interrupted, a vehicle that is not credible).
render::Outcome diagnosis_outcome(const Diagnosis& d, const identify::IdentifyProvenance& provenance);

}  // namespace rotorloop::diagnose
