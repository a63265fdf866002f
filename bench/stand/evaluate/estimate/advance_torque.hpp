// Torque in axial wind: c_q as a function of the advance ratio J = V/(n D), judged by the airspeed that had no part in the fit.
//   Q = ω² (c_q0 + c_q2 J²)
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "bench/stand/evaluate/estimate/stand_run.hpp"

namespace rotorloop::stand {

struct AirspeedTrial {
  double fitted_m_s = 0.0, predicted_m_s = 0.0;
  double rms_N_m = 0.0, constant_rms_N_m = 0.0;  // at the predicted airspeed: by c_q(J), by the constant, both of the fitted airspeed
};

struct AdvanceTorque {
  double c_q0_N_m_s2 = 0.0, u0_N_m_s2 = 0.0, c_q2_N_m_s2 = 0.0, u2_N_m_s2 = 0.0, correlation = 0.0;
  double j_low = 0.0, j_high = 0.0, rms_N_m = 0.0, constant_rms_N_m = 0.0;
  std::vector<AirspeedTrial> trials;
};

// c_q2 of runs in wind against a run in still air of the same mount: at like speeds the difference of torques is c_q2 (J ω)², whatever the
// law of speed and the running offset are. `run`: of still air; nothing where no speed of it comes again in wind. trials stays empty.
std::optional<AdvanceTorque> advance_torque(const StandRun& run, std::span<const StandRun> in_wind);

// Nothing for runs in still air, at one advance ratio, or without a diameter.
std::optional<AdvanceTorque> advance_torque(const StandRun& run);

}  // namespace rotorloop::stand
