// The paper's vehicle as the tests of this folder use it.
#pragma once
#include "host/vehicle/model.hpp"

namespace rotorloop::test {

inline host::VehicleModel paper_vehicle() {
  host::VehicleModel m;
  m.mass_kg = 0.682;
  m.inertia_kg_m2 = {2.41e-3, 3.42e-3, 5.22e-3};
  m.com_offset_m = {0.0014, 0.000177, 0.0};
  constexpr double l = 0.0885;
  m.rotors = {host::RotorMount{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}};
  m.thrust = {3.119e-6, -1.547e-4, 0.0635, 1.2};
  m.c_q_N_m_s2 = 3.10e-8;
  m.rotor_inertia_kg_m2 = 9.4e-6;
  m.drag = {0.0175, 0.0055, 0.0185};
  m.pose_sensor_p_BS_m = {0.0901, 0.0063, 0.0142};
  m.pose_sensor_q_BS = Eigen::Quaterniond(0.9975, -0.0241, -0.0122, 0.0646).normalized();
  return m;
}

}  // namespace rotorloop::test
