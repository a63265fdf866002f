// One trial of the study: three model-true flights of 20 s, one joint fit from start values that are off by tens of percent, and
// what came out against the truth.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "test/support/model_true_flight.hpp"

namespace rotorloop::stats {

struct TrialSettings {
  std::uint64_t seed = 1;
  double duration_s = 20.0;       // of each flight
  int rotor_log_every_ms = 1;     // 5: rotor speeds at 200 Hz
  bool estimate_noise = false;    // process and measurement noise by EM; else those of the flights are given
  bool pilot_sees_truth = false;  // see model_true::FlightSettings
  bool nodes_at_stamps = false;   // the time offset as one of the poses, which are then predicted 2 ms away from the nodes
  bool quiet = false;             // flights without any noise, weighed as if they had it: what is left is bias of the method
};

// One number that a trial estimates. Errors of relative quantities are in units of the truth.
struct Quantity {
  std::string name, unit;
  double truth = 0.0;
  double limit = 0.0;  // allowed 3 x rms error over trials, in `unit` or, if relative, as a fraction; 0: none
  bool relative = false;
  bool parameter = true;  // of the fit; false: derived from several, not pooled
};
std::vector<Quantity> quantities(const model_true::Truth& truth);

struct Outcome {
  double estimate = 0.0;
  double u = 0.0;         // classical standard error
  double u_robust = 0.0;  // from block scores
};
struct Trial {
  std::uint64_t seed = 0;
  bool converged = false;
  int iterations = 0;
  double cost_per_dof = 0.0;                              // twice the cost over the degrees of freedom: 1 when the noise is right
  double q_a_m_s2_rtHz = 0.0, q_alpha_rad_s2_rtHz = 0.0;  // of the fit, root mean square of the axes
  double pose_sigma_m = 0.0, pose_sigma_rad = 0.0;
  std::vector<Outcome> outcomes;  // in the order of quantities()
};

// The truth of the study: the paper's vehicle whose poses are stamped 2 ms late.
model_true::Truth study_truth();
Trial run_trial(const TrialSettings& settings);

}  // namespace rotorloop::stats
