// Terms with memory in the fit and in prediction, against flights with a load on an elastic string that knows nothing of the model's
// pendulum.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/estimate/flight_motion.hpp"
#include "bench/sysid/score/prediction.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::score {
namespace {

constexpr double kLoad_kg = 0.05, kLength_m = 0.6, kAside_m = 0.12;

host::TermList slung_load() {
  host::TermList terms;
  terms.add(*host::find_term("slung_load"));
  return terms;
}
int parameter(const char* name) { return estimate::find_parameter(std::string("effect.slung_load.") + name, slung_load()); }

// The string pulls at the centre of mass; the model's hook is below the geometric centre.
model_true::Truth balanced() {
  model_true::Truth t;
  t.com_offset_m.setZero();
  return t;
}

log::FlightRecord flight_with_load(std::uint64_t seed, bool quiet = false) {
  model_true::FlightSettings s;
  s.manoeuvre = model_true::Manoeuvre::vertical;  // gentle: swings stay far below the 70° to which the pendulum is good
  s.seed = seed;
  s.duration_s = 8.0;
  if (quiet) {
    s.q_a_m_s2_rtHz = s.q_alpha_rad_s2_rtHz = 0.0;
    s.pose_sigma_m = s.pose_sigma_rad = 1e-5;
  }
  s.load_kg = kLoad_kg;
  s.load_length_m = kLength_m;
  s.load_aside_m = {kAside_m, 0.0, 0.0};
  return model_true::fly(balanced(), s).record;
}

estimate::ModelValues truth_without_load() { return estimate::model_values(model_true::vehicle_of(balanced()), slung_load()); }

estimate::NoiseModel flown_noise() {
  estimate::NoiseModel n;
  n.force_m_s2_rtHz.setConstant(0.03);
  n.angular_rad_s2_rtHz.setConstant(0.3);
  return n;
}

TEST(Memory, DerivativesOfAStepByATermsParametersAndStartsAreThoseOfDifferences) {
  estimate::GridFlight g = estimate::make_grid(flight_with_load(1), {});
  estimate::ModelValues v = truth_without_load();
  v[parameter("mass_kg")] = 0.03;
  v[parameter("damping")] = 0.05;
  v[parameter("drag_1_m")] = 0.03;
  v[parameter("attach_z_m")] = -0.02;
  v[parameter("start_d_x")] = 0.1;
  v[parameter("start_rate_y")] = -0.5;
  const std::vector<estimate::BodyState> states = estimate::states_by_measurements(g, v, flown_noise());
  estimate::follow_states({&g, 1}, std::vector<std::vector<estimate::BodyState>>{states});
  const std::size_t node = 700;  // 3.5 s after the start
  const estimate::BodyState& x = states[node];
  const auto stepped = [&](const estimate::ModelValues& at) {
    estimate::RotorInput input = g.input;
    input.prepare(at);
    std::size_t hint = 0;
    return estimate::Model(at).step(x, input, hint, g.time_s(node), g.time_s(node + 1), 2);
  };
  estimate::Columns columns;
  for (std::size_t k = 0; k < v.terms.parameters(); ++k) columns.push_back(estimate::kCoreParameters + static_cast<int>(k));
  estimate::RotorInput input = g.input;
  input.prepare(v);
  estimate::StateJacobian by_state;
  estimate::ParameterJacobian by;
  std::size_t hint = 0;
  estimate::Model(v, columns).step(x, input, hint, g.time_s(node), g.time_s(node + 1), 2, by_state, by);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const estimate::ParameterInfo info = estimate::parameter_info(columns[c], v.terms);
    estimate::ModelValues up = v, down = v;
    up[columns[c]] += 0.02 * info.scale;
    down[columns[c]] -= 0.02 * info.scale;
    const estimate::StateError slope = estimate::difference(stepped(down), stepped(up)) / (0.04 * info.scale);
    EXPECT_LT((slope - by.col(static_cast<Eigen::Index>(c))).norm(), 2e-4 * slope.norm()) << info.name;
    EXPECT_GT(slope.norm(), 0.0) << info.name;
  }
}

