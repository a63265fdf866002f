// Our own controller behind the C header, built as a library of its own: what it flies has to equal what the runner flies itself.
#include <algorithm>
#include <cmath>

#include "host/control/controller_abi.h"
#include "host/control/gains_file.hpp"
#include "host/effects/vehicle_terms_file.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace {
using namespace rotorloop;

struct Ours {
  host::Controller controller;
  host::ControllerState state;
};

Eigen::Vector3d vector(const double* a) { return {a[0], a[1], a[2]}; }

void* create(const rotorloop_controller_setup* setup) {
  const host::VehicleFile vehicle = host::read_vehicle(setup->vehicle_file, host::builtin_effect_catalogue());
  host::ControllerConfig config = host::controller_config(host::read_gains(setup->gains_file), host::Variant::pd_ff_thrust_drag);
  config.terms = host::terms_of(vehicle, setup->vehicle_file).terms;
  config.period_s = setup->period_s;
  return new Ours{host::Controller(host::to_model(vehicle), config), {}};
}

void step(void* self, const rotorloop_controller_input* in, rotorloop_controller_output* out) {
  auto& ours = *static_cast<Ours*>(self);
  const double* q = in->estimate_q_WB;
  const host::StateEstimate estimate{.time_us = std::llround(in->t_s * 1e6),
                                     .p_W_m = vector(in->estimate_p_W_m),
                                     .v_W_m_s = vector(in->estimate_v_W_m_s),
                                     .q_WB = Eigen::Quaterniond(q[0], q[1], q[2], q[3]),
                                     .w_B_rad_s = vector(in->estimate_w_B_rad_s),
                                     .valid = in->estimate_valid != 0};
  host::Setpoint setpoint;
  setpoint.p_W_m = vector(in->setpoint_p_W_m);
  setpoint.v_W_m_s = vector(in->setpoint_v_W_m_s);
  setpoint.a_W_m_s2 = vector(in->setpoint_a_W_m_s2);
  setpoint.j_W_m_s3 = vector(in->setpoint_j_W_m_s3);
  setpoint.yaw_rad = in->setpoint_yaw_rad;
  setpoint.yaw_rate_rad_s = in->setpoint_yaw_rate_rad_s;
  const host::Command c = ours.controller.step(ours.state, estimate, setpoint);
  std::copy(c.omega_rad_s.begin(), c.omega_rad_s.end(), out->omega_rad_s);
  const host::Diagnostics& d = c.diagnostics;
  const Eigen::Quaterniond& sp = d.q_WB_sp;
  const double q_sp[4] = {sp.w(), sp.x(), sp.y(), sp.z()};
  std::copy(q_sp, q_sp + 4, out->q_WB);
  out->thrust_N = d.thrust_B_N;
  std::copy_n(d.torque_B_N_m.data(), 3, out->torque_B_N_m);
  const host::Limiters& l = d.limiters;
  out->limiters = (l.tilt ? 1u : 0u) | (l.thrust ? 2u : 0u) | (l.roll_pitch ? 4u : 0u) | (l.yaw ? 8u : 0u) | (l.table_edge ? 16u : 0u) |
                  (l.direction_held ? 32u : 0u);
}

void destroy(void* self) { delete static_cast<Ours*>(self); }

}  // namespace

extern "C" const rotorloop_controller* rotorloop_controller_factory(void) {
  static const rotorloop_controller kOurs{.abi = ROTORLOOP_CONTROLLER_ABI,
                                          .setup_size = sizeof(rotorloop_controller_setup),
                                          .input_size = sizeof(rotorloop_controller_input),
                                          .output_size = sizeof(rotorloop_controller_output),
                                          .level = ROTORLOOP_LEVEL_ROTOR_SPEED,
                                          .every = 1,
                                          .own_estimate = 0,
                                          .reserved = 0,
                                          .start_s = 0.0,
                                          .create = create,
                                          .step = step,
                                          .destroy = destroy};
  return &kOurs;
}
