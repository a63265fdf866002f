// The columns of flight.csv and truth.csv, each named once: the writer, the header row and the reader all walk the same
// visit function, so a column cannot be written under another's name. A value that is not-a-number is an empty cell.
// Units are SI; frames W (world), B (body); rotor order 1..4 as in the vehicle file. Contract: flight log format 1.
#pragma once
#include <array>
#include <limits>

namespace rotorloop::log {

inline constexpr double kEmpty = std::numeric_limits<double>::quiet_NaN();
using Cells3 = std::array<double, 3>;
using Cells4 = std::array<double, 4>;
inline constexpr Cells3 kEmpty3{kEmpty, kEmpty, kEmpty};
inline constexpr Cells4 kEmpty4{kEmpty, kEmpty, kEmpty, kEmpty};

// What the airframe knows: one row per controller step, slower streams only in the row of their arrival.
struct FlightRow {
  double t_s = kEmpty;           // airframe clock
  double pose_t_s = kEmpty;      // when the pose in this row was measured; it arrived at t
  Cells3 p_W_m = kEmpty3;        // pose sensor's own reading, with its offset from the centre of mass
  Cells4 q_WS = kEmpty4;         // w x y z
  Cells3 v_W_m_s = kEmpty3;      // sensor velocity
  Cells4 omega_rad_s = kEmpty4;  // as the ESCs report it
  Cells4 omega_cmd_rad_s = kEmpty4;
  Cells4 i_q_A = kEmpty4;
  double bus_V = kEmpty, bus_A = kEmpty;
  Cells3 gyro_B_rad_s = kEmpty3, accel_B_m_s2 = kEmpty3;
  Cells3 est_p_W_m = kEmpty3, est_v_W_m_s = kEmpty3;  // centre of mass
  Cells4 est_q_WB = kEmpty4;
  Cells3 sp_p_W_m = kEmpty3, sp_v_W_m_s = kEmpty3, sp_a_W_m_s2 = kEmpty3;
  double sp_yaw_rad = kEmpty;
  double thrust_cmd_N = kEmpty;  // collective, along body z
  Cells3 torque_cmd_B_N_m = kEmpty3;
  double control_limiter = kEmpty;  // bit field; meaning in the log header "control_limiter_bits"
};

// What is true in the simulation; identify and diagnose never read it.
struct TruthRow {
  double t_s = kEmpty;
  Cells3 p_W_m = kEmpty3;  // centre of mass
  Cells3 v_W_m_s = kEmpty3;
  Cells4 q_WB = kEmpty4;
  Cells3 w_B_rad_s = kEmpty3;
  Cells4 omega_rad_s = kEmpty4;  // shaft speed
  Cells4 thrust_N = kEmpty4;     // of each rotor, along its axis
  Cells4 shaft_torque_N_m = kEmpty4;
  Cells4 esc_limiter = kEmpty4;  // firmware::Limiter of each ESC, not on any bus; names in the log header "esc_limiter_codes"
  double bus_A = kEmpty;         // of all four, at the battery
  double load_esc_percent = kEmpty, load_state_percent = kEmpty;  // bus load of the 10 ms window that ended last
};

// Visitor: one(name, unit, decimals, value), xyz(…, Cells3), wxyz(…, Cells4), rotors(…, Cells4).
// Decimals: finer than the noise of the quantity by ten or more, coarse enough for 40 MB per minute of flight and truth.
template <class Row, class Visitor>
void visit_flight_columns(Row& r, Visitor&& v) {
  v.one("t", "s", 6, r.t_s);
  v.one("pose_t", "s", 6, r.pose_t_s);
  v.xyz("p", "m", 5, r.p_W_m);
  v.wxyz("q", "1", 6, r.q_WS);
  v.xyz("v", "m/s", 4, r.v_W_m_s);
  v.rotors("omega", "rad/s", 2, r.omega_rad_s);
  v.rotors("omega_cmd", "rad/s", 2, r.omega_cmd_rad_s);
  v.rotors("i_q", "A", 3, r.i_q_A);
  v.one("bus", "V", 3, r.bus_V);
  v.one("bus", "A", 3, r.bus_A);
  v.xyz("gyro", "rad/s", 5, r.gyro_B_rad_s);
  v.xyz("accel", "m/s2", 4, r.accel_B_m_s2);
  v.xyz("est_p", "m", 5, r.est_p_W_m);
  v.xyz("est_v", "m/s", 4, r.est_v_W_m_s);
  v.wxyz("est_q", "1", 6, r.est_q_WB);
  v.xyz("sp_p", "m", 5, r.sp_p_W_m);
  v.xyz("sp_v", "m/s", 4, r.sp_v_W_m_s);
  v.xyz("sp_a", "m/s2", 4, r.sp_a_W_m_s2);
  v.one("sp_yaw", "rad", 5, r.sp_yaw_rad);
  v.one("thrust_cmd", "N", 4, r.thrust_cmd_N);
  v.xyz("torque_cmd", "N m", 6, r.torque_cmd_B_N_m);
  v.one("control_limiter", "1", 0, r.control_limiter);
}

template <class Row, class Visitor>
void visit_truth_columns(Row& r, Visitor&& v) {
  v.one("t", "s", 6, r.t_s);
  v.xyz("true_p", "m", 6, r.p_W_m);
  v.xyz("true_v", "m/s", 5, r.v_W_m_s);
  v.wxyz("true_q", "1", 6, r.q_WB);
  v.xyz("true_w", "rad/s", 5, r.w_B_rad_s);
  v.rotors("true_omega", "rad/s", 2, r.omega_rad_s);
  v.rotors("true_thrust", "N", 4, r.thrust_N);
  v.rotors("true_torque", "N m", 6, r.shaft_torque_N_m);
  v.rotors("esc_limiter", "1", 0, r.esc_limiter);
  v.one("true_bus", "A", 3, r.bus_A);
  v.one("load_esc", "%", 2, r.load_esc_percent);
  v.one("load_state", "%", 2, r.load_state_percent);
}

}  // namespace rotorloop::log