TEST(Memory, WithoutAMotionToFollowALoadHangsStill) {
  const estimate::GridFlight g = estimate::make_grid(flight_with_load(1), {});
  estimate::ModelValues v = truth_without_load();
  v[parameter("start_d_x")] = 0.3;
  estimate::RotorInput input = g.input;
  input.prepare(v);
  std::size_t hint = 0;
  for (const double x : input.at(g.time_s(100), hint, false).memory) EXPECT_EQ(x, 0.0);
}

TEST(Memory, FitFindsMassLengthAndStartOfALoadOnAStringWithin5percentInThreeRounds) {
  estimate::GridFlight g = estimate::make_grid(flight_with_load(2), {.rate_Hz = 100.0});
  estimate::FitProblem p;
  p.start = truth_without_load();
  p.start[parameter("mass_kg")] = 0.02;
  p.start[parameter("length_m")] = 0.5;
  for (const char* name : {"mass_kg", "length_m", "damping"}) p.free.push_back({parameter(name)});
  for (const char* name : {"start_d_x", "start_d_y"}) p.free.push_back({parameter(name), false, 0.2});
  for (const char* name : {"start_rate_x", "start_rate_y"}) p.free.push_back({parameter(name), false, 1.0});
  p.noise = flown_noise();
  p.flights = {&g};
  estimate::Fit r, before;
  std::vector<estimate::BodyState> states = estimate::states_by_measurements(g, p.start, p.noise);
  for (int round = 0; round < 3; ++round) {
    estimate::follow_states({&g, 1}, std::vector<std::vector<estimate::BodyState>>{states});
    before = std::move(r);
    r = estimate::fit(p);
    states = r.states.front();
  }
  EXPECT_TRUE(r.converged);
  EXPECT_NEAR(r.find(parameter("mass_kg"))->value, kLoad_kg, 0.05 * kLoad_kg);
  EXPECT_NEAR(r.find(parameter("length_m"))->value, kLength_m, 0.05 * kLength_m);
  EXPECT_NEAR(r.find(parameter("start_d_x"))->value, kAside_m / kLength_m, 0.02);
  for (const estimate::Estimate& e : r.estimates)
    EXPECT_LT(std::fabs(e.value - before.find(e.parameter)->value), 0.2 * e.u) << estimate::parameter_info(e.parameter, p.start.terms).name;
  EXPECT_LT(2.0 * r.cost / r.degrees_of_freedom, 1.1);
}

// Open loop, without noise, which would hide the load behind the error of the start: it swings on with the vehicle that is predicted.
TEST(Memory, PredictionWithTheLoadErrsLessThanAThirdOfTheOneThatLeavesItOutAfter1s) {
  estimate::GridFlight g = estimate::make_grid(flight_with_load(3, true), {.rate_Hz = 100.0});
  estimate::ModelValues v = truth_without_load();
  v[parameter("mass_kg")] = kLoad_kg;
  v[parameter("length_m")] = kLength_m;
  v[parameter("damping")] = 0.0;
  v[parameter("start_d_x")] = kAside_m / kLength_m;
  estimate::NoiseModel noise = flown_noise();
  noise.position_m.setConstant(1e-5);
  noise.attitude_rad.setConstant(1e-5);
  const std::vector<estimate::BodyState> states = estimate::states_by_measurements(g, v, noise);
  estimate::follow_states({&g, 1}, std::vector<std::vector<estimate::BodyState>>{states});
  const StateTrack track = fitted_track(g, states, v);
  estimate::ModelValues without = v;
  without[parameter("mass_kg")] = 0.0;
  const auto starts = prediction_starts(track, 100, 50);
  const auto with_it = summary(std::vector{predict(track, whole_model(v, 4), starts, 100)});
  const auto without_it = summary(std::vector{predict(track, whole_model(without, 4), starts, 100)});
  EXPECT_LT(with_it.mean[kPredictedVelocity][99], without_it.mean[kPredictedVelocity][99] / 3.0)
      << with_it.mean[kPredictedVelocity][99] << " m/s against " << without_it.mean[kPredictedVelocity][99];
}

}  // namespace
}  // namespace rotorloop::score
