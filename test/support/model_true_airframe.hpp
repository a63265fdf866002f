// The paper's equations 1 to 8 written a second time, for tests: nothing here is shared with the model under test, and every
// choice differs where it can (bracketed root instead of Newton, Lie midpoint rule at a fine step instead of RK4 at the log's).
// Frames: W world (z up), B body (x forward, y left, z up), origin of B in the centre of mass.
// Rotors: 1 front right, 2 rear left, 3 front left, 4 rear right.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

namespace rotorloop::model_true {

constexpr double kGravity_m_s2 = 9.80665;

using RotorSpeeds = std::array<double, 4>;  // rad/s

// What a fit has to find again. Values: the paper's Table I in SI (k1, k2, c_q are printed per RPM), inertia of its CAD column.
struct Truth {
  double mass_kg = 0.682;
  Eigen::Vector3d inertia_kg_m2{2.41e-3, 3.42e-3, 5.22e-3};
  Eigen::Vector2d com_offset_m{1.4e-3, 0.2e-3};  // of the centre of mass from the geometric centre, eq. 3
  double arm_m = 0.0885;                         // l of eq. 3: half of 177 mm between adjacent hubs
  double k1_N_s2 = 3.12e-6;
  double k2_N_s2_m = -1.55e-4;
  double c_q_N_m_s2 = 3.1e-8;
  double radius_m = 0.0635;
  double air_density_kg_m3 = 1.2;
  double c_dh_s_m = 0.0175;
  double c_dxy_N_s2_m2 = 0.0055;
  double c_dz_N_s2_m2 = 0.0185;
  Eigen::Vector3d r_BS_m{0.0901, 0.0063, 0.0142};                                               // pose sensor from the centre of mass
  Eigen::Quaterniond q_BS = Eigen::Quaterniond(0.9975, -0.0241, -0.0122, 0.0646).normalized();  // sensor to body
  double pose_delay_s = 0.0;   // poses are stamped later than the moment they show
  double rotor_delay_s = 0.0;  // so are rotor speeds
};

struct State {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  // of the centre of mass
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  // body to world
  Eigen::Vector3d omega_B_rad_s = Eigen::Vector3d::Zero();
};

struct RotorThrust {
  double thrust_N = 0.0;
  double induced_m_s = 0.0;  // v_ind of eq. 1 and 2
};

// Eq. 1 and 2 at one rotor speed. Throws std::domain_error where no root has v_z + v_ind > 0: the equations end there.
RotorThrust rotor_thrust(const Truth& truth, double omega_rad_s, const Eigen::Vector3d& v_B_m_s);
// The other way: the speed at which a rotor gives `thrust_N` > 0, rad/s.
double rotor_speed_for(const Truth& truth, double thrust_N, const Eigen::Vector3d& v_B_m_s);
// c_t of a rotor at rest in still air, from eq. 1 and 2 in closed form, N s².
double static_thrust_coefficient(const Truth& truth);

struct Loads {
  Eigen::Vector3d force_B_N = Eigen::Vector3d::Zero();     // thrust and both drags, without weight
  Eigen::Vector3d torque_B_N_m = Eigen::Vector3d::Zero();  // about the centre of mass
  double through_flow_m_s = 0.0;                           // smallest v_z + v_ind of the four rotors
};
Loads loads(const Truth& truth, const State& state, const RotorSpeeds& omega_rad_s);  // eq. 3, 4, 5

// Rotation by |phi| about phi, exact.
Eigen::Quaterniond exponential(const Eigen::Vector3d& phi_rad);

// Eq. 6 to 8 over `step_s` with the midpoint rule, attitude by the exact exponential: second order, unit quaternion by construction.
// `begin` and `middle`: rotor speeds at the start and half-way. `through_flow_m_s` gets the smallest v_z + v_ind met, if given.
State advance(const Truth& truth, const State& state, const RotorSpeeds& begin, const RotorSpeeds& middle, double step_s,
              double* through_flow_m_s = nullptr);

}  // namespace rotorloop::model_true
