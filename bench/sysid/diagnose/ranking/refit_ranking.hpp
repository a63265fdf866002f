// Model selection: candidates that could be what is missing, each refitted, and ranked. One step of the screening ranks them by what the
// residuals of a model that lacks the effect say, noise figures swollen by the misfit; the refit shows what each makes of the likelihood
// once noise and parameters have settled with it.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/ranking/shortlist.hpp"

namespace rotorloop::diagnose {

// Derivation. Of models of which one is true, that of the largest marginal likelihood is the most probable. For n measurements Laplace's
// approximation of the integral over its d parameters gives (Schwarz, Estimating the Dimension of a Model, 1978)
//   ln p(y | model) ≈ ln L - ½ d ln n
// with L the likelihood at the best values, so a candidate scores Δ ln L - ½ d ln n over the model without it. d counts the numbers that
// the refit moved from neutral by more than chance does: one that it left there costs nothing. L is that of the refit; the score test of
// the screening, ½ sᵀI⁻¹s with s and I the gradient and the information at the model without the effect (Rao 1948), is the first step
// towards it and only makes the shortlist. Two scores that differ by 3 are odds of 20 to 1: within that (wider where residuals are
// correlated, and the likelihood counts the same evidence several times) the flights do not distinguish the two, and they make a class.

// Ranked candidates after their refits, the passing ones first. Of laws that the flights like as well, that of the fewest numbers comes
// first. A law that holds a simpler one within it (each direction of the one a direction of the other) fails where it is the more likely,
// but predicts stretches that did not estimate it less well than the simpler one: what its further numbers fit is the error of the model
// that both start from.
void prefer_the_simpler(std::vector<RefitCandidate>& ranked, const Screening& screening, const Criteria& criteria);

// The number of a refit without which a law of several is another one: a tether without stiffness is a constant force. It is the one that
// the catalogue names, where no other has its unit (numbers of one unit are directions of one thing). nullptr: there is none.
const NamedValue* defining_number(const Candidate& candidate, const std::vector<NamedValue>& values);

// Whether `c` needs no refit to be ranked below `leader`, whose refit is done: with the priors' parameters held, and the same noise, it
// explains less than half of what the leader does, and the screening did not put it above that. Says nothing where the leader, so held,
// explains less than half of what freeing those parameters does: there their being held is what is wrong. `without`: the cost with them
// held and no effect; `freed`: with them free and no effect.
bool far_behind(const RefitCandidate& c, const RefitCandidate& leader, double without, double freed, const Criteria& criteria = {});

// Those refitted, best score first, the failed ones last. `all`: as examine_all() has them. A candidate whose refit takes more than
// `refit_iterations` iterations, in all its fits, fails as out_of_iterations.
// `progress`: before each refit, its candidate and the share of the refits done. `start`: where the refits begin; the screening's table
// stands there. `model`: the fit that they must better; its noise is theirs at first.
std::vector<RefitCandidate> rank_by_refits(const identify::Identification& start, const identify::Identification& model,
                                           const Screening& screening, const std::vector<Tested>& all, const Criteria& criteria,
                                           const estimate::FitOptions& options, int refit_iterations,
                                           const std::function<void(const std::string& id, double done)>& progress = {});

// Which of the others are indistinguishable in these flights from the best, which is the first of `ranked`.
std::vector<ClassMember> indistinguishable_from_best(const Screening& screening, const std::vector<Tested>& all,
                                                     const std::vector<RefitCandidate>& ranked, const Criteria& criteria);

// The candidate's values in a fit that has it.
std::vector<NamedValue> values_in(const identify::Identification& fit, const Candidate& candidate);

}  // namespace rotorloop::diagnose
