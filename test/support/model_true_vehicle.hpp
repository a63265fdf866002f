// The truth of a model-true flight in the words of the model that is fitted to it: the only place where the two meet. Apart from
// model_true_airframe on purpose, which must not include host/vehicle.
#pragma once
#include "host/vehicle/model.hpp"
#include "test/support/model_true_airframe.hpp"

namespace rotorloop::model_true {

inline host::VehicleModel vehicle_of(const Truth& t) {
  host::VehicleModel m;
  m.mass_kg = t.mass_kg;
  m.inertia_kg_m2 = t.inertia_kg_m2;
  m.com_offset_m = {t.com_offset_m.x(), t.com_offset_m.y(), 0.0};
  const double l = t.arm_m;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {t.k1_N_s2, t.k2_N_s2_m, t.radius_m, t.air_density_kg_m3};
  m.c_q_N_m_s2 = t.c_q_N_m_s2;
  m.drag = {t.c_dh_s_m, t.c_dxy_N_s2_m2, t.c_dz_N_s2_m2};
  m.pose_sensor_p_BS_m = t.r_BS_m;
  m.pose_sensor_q_BS = t.q_BS;
  return m;
}

}  // namespace rotorloop::model_true
