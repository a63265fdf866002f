// Thrust of one rotor after the paper's eq. (1)-(2): a linear blade equation and Glauert's momentum equation share the
// induced velocity, and this solves them for it in every flight state, saying where momentum theory does not hold.
//   T = k1 ω² + k2 ω (v_z + v_i)                    (1)
//   T = 2 ρ A v_i sqrt((v_z + v_i)² + v_xy²)        (2)
#pragma once
#include <cstdint>

#include "host/vehicle/model.hpp"

namespace rotorloop::host {

enum class ThrustStatus : std::uint8_t {
  normal,           // climb, hover, forward flight, slow descent
  deep_descent,     // v_z beyond the onset of the vortex ring state: momentum theory is extrapolated, thrust is doubtful
  negative_thrust,  // climbing faster than the blades can push: T < 0
  stopped,          // below kStopped_rad_s: no thrust
  not_converged,    // the best iterate is returned
  bad_input,        // not finite, or a model without k1, radius or density: zero thrust is returned
};

struct RotorThrust {
  double thrust_N = 0.0;
  double induced_m_s = 0.0;  // v_i, along -z when positive
  double c_t_N_s2 = 0.0;     // T / ω²
  ThrustStatus status = ThrustStatus::normal;
  int iterations = 0;
};

inline constexpr double kStopped_rad_s = 1.0;
// Vortex ring onset at this fraction of the induced velocity in hover at the same thrust (Johnson, NASA TP-2005-213477).
inline constexpr double kVortexRingOnset = 0.45;

// v_z_m_s: velocity of the hub along the rotor axis (climb > 0) relative to the air; v_xy_m_s >= 0: across it.
RotorThrust solve_thrust(const ThrustModel& model, double omega_rad_s, double v_z_m_s, double v_xy_m_s);

// c_t in still air, independent of ω: with v_i = u ω both equations give 2ρA u² - k2 u - k1 = 0 and c_t = k1 + k2 u.
double static_c_t(const ThrustModel& model);

// Ideal over real power in hover, c_t^1.5 / (sqrt(2ρA) c_q): 0.4 to 0.75 for small propellers, so it exposes unit errors.
double figure_of_merit(const ThrustModel& model, double c_q_N_m_s2);

// Rotor speed that carries the weight in still air, all rotors alike.
double hover_omega_rad_s(const VehicleModel& model);

}  // namespace rotorloop::host
