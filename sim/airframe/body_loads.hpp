// What else acts on the body than rotors, weight and its own drag: the interface that keeps the rigid body free of the list of
// physical effects. Also the air around, and the rotors as spinning masses.
#pragma once
#include <Eigen/Core>

namespace rotorloop::sim {

// Air at one place.
struct Air {
  Eigen::Vector3d wind_W_m_s = Eigen::Vector3d::Zero();  // velocity of the air over ground
  double density_kg_m3 = 1.225;
};

// A rotor as a spinning mass. Frame B.
struct SpinningRotor {
  Eigen::Vector3d axis_B = Eigen::Vector3d::UnitZ();  // along the thrust
  int spin = 1;                                       // +1: counter-clockwise seen from above
  double inertia_kg_m2 = 0.0;                         // about the shaft: bell, shaft and blades
  double omega_rad_s = 0.0;                           // >= 0, relative to the body
  double omega_dot_rad_s2 = 0.0;
};

// Angular momentum of the rotors relative to the body, and how fast it grows as seen in B: all that an inertial effect sees.
struct RotorMomentum {
  Eigen::Vector3d H_B_N_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d H_dot_B_N_m = Eigen::Vector3d::Zero();

  void add(const SpinningRotor& r) {
    const Eigen::Vector3d J_B_kg_m2 = (static_cast<double>(r.spin) * r.inertia_kg_m2) * r.axis_B;
    H_B_N_m_s += r.omega_rad_s * J_B_kg_m2;
    H_dot_B_N_m += r.omega_dot_rad_s2 * J_B_kg_m2;
  }
};

// Force and moment about the centre of mass, frame B.
struct Wrench {
  Eigen::Vector3d force_B_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment_B_N_m = Eigen::Vector3d::Zero();
};

// The body at one instant of a step: all that a load on it may depend on.
struct BodyMotion {
  double time_s = 0.0;
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  // centre of mass
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d w_B_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_air_B_m_s = Eigen::Vector3d::Zero();  // velocity of the centre of mass through the air
  double density_kg_m3 = 1.225;
  RotorMomentum rotors;
};

// Evaluated at every stage of the integrator: must depend on the motion and on what is constant over the step alone.
class BodyLoads {
 public:
  virtual ~BodyLoads() = default;
  virtual void add_to(Wrench& wrench, const BodyMotion& motion) const = 0;
};

}  // namespace rotorloop::sim
