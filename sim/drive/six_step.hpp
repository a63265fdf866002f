// A six-step (block) drive, averaged over a commutation cycle: for motors on a duty-cycle ESC of somebody else's make. Two of
// three phases conduct; commutation is ideally timed, each pair carries the current while its line back-EMF is within 30
// electrical degrees of its peak. Beside motor.hpp, which is phase-resolved and driven by our field-oriented firmware.
//
// Mean over one 60-degree sector, w mechanical, w_e = p w electrical speed, complementary PWM (the current never breaks off):
//   d V = k_e w + R I + 3/pi w_e L I_c        T_em = k_e I        T_em = load(w) + friction + c w  in the steady state
// - k_e: a sinusoidal phase EMF of peak lambda w_e gives a line EMF of peak sqrt(3) lambda w_e, whose mean over +-30 degrees is
//   (1/(pi/3)) * integral of cos = 3/pi of the peak: k_e = 3 sqrt(3)/pi p lambda. A trapezoid flat over 120 degrees of phase has a
//   flat line EMF of 2 lambda w_e: k_e = 2 p lambda. With constant EMF in the sector the mean power e I gives the torque.
// - R: two phases and two switches in series. I: mean current of the phase that stays on, which with flat EMF carries the torque.
// - 3/pi w_e L I_c: every sector the current has to be built up anew in one phase. Around the loop of the phase that stays and the
//   one that enters, V_loop = e + R i + L (di_in/dt + di_stay/dt); i_stay begins and ends a sector at I_c, i_in goes from 0 to I_c.
//   Integrated over the sector's pi/(3 w_e) seconds that costs L I_c of voltage-time. The same as the overlap drop of a
//   line-commutated bridge (Mohan, Undeland, Robbins, Power Electronics, ch. 5). It stores and returns energy: no loss.
// - I_c over I: the phase that leaves hangs on a diode. With flat EMF e/2 per phase, v = d V, Kirchhoff's laws at the star point give
//   its fall and the dip of the current that stays (Carlson, Lajoie-Mazenc, Fagundes 1992; here with the resistance neglected):
//     high side leaves: fall (v + e)/(3L), dip I_c (2e - v)/(v + e);  low side: fall (2V - v + e)/(3L), dip I_c (2e + V - 2v)/(2V - v + e)
//   The current falls and recovers in straight lines: I = I_c (1 - mean dip / 2). Dips of one half, usual under load: I_c = 4/3 I.
// The bus current follows from the power balance, V I_bus = T_em w + R I^2 + switching loss.
// Holds while the phase that leaves is empty within its sector (overlap_share < 1), for driving; braking takes the same formula. The
// electrical time constant is taken as short beside the shaft's. Current within 2 % of a bridge stepped phase by phase (tests).
#pragma once
#include <cstdint>
#include <functional>

namespace rotorloop::sim {

struct SixStepParameters {
  double emf_constant_V_s = 0.0;    // k_e: mean line EMF per mechanical rad/s; also torque per ampere, N m/A
  double resistance_ohm = 0.0;      // R, line to line with both switches
  double phase_inductance_H = 0.0;  // L of one phase; 0: commutation takes no time
  int pole_pairs = 7;
  double static_friction_N_m = 0.0;     // bearings and hysteresis
  double viscous_friction_N_m_s = 0.0;  // air in the bell and eddy currents
  double switching_time_s = 0.0;        // rise and fall together, of the switch that is modulated
  double pwm_Hz = 0.0;
};

enum class EmfShape : std::uint8_t { sinusoidal, trapezoidal };

// k_e from the peak flux linkage of one phase (MotorParameters::flux_linkage_Wb).
double six_step_emf_constant_V_s(EmfShape shape, double flux_linkage_Wb, int pole_pairs);
// k_e from a speed constant measured as no-load rpm per volt of d V under six-step: the mean line EMF is meant. A constant from the
// PEAK line EMF, as speed_constant_rpm_V of sim/plant has it, is 3/pi of that for a sinusoidal motor.
double six_step_emf_constant_V_s(double no_load_rpm_per_V);

// Everything at one speed. The motor brakes (I < 0) above the speed at which its EMF equals d V.
struct SixStepPoint {
  double omega_rad_s = 0.0;
  double current_A = 0.0;  // in the conducting pair
  double bus_current_A = 0.0;
  double electromagnetic_N_m = 0.0;
  double friction_N_m = 0.0;  // static and viscous
  double resistive_loss_W = 0.0;
  double switching_loss_W = 0.0;    // bus_V |I| switching_time pwm_Hz / 2: linear rise and fall
  double commutation_drop_V = 0.0;  // 3/pi w_e L I_c
  double overlap_share = 0.0;       // of a sector, in which the high side that leaves still carries current
};

SixStepPoint six_step_at(const SixStepParameters& p, double bus_V, double duty, double omega_rad_s);

// The duty, 0 to 1, at which the pair carries this current at this speed: what a free-running motor says of an ESC's throttle curve.
double six_step_duty(const SixStepParameters& p, double bus_V, double omega_rad_s, double current_A);

using LoadTorque = std::function<double(double omega_rad_s)>;  // N m against the rotation, not falling with speed

// The speed at which torque balances. Stalls (omega 0, current d V / R) when static friction and load hold the shaft.
SixStepPoint six_step_steady(const SixStepParameters& p, double bus_V, double duty, const LoadTorque& load);

// Shaft speed after dt (midpoint rule); forward rotation only, dry friction holds a shaft that stands.
double six_step_advance(const SixStepParameters& p, double inertia_kg_m2, double bus_V, double duty, const LoadTorque& load,
                        double omega_rad_s, double dt_s);

}  // namespace rotorloop::sim
