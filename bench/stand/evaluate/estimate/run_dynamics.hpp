// What a run's changes of speed say: time constants of the speed loop up and down, the rotor's inertia from the reaction torque on the
// mount, and the bandwidth of the loop where the command excites it.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/evaluate/estimate/stand_run.hpp"

namespace rotorloop::stand {

struct TimeConstant {
  double value_s = 0.0, u_s = 0.0;  // of a first-order lag behind the target; 2 u hold the truth in 95 %, however few the steps are
  double delay_s = 0.0;  // from the first row with the new target; down to minus one reading, as the target may change between two rows
  std::size_t steps = 0;
};

struct Bandwidth {
  double minus_3dB_Hz = kNotMeasured, minus_90deg_Hz = kNotMeasured;
  double from_Hz = 0.0, to_Hz = 0.0;  // where the coherence is above the gate
  std::vector<double> f_Hz, gain_dB, phase_deg, coherence;
};
inline constexpr double kCoherenceGate = 0.8;

struct RunDynamics {
  std::optional<TimeConstant> up, down;
  std::optional<double> inertia_kg_m2, inertia_u_kg_m2;  // u with what no step shows: gain of the torque cell, arm, alignment, clock
  std::string no_inertia;                                // why there is none although speed changed
  std::string no_lag;                                    // why there are no time constants: speed that is ahead of its target
  std::size_t transitions = 0;
  std::optional<Bandwidth> bandwidth;
};

// `c_q_N_m_s2` and the running offset: of the static fit. Nothing where the run has no samples of target and speed.
std::optional<RunDynamics> run_dynamics(const StandRun& run, std::optional<double> c_q_N_m_s2, double exponent, double centre_rad_s,
                                        double running_offset_N_m);

}  // namespace rotorloop::stand
