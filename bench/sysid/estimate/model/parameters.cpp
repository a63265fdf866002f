#include "bench/sysid/estimate/model/parameters.hpp"

#include <array>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/effects/loads.hpp"

namespace rotorloop::estimate {
namespace {

struct CoreInfo {
  const char *name, *symbol, *unit;
  double scale, min, max;
};
// In the order of enum Parameter. The bounds are those of vehicles from 10 g to 100 kg; they stop a fit that runs away.
constexpr std::array<CoreInfo, kCoreParameters> kCore{{
    {"body.mass", "m", "kg", 1e-1, 1e-3, 1e3},
    {"body.inertia.xx", "I_xx", "kg m2", 1e-3, 1e-9, 1e3},
    {"body.inertia.yy", "I_yy", "kg m2", 1e-3, 1e-9, 1e3},
    {"body.inertia.zz", "I_zz", "kg m2", 1e-3, 1e-9, 1e3},
    {"body.inertia.xy", "I_xy", "kg m2", 1e-4, -1e3, 1e3},
    {"body.inertia.xz", "I_xz", "kg m2", 1e-4, -1e3, 1e3},
    {"body.inertia.yz", "I_yz", "kg m2", 1e-4, -1e3, 1e3},
    {"torque_model.c_q", "c_q", "N m s2", 1e-8, 1e-14, 1e-2},
    {"body.com_offset.x", "Δx", "m", 1e-3, -1.0, 1.0},
    {"body.com_offset.y", "Δy", "m", 1e-3, -1.0, 1.0},
    {"thrust_model.k1", "k_1", "N s2", 1e-6, 1e-12, 1.0},
    {"thrust_model.k2", "k_2", "N s2/m", 1e-4, -1.0, 1.0},
    {"drag.c_dh", "c_d,h", "s/m", 1e-2, -1.0, 1.0},
    {"drag.c_dxy", "c_d,xy", "N s2/m2", 1e-2, -10.0, 10.0},
    {"drag.c_dz", "c_d,z", "N s2/m2", 1e-2, -10.0, 10.0},
    {"gravity_tilt.x", "tilt_x", "rad", 1e-2, -0.5, 0.5},
    {"gravity_tilt.y", "tilt_y", "rad", 1e-2, -0.5, 0.5},
    {"pose_sensor.offset.x", "r_BS,x", "m", 1e-2, -5.0, 5.0},
    {"pose_sensor.offset.y", "r_BS,y", "m", 1e-2, -5.0, 5.0},
    {"pose_sensor.offset.z", "r_BS,z", "m", 1e-2, -5.0, 5.0},
    {"pose_sensor.rotation.x", "q_BS,x", "rad", 1e-2, -3.5, 3.5},
    {"pose_sensor.rotation.y", "q_BS,y", "rad", 1e-2, -3.5, 3.5},
    {"pose_sensor.rotation.z", "q_BS,z", "rad", 1e-2, -3.5, 3.5},
    {"pose_delay", "t_pose", "s", 1e-3, -0.5, 0.5},
    {"gyro_bias.x", "b_gx", "rad/s", 1e-2, -10.0, 10.0},
    {"gyro_bias.y", "b_gy", "rad/s", 1e-2, -10.0, 10.0},
    {"gyro_bias.z", "b_gz", "rad/s", 1e-2, -10.0, 10.0},
    {"accel_bias.x", "b_ax", "m/s2", 1e-1, -20.0, 20.0},
    {"accel_bias.y", "b_ay", "m/s2", 1e-1, -20.0, 20.0},
    {"accel_bias.z", "b_az", "m/s2", 1e-1, -20.0, 20.0},
    {"imu_place.x", "r_BI,x", "m", 1e-2, -5.0, 5.0},
    {"imu_place.y", "r_BI,y", "m", 1e-2, -5.0, 5.0},
    {"imu_place.z", "r_BI,z", "m", 1e-2, -5.0, 5.0},
    {"rotor_delay", "t_rotor", "s", 1e-3, -0.5, 0.5},
    {"command_gain", "g_u", "rad/s", 1e2, 0.0, 1e5},
    {"command_offset", "o_u", "rad/s", 1e1, -1e4, 1e4},
    {"voltage_exponent", "e_V", "1", 1e-1, -2.0, 3.0},
    {"command_lag", "t_motor", "s", 1e-2, 1e-4, 2.0},
}};

}  // namespace

ParameterInfo parameter_info(int parameter, const host::TermList& terms) {
  if (parameter < kCoreParameters) {
    const CoreInfo& c = kCore[static_cast<std::size_t>(parameter)];
    return {c.name, c.symbol, c.unit, c.scale, c.min, c.max};
  }
  const auto flat = static_cast<std::size_t>(parameter - kCoreParameters);
  const host::TermParameter& p = terms.parameter(flat);
  // Several terms have a "share": the symbol says whose.
  const std::string symbol = std::string(terms.term(terms.term_of(flat)).info.id) + "." + std::string(p.name);
  return {"effect." + symbol, symbol, std::string(p.unit), p.scale, p.min, p.max};
}

int find_parameter(std::string_view name, const host::TermList& terms) {
  for (int i = 0; i < kCoreParameters + static_cast<int>(terms.parameters()); ++i) {
    const ParameterInfo info = parameter_info(i, terms);
    if (info.name == name || info.symbol == name) return i;
  }
  return -1;
}

Eigen::Quaterniond ModelValues::q_BS() const {
  const ModelValues& v = *this;
  return start_q_BS * exp_q({v[kTurnX], v[kTurnY], v[kTurnZ]});
}

Eigen::Matrix3d ModelValues::inertia_kg_m2() const {
  const ModelValues& v = *this;
  Eigen::Matrix3d i;
  i << v[kIxx], v[kIxy], v[kIxz], v[kIxy], v[kIyy], v[kIyz], v[kIxz], v[kIyz], v[kIzz];
  return i;
}

ModelValues model_values(const host::VehicleModel& m, const host::TermList& terms) {
  ModelValues out;
  out.geometry = host::load_geometry(m);
  out.start_q_BS = m.pose_sensor_q_BS;
  out.terms = terms;
  out.values.assign(kCoreParameters + terms.parameters(), 0.0);
  out[kMass] = m.mass_kg;
  out[kCq] = m.c_q_N_m_s2;
  out[kK1] = m.thrust.k1_N_s2;
  out[kK2] = m.thrust.k2_N_s2_m;
  out[kCdh] = m.drag.c_dh_s_m;
  out[kCdxy] = m.drag.c_dxy_N_s2_m2;
  out[kCdz] = m.drag.c_dz_N_s2_m2;
  for (int i = 0; i < 3; ++i) {
    out[kIxx + i] = m.inertia_kg_m2[i];
    out[kOffsetX + i] = m.pose_sensor_p_BS_m[i];
    if (i < 2) out[kComX + i] = m.com_offset_m[i];
  }
  out[kVoltageExponent] = 1.0;
  out[kCommandLag] = 0.03;
  for (std::size_t k = 0; k < terms.parameters(); ++k) out[kCoreParameters + static_cast<int>(k)] = terms.parameter(k).neutral;
  return out;
}

host::VehicleModel vehicle_model(const ModelValues& v, const host::VehicleModel& base) {
  host::VehicleModel m = base;
  m.mass_kg = v[kMass];
  m.c_q_N_m_s2 = v[kCq];
  m.thrust.k1_N_s2 = v[kK1];
  m.thrust.k2_N_s2_m = v[kK2];
  m.drag = {v[kCdh], v[kCdxy], v[kCdz]};
  for (int i = 0; i < 3; ++i) {
    m.inertia_kg_m2[i] = v[kIxx + i];
    m.pose_sensor_p_BS_m[i] = v[kOffsetX + i];
    if (i < 2) m.com_offset_m[i] = v[kComX + i];
  }
  m.pose_sensor_q_BS = v.q_BS();
  return m;
}

}  // namespace rotorloop::estimate
