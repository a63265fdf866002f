// Which flight would distinguish the members of a class, found by simulating the candidates of manoeuvre_catalogue.hpp. A manoeuvre is
// worth what it adds to the log likelihood by which the true member beats another, after the other and all parameters of the model have
// taken what they can of it, with what the flights so far and the vehicle file know of them (T-optimal design, Atkinson and Fedorov
// 1975, about the fit): with S the information of the flights so far (and with the manoeuvre),
//   separation of a from b = ½ Δ_aᵀ (S_aa - S_aβ S_ββ⁻¹ S_βa) Δ_a,  β: parameters of the model and of b,  Δ_a: size of a
// less the same without the manoeuvre. Of a pair the smaller of both directions counts: nobody knows which is true.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/diagnosis.hpp"
#include "bench/sysid/diagnose/manoeuvre/manoeuvre_flight.hpp"

namespace rotorloop::diagnose {

struct DiagnosisRun;

// A member of a class with its size: its parameters by name, as a diagnosis gives them.
struct Member {
  std::string id;
  std::vector<NamedValue> parameters;
};

struct SearchOptions {
  double duration_s = kManoeuvre_s;
  double inflation = 1.0;  // of variances, for residuals that are correlated: separations are divided by it
  int threads = 1;
  std::vector<const host::Term*> library = {};  // terms beside those of host/effects
};

// All manoeuvres, the one that separates best first. The first member is part of the fitted model, the others are not; those that are, or
// that no term is known for, are left out. `before`: the fit without any of them, for the neutral values of quantities of the fit itself.
ManoeuvreAdvice rank_manoeuvres(const identify::Identification& fitted, const identify::Identification& before,
                                std::span<const Member> members, const SearchOptions& options);

// `stop` asked: throws estimate::FitStopped, before the next class.
// Fills the advice and the sentence of every class of a diagnosis; where none separates, the catalogue's sentence stays, after the finding.
void choose_manoeuvres(DiagnosisRun& run, const std::vector<const host::Term*>& library, int threads, estimate::StopFit stop = {});

}  // namespace rotorloop::diagnose
