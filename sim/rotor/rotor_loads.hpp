// One rotor in moving air: the interface between the blade-element-momentum solve and the airframe.
// Rotor frame R: origin at the hub, z along the thrust, x and y in the disk plane, parallel to body x, y for an untilted rotor.
#pragma once
#include <Eigen/Core>
#include <cstdint>

namespace rotorloop::sim {

struct RotorCondition {
  Eigen::Vector3d v_R_m_s = Eigen::Vector3d::Zero();    // hub velocity relative to the air, in R (climb: z > 0)
  Eigen::Vector3d w_R_rad_s = Eigen::Vector3d::Zero();  // body rate in R; blades see it as a linear inflow gradient
  double omega_rad_s = 0.0;                             // shaft speed >= 0; the sense of rotation is `spin`
  int spin = 1;                                         // +1: counter-clockwise seen from above
  double density_kg_m3 = 1.225;
};

enum class InflowStatus : std::uint8_t {
  converged,      // normal working state
  windmill,       // the rotor takes energy from the air
  vortex_ring,    // momentum theory does not hold; empirical inflow used
  stopped,        // too slow for a meaningful inflow
  not_converged,  // loads are the best iterate; counted and reported
};

struct RotorLoads {
  Eigen::Vector3d force_R_N = Eigen::Vector3d::Zero();     // on the hub: z is thrust, x and y the in-plane force
  Eigen::Vector3d moment_R_N_m = Eigen::Vector3d::Zero();  // on the hub: z is -spin * shaft torque
  double shaft_torque_N_m = 0.0;                           // resisting rotation when > 0
  double induced_m_s = 0.0;                                // mean induced velocity, along -z in climb and hover
  InflowStatus status = InflowStatus::converged;
  int iterations = 0;
};

}  // namespace rotorloop::sim
