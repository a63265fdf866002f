// A controller as a shared library, with nothing but the C header of rotorloop: PD on position with feed-forward, at attitude level.
#include <cmath>
#include <cstdio>

#include "host/control/controller_abi.h"

namespace {

constexpr double kG_m_s2 = 9.80665;
constexpr double kFrequency_rad_s = 3.4, kDamping = 0.85;

struct MyController {
  double mass_kg;
};

void* create(const rotorloop_controller_setup* setup) {
  std::fprintf(stderr, "my_controller: %s, %.3f kg\n", setup->flight, setup->mass_kg);  // lands in controller.log
  return new MyController{setup->mass_kg};
}

void step(void* self, const rotorloop_controller_input* in, rotorloop_controller_output* out) {
  const double mass_kg = static_cast<MyController*>(self)->mass_kg;
  double f[3];
  for (int i = 0; i < 3; ++i)
    f[i] = mass_kg * (in->setpoint_a_W_m_s2[i] - kFrequency_rad_s * kFrequency_rad_s * (in->estimate_p_W_m[i] - in->setpoint_p_W_m[i]) -
                      2.0 * kDamping * kFrequency_rad_s * (in->estimate_v_W_m_s[i] - in->setpoint_v_W_m_s[i]));
  f[2] = std::fmax(f[2] + mass_kg * kG_m_s2, 0.2 * mass_kg * kG_m_s2);
  // Yaw first, then the shortest turn of the vertical axis into the thrust direction.
  const double norm = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  const double tilt[4] = {1.0 + f[2] / norm, -f[1] / norm, f[0] / norm, 0.0};
  const double c = std::cos(0.5 * in->setpoint_yaw_rad), s = std::sin(0.5 * in->setpoint_yaw_rad);
  const double length = std::sqrt(2.0 * tilt[0]);
  out->q_WB[0] = tilt[0] * c / length;
  out->q_WB[1] = (tilt[1] * c + tilt[2] * s) / length;
  out->q_WB[2] = (tilt[2] * c - tilt[1] * s) / length;
  out->q_WB[3] = tilt[0] * s / length;
  // Of the wanted thrust, what acts along the present axis.
  const double* q = in->estimate_q_WB;
  const double z[3] = {2.0 * (q[1] * q[3] + q[0] * q[2]), 2.0 * (q[2] * q[3] - q[0] * q[1]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2])};
  out->thrust_N = std::fmax(0.0, f[0] * z[0] + f[1] * z[1] + f[2] * z[2]);
}

void destroy(void* self) { delete static_cast<MyController*>(self); }

}  // namespace

extern "C" const rotorloop_controller* rotorloop_controller_factory(void) {
  static const rotorloop_controller kController = {ROTORLOOP_CONTROLLER_ABI,
                                                   sizeof(rotorloop_controller_setup),
                                                   sizeof(rotorloop_controller_input),
                                                   sizeof(rotorloop_controller_output),
                                                   ROTORLOOP_LEVEL_ATTITUDE,
                                                   1,
                                                   0,
                                                   0,
                                                   0.0,
                                                   create,
                                                   step,
                                                   destroy};
  return &kController;
}
