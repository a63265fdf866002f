// Libraries that a run has to survive: FAILING_ABI is their ABI number, FAILING_STEP the control step at which they use a null pointer.
#include "host/control/controller_abi.h"

namespace {
int g_controller;
void* create(const rotorloop_controller_setup*) { return &g_controller; }
void step(void*, const rotorloop_controller_input* in, rotorloop_controller_output* out) {
  volatile double* volatile nowhere = nullptr;  // neither the pointer nor what is written through it may be left out
  if (in->step == FAILING_STEP) *nowhere = 1.0;
  for (int i = 0; i < 3; ++i) out->p_W_m[i] = in->setpoint_p_W_m[i];
  out->yaw_rad = in->setpoint_yaw_rad;
}
void destroy(void*) {}
}  // namespace

extern "C" const rotorloop_controller* rotorloop_controller_factory(void) {
  static const rotorloop_controller kFailing{.abi = FAILING_ABI,
                                             .setup_size = sizeof(rotorloop_controller_setup),
                                             .input_size = sizeof(rotorloop_controller_input),
                                             .output_size = sizeof(rotorloop_controller_output),
                                             .level = ROTORLOOP_LEVEL_POSITION,
                                             .every = 1,
                                             .own_estimate = 0,
                                             .reserved = 0,
                                             .start_s = 0.0,
                                             .create = create,
                                             .step = step,
                                             .destroy = destroy};
  return &kFailing;
}
