// One point of a (virtual) wind-tunnel test of the whole vehicle: what was set and what the balance read. The only thing
// that passes from the tunnel, which knows the plant, to the fit, which knows the model: neither includes the other.
#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

namespace rotorloop::calibrate {

struct LoadPoint {
  Eigen::Vector3d v_B_m_s = Eigen::Vector3d::Zero();       // velocity through the air, body frame
  std::array<double, 4> omega_rad_s{};                     // all 0: propellers taken off
  Eigen::Vector3d force_B_N = Eigen::Vector3d::Zero();     // aerodynamic, without weight
  Eigen::Vector3d torque_B_N_m = Eigen::Vector3d::Zero();  // about the centre of mass
};

// CSV with units in the header. Throws Error (ExitCode::device) when it cannot be written.
void write_load_points(const std::filesystem::path& path, const std::vector<LoadPoint>& points);

}  // namespace rotorloop::calibrate
