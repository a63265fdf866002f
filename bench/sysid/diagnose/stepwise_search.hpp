// Stepwise regression over the effects of the library (Efroymson 1960): each forward step screens every candidate against what the model
// leaves, refits a shortlist, and adds the best that passes every criterion; backward elimination takes out what the effects found later
// made superfluous. What each step found stands in the Diagnosis.
#pragma once
#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "bench/sysid/diagnose/diagnose_options.hpp"
#include "bench/sysid/diagnose/diagnosis.hpp"
#include "bench/sysid/diagnose/ranking/refit_ranking.hpp"

namespace rotorloop::diagnose {

// A diagnosis under way: the model so far, the effects in it, and what is reported of them.
class StepwiseSearch {
 public:
  StepwiseSearch(const DiagnoseOptions& options, const estimate::FitOptions& fit, const identify::Identification& before,
                 Diagnosis& diagnosis)
      : o_(options), again_(fit), d_(diagnosis), model_(copy_of(before)) {
    again_.noise.rounds = std::min(again_.noise.rounds, 4);  // from where the last fit left it
    again_.tolerance = std::max(again_.tolerance, 0.01);     // of a log likelihood that is compared in whole numbers
  }

  using Say = std::function<void(const std::string& part, double done)>;
  bool forward_step(int round, const Say& say);  // false: nothing more is to be added
  void backward_elimination(const Say& say);
  void report_sizes();
  void report_pose_time_offset();
  void report_unobservable_in_flight();
  identify::Identification model() && { return std::move(model_); }

 private:
  std::vector<RefitCandidate> refitted(const identify::Identification& start, const Screening& screening, const std::vector<Tested>& all,
                                       const std::function<void(const std::string&, double)>& progress) const;
  bool superseded(std::size_t i, double own) const;
  void reject(const std::vector<RefitCandidate>& ranked);
  void accept(RefitCandidate& best, std::vector<ClassMember> aliases);
  void report_detection_limits(const std::vector<Tested>& all);

  const DiagnoseOptions& o_;
  const host::EffectCatalogue& catalogue_ = host::builtin_effect_catalogue();
  estimate::FitOptions again_;
  Diagnosis& d_;
  identify::Identification model_;
  std::vector<Candidate> added_;
};

}  // namespace rotorloop::diagnose
