// Tracks of states from logs: streams with clocks of their own, spikes and quaternion signs in, smooth states on one grid out.
#include "bench/sysid/score/state_track.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "bench/sysid/score/prediction.hpp"
#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

// A slow circle with a slow turn, each stream at its own rate; velocity on request.
Eigen::Vector3d position(double t) { return {std::cos(t), std::sin(t), 1.0 + 0.1 * t}; }
Eigen::Vector3d velocity(double t) { return {-std::sin(t), std::cos(t), 0.1}; }
Eigen::Quaterniond attitude(double t) { return estimate::exp_q({0.0, 0.0, 0.8 * t}); }

log::FlightRecord circle(bool with_velocity) {
  log::FlightRecord r;
  r.name = "circle";
  for (int k = 0; k <= 900; ++k) {
    const double t = k / 90.0;
    log::PoseReading p{position(t), attitude(t)};
    if (k % 3 == 0) p.q_WS.coeffs() = -p.q_WS.coeffs();  // the same attitude
    r.pose.add(t, p);
  }
  for (int k = 0; k <= 2000; ++k) r.gyro_B_rad_s.add(k / 200.0, {0.0, 0.0, 0.8});
  for (int k = 0; k <= 700; ++k) r.rotor_omega_rad_s.add(k / 70.0, {1500, 1500, 1500, 1500 + 10.0 * k / 70.0});
  if (with_velocity) {
    for (int k = 0; k <= 800; ++k) r.velocity_W_m_s.add(k / 80.0, velocity(k / 80.0));
  }
  return r;
}

void expect_circle(const StateTrack& track, double velocity_m_s) {
  ASSERT_EQ(track.state.size(), 1001u);
  for (std::size_t k = 100; k < 900; ++k) {
    const double t = track.time_s(k);
    const estimate::BodyState& x = track.state[k];
    EXPECT_LT((x.p_W_m - position(t)).norm(), 2e-4) << t;
    EXPECT_LT((x.v_W_m_s - velocity(t)).norm(), velocity_m_s) << t;
    EXPECT_LT(x.q_WB.angularDistance(attitude(t)), 2e-4) << t;
    EXPECT_NEAR(x.w_B_rad_s.z(), 0.8, 1e-6) << t;
  }
}

TEST(FilteredTrack, BringsStreamsOfAnyRateToOneGridWhateverTheQuaternionsSigns) { expect_circle(filtered_track(circle(true)), 2e-4); }

TEST(FilteredTrack, TakesTheSlopeOfThePositionWhereTheLogHasNoVelocity) { expect_circle(filtered_track(circle(false)), 2e-3); }

TEST(FilteredTrack, RotorSpeedsLoseSpikesAndMissingReadings) {
  log::FlightRecord r = circle(true);
  r.rotor_omega_rad_s.value[200][0] = 1e5;
  r.rotor_omega_rad_s.value[300][1] = std::numeric_limits<double>::quiet_NaN();
  r.rotor_omega_rad_s.value[400][2] = 4000.0;
  const StateTrack track = filtered_track(r);
  std::size_t hint = 0;
  for (std::size_t k = 100; k < 900; ++k) {
    const auto u = track.input.at(track.time_s(k), hint, false);
    for (std::size_t rotor = 0; rotor < 3; ++rotor) EXPECT_NEAR(u.omega_rad_s[rotor], 1500.0, 1e-6);
    EXPECT_NEAR(u.omega_rad_s[3], 1500.0 + 10.0 * track.time_s(k), 1e-3);
    EXPECT_NEAR(u.omega_dot_rad_s2[3], 10.0, 1e-2);
  }
}

TEST(FilteredTrack, CoversOnlyWhatAllStreamsCover) {
  log::FlightRecord r = circle(true);
  r.gyro_B_rad_s = {};
  for (int k = 400; k <= 1000; ++k) r.gyro_B_rad_s.add(k / 200.0, {0.0, 0.0, 0.8});
  const StateTrack track = filtered_track(r);
  EXPECT_NEAR(track.start_s, 2.0, 1e-12);
  EXPECT_EQ(track.state.size(), 301u);
}

TEST(FilteredTrack, NamesTheStreamThatIsMissing) {
  log::FlightRecord r = circle(true);
  r.gyro_B_rad_s = {};
  try {
    filtered_track(r);
    FAIL() << "accepted";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("angular rate"));
  }
}

TEST(FittedTrack, StatesOfAFitArePredictedFromOnTheirOwnClock) {
  host::VehicleModel m;
  m.mass_kg = 0.045;
  m.inertia_kg_m2 = {3.2e-5, 3.5e-5, 4.9e-5};
  const double l = 0.0353;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {5.5e-8, -6.8e-6, 0.0275, 1.2};
  m.c_q_N_m_s2 = 2.2e-10;
  const estimate::ModelValues values = estimate::model_values(m);
  log::FlightRecord r = circle(false);
  estimate::GridOptions options;
  options.rate_Hz = 200.0;
  options.use_pose = true;
  const estimate::GridFlight grid = make_grid(r, options);
  // The states that the model makes of the grid's rotor speeds.
  const estimate::Model model(values);
  std::vector<estimate::BodyState> states{estimate::BodyState{}};
  std::size_t hint = 0;
  for (std::size_t k = 0; k + 1 < grid.nodes; ++k)
    states.push_back(model.step(states.back(), grid.input, hint, grid.time_s(k), grid.time_s(k + 1), 1));
  const StateTrack track = fitted_track(grid, states, values);
  EXPECT_EQ(track.step_s, 0.005);
  const auto starts = prediction_starts(track, 100, 50);
  const PredictionErrors e = predict(track, whole_model(values), starts, 100);
  for (const auto& q : e.error) EXPECT_LT(*std::max_element(q.begin(), q.end()), 1e-9);
}

}  // namespace
}  // namespace rotorloop::score
