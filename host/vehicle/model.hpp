// Nominal model of a vehicle, as plain numbers: the form that the controller, the estimator and identification share.
// The file behind it (uncertainties, origins) is vehicle_file.hpp, for hosts only. No heap: also compiles for a Cortex-M7.
// Frames: body B at the centre of mass, x-forward, y-left, z-up. Positions of rotors are given from the geometric centre.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>

#include "host/base/constants.hpp"

namespace rotorloop::host {

inline constexpr int kRotors = 4;

// Order of rotors as in the paper's eq. (3): 1 front-right, 2 rear-left, 3 front-left, 4 rear-right.
struct RotorMount {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  // hub, from the geometric centre, in B axes
  int reaction = 1;                                      // sign of the aerodynamic reaction torque on the body about +z
};

// The constants of eq. (1)-(2). k1 and k2 mean nothing without the disk radius and the air density they were fitted with.
struct ThrustModel {
  double k1_N_s2 = 0.0;
  double k2_N_s2_m = 0.0;  // negative: climbing takes thrust away
  double radius_m = 0.0;
  double air_density_kg_m3 = 0.0;

  double disk_area_m2() const { return 3.14159265358979323846 * radius_m * radius_m; }
  // 2 ρ A of eq. (2), kg/m.
  double momentum_kg_m() const { return 2.0 * air_density_kg_m3 * disk_area_m2(); }
};

// Torque in flow along the axis: c_q(J) = c_q + c_q2 J², J = 2π v_z / (ω D), v_z > 0 in climb. J counts as the nearer end outside the range
// that was measured.
struct AdvanceModel {
  double c_q2_N_m_s2 = 0.0;  // 0: c_q is one number
  double j_low = 0.0, j_high = 0.0;
};

struct DragModel {
  double c_dh_s_m = 0.0;       // rotor drag per thrust, eq. (4)
  double c_dxy_N_s2_m2 = 0.0;  // airframe, eq. (5)
  double c_dz_N_s2_m2 = 0.0;
};

struct VehicleModel {
  double mass_kg = 0.0;
  Eigen::Vector3d inertia_kg_m2 = Eigen::Vector3d::Zero();  // principal, about the centre of mass
  Eigen::Vector3d com_offset_m = Eigen::Vector3d::Zero();   // centre of mass from the geometric centre (Δx, Δy of eq. 3)
  std::array<RotorMount, kRotors> rotors{};
  ThrustModel thrust;
  double c_q_N_m_s2 = 0.0;
  AdvanceModel advance;
  double rotor_inertia_kg_m2 = 0.0;
  DragModel drag;
  Eigen::Vector3d pose_sensor_p_BS_m = Eigen::Vector3d::Zero();  // from the centre of mass
  Eigen::Quaterniond pose_sensor_q_BS = Eigen::Quaterniond::Identity();
  double ceiling_z_m = std::numeric_limits<double>::infinity();  // of the room it flies in, world; infinite: none is known

  // Arm of a rotor from the centre of mass, in B axes.
  Eigen::Vector3d arm_m(int rotor) const { return rotors[static_cast<std::size_t>(rotor)].position_m - com_offset_m; }
  double weight_N() const { return mass_kg * kGravity_m_s2; }
};

}  // namespace rotorloop::host
