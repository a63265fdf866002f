// The fitted model and the independent flights say the same: two derivations of equations 1 to 8 that share no line of code.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/estimate/model/model.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::model_true {
namespace {

estimate::BodyState body_state(const State& x) { return {x.p_W_m, x.v_W_m_s, x.q_WB, x.omega_B_rad_s}; }

struct Worst {
  double position_m = 0, velocity_m_s = 0, attitude_rad = 0, rate_rad_s = 0;
};
// Largest difference after one pose interval of 5 ms from the true state, noise-free flight.
Worst worst_of(Manoeuvre m, int rotor_log_every_ms) {
  FlightSettings s;
  s.manoeuvre = m;
  s.q_a_m_s2_rtHz = s.q_alpha_rad_s2_rtHz = 0.0;
  s.rotor_log_every_ms = rotor_log_every_ms;
  const Truth truth;
  const ModelTrueFlight f = fly(truth, s);
  const estimate::Model model(estimate::model_values(vehicle_of(truth)));
  estimate::RotorInput input(f.record);
  input.prepare(model.values());
  Worst w;
  std::size_t hint = 0;
  for (std::size_t k = 1; k < f.states.size(); ++k) {
    const double t = f.record.pose.t_s[k];
    const estimate::StateError d =
        estimate::difference(body_state(f.states[k]), model.step(body_state(f.states[k - 1]), input, hint, t - 0.005, t, 2));
    w.position_m = std::max(w.position_m, d.segment<3>(0).norm());
    w.velocity_m_s = std::max(w.velocity_m_s, d.segment<3>(3).norm());
    w.attitude_rad = std::max(w.attitude_rad, d.segment<3>(6).norm());
    w.rate_rad_s = std::max(w.rate_rad_s, d.segment<3>(9).norm());
  }
  return w;
}

TEST(ModelTrueStep, FittedModelFollowsTheTruthWithin2PercentOfTheProcessNoiseOfAStepWithSpeedsAt1kHz) {
  for (const Manoeuvre m : {Manoeuvre::vertical, Manoeuvre::horizontal, Manoeuvre::rotation}) {
    const Worst w = worst_of(m, 1);
    EXPECT_LT(w.velocity_m_s, 0.02 * 0.03 * std::sqrt(0.005)) << name_of(m);
    EXPECT_LT(w.rate_rad_s, 0.02 * 0.3 * std::sqrt(0.005)) << name_of(m);
    EXPECT_LT(w.position_m, 1e-6) << name_of(m);
    EXPECT_LT(w.attitude_rad, 1e-5) << name_of(m);
  }
}

TEST(ModelTrueStep, RotorSpeedsAt200HzCostMoreThanTenTimesThat) {
  EXPECT_GT(worst_of(Manoeuvre::rotation, 5).rate_rad_s, 10 * worst_of(Manoeuvre::rotation, 1).rate_rad_s);
}

}  // namespace
}  // namespace rotorloop::model_true
