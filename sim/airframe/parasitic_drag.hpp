// Drag of the bare body, as one law for the rigid body and for effects that say where or how much it acts.
// Force -c_xy |v_xy| v_xy in the body plane and -c_z |v_z| v_z along z, v through the air. The in-plane law has no preferred
// direction, unlike the per-axis law of paper eq. (5): the plant is not the model.
#pragma once
#include <Eigen/Core>
#include <cmath>

namespace rotorloop::sim {

struct ParasiticDrag {
  double xy_N_s2_m2 = 0.0;
  double z_N_s2_m2 = 0.0;
  double density_kg_m3 = 1.225;  // that of the coefficients; the force scales with the density of the air around

  Eigen::Vector3d force_B_N(const Eigen::Vector3d& v_air_B_m_s, double air_density_kg_m3) const {
    const Eigen::Vector3d& v = v_air_B_m_s;
    const double v_xy_m_s = std::sqrt(v.x() * v.x() + v.y() * v.y());
    const double in_plane_N_s_m = -xy_N_s2_m2 * v_xy_m_s;
    const Eigen::Vector3d at_reference(in_plane_N_s_m * v.x(), in_plane_N_s_m * v.y(), -z_N_s2_m2 * std::fabs(v.z()) * v.z());
    return (air_density_kg_m3 / density_kg_m3) * at_reference;
  }
};

}  // namespace rotorloop::sim
