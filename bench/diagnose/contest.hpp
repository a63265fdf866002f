// Ranking: effects that could be what is missing, each refitted. One step of the screening ranks them by what the residuals of a model
// that lacks the effect say, noise figures swollen by the misfit; the refit shows what each makes of the likelihood once noise and
// parameters have settled with it.
#pragma once
#include <string>
#include <vector>

#include "bench/diagnose/examine.hpp"
#include "bench/diagnose/gust.hpp"
#include "bench/diagnose/refit.hpp"

namespace rotorloop::diagnose {

struct Contestant {
  const Tested* tested = nullptr;
  Refit refit = {};                      // with the effect
  std::vector<NamedValue> values = {};   // of its parameters there
  double rise = 0.0;                     // of the log likelihood
  double score = 0.0;                    // rise less what its parameters cost
  Evenness even = {};                    // of its size over the flights
  Reason failure = {};                   // why it cannot be the missing effect; none: it could
  std::vector<const Tested*> same = {};  // others whose columns are those of this one
};

// Whose refit is worth its time; each with those that say the same. `all`: as examine_all() has them.
std::vector<Contestant> worth_a_refit(const Screening& screening, const std::vector<Tested>& all, const Criteria& criteria);

// Whether `c` needs no refit to be ranked below `leader`, whose refit is done: with what is known held, and the same noise, it explains less
// than half of what the leader does. Says nothing where the leader, so held, explains less than half of what freeing the known values does:
// there their being held is what is wrong. `without`: the cost with them held and no effect; `freed`: with them free and no effect.
bool far_behind(const Contestant& c, const Contestant& leader, double without, double freed);

// Those refitted, best score first, the failed ones last. `all`: as examine_all() has them.
// `start`: where the refits begin; the screening's table stands there. `model`: the fit that they must better; its noise is theirs at
// first.
std::vector<Contestant> contest(const identify::Identification& start, const identify::Identification& model, const Screening& screening,
                                const std::vector<Tested>& all, const Criteria& criteria, const estimate::FitOptions& options);

// Largest rise of the log likelihood by an effect found before, and by one of them that acts on the body.
struct RisesBefore {
  double any = 0.0, on_body = 0.0;
  void count(const Contestant& winner);
};
// The laws of effects are reduced forms. What a law leaves of its effect is small beside it and acts where it acts: on the body it is
// indistinguishable from a further effect that is as small.
bool too_little_beside(const RisesBefore& before, const Contestant& c, const Criteria& criteria);

// In flights of twenty seconds gusts have a mean, and many a constant looks like it. Where it blows, what raises the likelihood less than
// gusts do is taken for one; so is a wind that is no more than their mean may be, and with it whatever else explains that wind.
void leave_to_gusts(const GustScore& gust, std::vector<Contestant>& field);

// Which of the others are indistinguishable in these flights from the best, which is the first of `field`.
std::vector<ClassMember> twins_of(const Screening& screening, const std::vector<Tested>& all, const std::vector<Contestant>& field,
                                  const Criteria& criteria);

// The candidate's values in a fit that has it.
std::vector<NamedValue> values_in(const identify::Identification& fit, const Candidate& candidate);

}  // namespace rotorloop::diagnose
