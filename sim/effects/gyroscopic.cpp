// Turning the body turns the angular momentum of its rotors: moment -Omega x sum(spin * J * omega) on the body. It cancels
// over four equal speeds and shows under yaw torque, when the speeds of the two pairs differ.
// Source: Euler's equation for a body with spinning parts; Sun, de Visser, Chu 2019, eq. (5).
#include <Eigen/Geometry>

#include "sim/effects/builtin.hpp"

namespace rotorloop::sim {
namespace {

Eigen::Vector3d moment(const RotorMomentum& rotors, const Eigen::Vector3d& w_B_rad_s) { return -w_B_rad_s.cross(rotors.H_B_N_m_s); }

}  // namespace

const Effect kGyroscopic{
    .id = "gyroscopic", .parameter = {"J_r_kg_m2", "kg m^2", 0.0, 1e-4, 0.0, ParameterOrigin::drive}, .moment_B_N_m = moment};

}  // namespace rotorloop::sim
