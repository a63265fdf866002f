// Closed loop over the independent vehicle of test_flight.hpp: the shipped gains fly the shipped trajectories as the paper's
// controllers do, each refinement earns its place, and what is taken away shows.
#include <gtest/gtest.h>

#include <map>

#include "host/control/gains_file.hpp"
#include "host/control/trajectory_file.hpp"
#include "test/unit/host/control/paper_vehicle.hpp"
#include "test/unit/host/control/test_flight.hpp"

namespace rotorloop::host {
namespace {

using test::FlightFigures;
using test::FlightSetup;

const std::string kRoot = ROTORLOOP_SOURCE_DIR;

const Trajectory& trajectory(const std::string& name) {
  static std::map<std::string, Trajectory> cache;
  auto [at, fresh] = cache.try_emplace(name);
  if (fresh) at->second = read_trajectory(kRoot + "/scenarios/trajectories/" + name + ".toml").trajectory;
  return at->second;
}

FlightSetup setup(Variant variant) {
  FlightSetup s;
  s.model = test::paper_vehicle();
  s.controller = controller_config(read_gains(kRoot + "/vehicles/gains.toml"), variant);
  return s;
}

FlightFigures flown(const std::string& name, Variant variant) {
  static std::map<std::pair<std::string, Variant>, FlightFigures> cache;
  auto [at, fresh] = cache.try_emplace({name, variant});
  if (fresh) at->second = fly(setup(variant), trajectory(name));
  return at->second;
}

constexpr Variant kFf = Variant::pd_ff, kDrag = Variant::pd_ff_drag, kThrustDrag = Variant::pd_ff_thrust_drag;

TEST(HorizontalFlight, PlantHas1p4NewtonOfDragAt8p5) { EXPECT_NEAR(flown("horizontal_8p5", kFf).max_drag_N, 1.4, 0.1); }

TEST(HorizontalFlight, PdFfErrorLiesWithin5To16cm) {
  const FlightFigures f = flown("horizontal_8p5", kFf);
  EXPECT_GT(f.mean_error_m, 0.05);
  EXPECT_LT(f.mean_error_m, 0.16);
  EXPECT_EQ(f.controller.bad_input, 0u);
  EXPECT_EQ(f.controller.limited, 0u);
}

TEST(HorizontalFlight, DragThenThrustCompensationEachReduceTheErrorToUnder2cm) {
  const double ff = flown("horizontal_8p5", kFf).mean_error_m, drag = flown("horizontal_8p5", kDrag).mean_error_m;
  const double both = flown("horizontal_8p5", kThrustDrag).mean_error_m;
  EXPECT_LT(drag, 0.7 * ff);
  EXPECT_LT(both, 0.5 * drag);
  EXPECT_LT(both, 0.02);
}

TEST(HorizontalFlight, WithoutDriftTheMatchedModelTracksToOneCentimetre) {
  FlightSetup s = setup(kThrustDrag);
  s.sensors.drift = false;
  EXPECT_LT(fly(s, trajectory("horizontal_8p5")).mean_error_m, 0.010);
}

TEST(VerticalFlight, PdFfErrorLiesWithin1p8To4p2cmAndFallsByHalf) {
  const double ff = flown("vertical_3p1", kFf).mean_error_z_m, drag = flown("vertical_3p1", kDrag).mean_error_z_m;
  const double both = flown("vertical_3p1", kThrustDrag).mean_error_z_m;
  EXPECT_GT(ff, 0.018);
  EXPECT_LT(ff, 0.042);
  EXPECT_LT(drag, ff);
  EXPECT_LT(both, 0.5 * ff);
}

TEST(GeneralFlight, IsTrackedTo2cmWithTheFullModel) {
  const FlightFigures f = flown("general", kThrustDrag);
  EXPECT_LT(f.mean_error_m, 0.02);
  EXPECT_GT(f.max_rate_rad_s, 5.0);
  EXPECT_EQ(f.controller.limited, 0u);
  EXPECT_LT(f.mean_error_m, 0.5 * flown("general", kFf).mean_error_m);
}

TEST(AllFlights, EstimateStaysWithin2mmOfTheDrift30mmPerSecondAnd5mrad) {
  for (const char* name : {"horizontal_8p5", "vertical_3p1", "general"}) {
    const FlightFigures f = flown(name, kThrustDrag);
    EXPECT_LT(f.est_p_excess_rms_m, 0.002) << name;
    EXPECT_LT(f.est_v_rms_m_s, 0.03) << name;
    EXPECT_LT(f.est_q_rms_rad, 0.005) << name;
    EXPECT_EQ(f.estimator.poses_gated, 0u) << name;
    EXPECT_EQ(f.controller.mixer_not_converged, 0u) << name;
    EXPECT_LT(f.iterations, 3.0) << name;
  }
}

TEST(HorizontalFlight, IgnoringThePosesLatencyCostsMoreThanAllAerodynamics) {
  FlightSetup s = setup(kThrustDrag);
  s.estimator.compensate_latency = false;
  EXPECT_GT(fly(s, trajectory("horizontal_8p5")).mean_error_m, 3.0 * flown("horizontal_8p5", kThrustDrag).mean_error_m);
}

TEST(HorizontalFlight, ThePapersAxialTableLeavesTheLiftOfForwardFlightAsError) {
  FlightSetup s = setup(kThrustDrag);
  s.controller.thrust_lookup = ThrustLookup::axial;
  const double axial = fly(s, trajectory("horizontal_8p5")).mean_error_m;
  EXPECT_GT(axial, 1.5 * flown("horizontal_8p5", kThrustDrag).mean_error_m);
  EXPECT_LT(axial, flown("horizontal_8p5", kDrag).mean_error_m);
}

TEST(GeneralFlight, SurvivesSlowMotorsLateCommandsAndMissingRotorReaction) {
  FlightSetup slow = setup(kThrustDrag);
  slow.plant.motor_lag_s = 0.015;
  slow.plant.command_delay_ms = 6;
  EXPECT_LT(fly(slow, trajectory("general")).mean_error_m, 0.03);
  FlightSetup without = setup(kThrustDrag);
  without.plant.rotor_inertia = 0.0;
  EXPECT_LT(fly(without, trajectory("general")).mean_error_m, 0.02);
}

TEST(GeneralFlight, SofteningYawSparesTheRotorsAndHoldsCourseEvenWithoutTheirReaction) {
  FlightSetup s = setup(kThrustDrag);
  s.plant.c_q = s.model.c_q_N_m_s2 = 1.7e-8;  // a slick propeller: the reaction leads by 0.29 s
  const FlightFigures soft = fly(s, trajectory("general"));
  s.controller.rotor_reaction = false;
  const FlightFigures hard = fly(s, trajectory("general"));
  EXPECT_LT(soft.speed_ripple_rad_s, 0.3 * hard.speed_ripple_rad_s);
  EXPECT_LT(soft.yaw_max_rad, hard.yaw_max_rad + 0.1);
  s.controller.rotor_reaction = true;
  s.plant.rotor_inertia = 0.0;
  EXPECT_LT(fly(s, trajectory("general")).yaw_max_rad, 1.2);  // authority is short, the course is kept
}

TEST(VerticalFlight, EightPercentLessThrustThanModelledShowsAsAStaticError) {
  FlightSetup s = setup(kThrustDrag);
  s.plant.thrust_scale = 1.0 / 1.08;
  // a PD controller has no integral: 8 % of g over the vertical stiffness
  const double wv = s.controller.gains.vertical.frequency_rad_s;
  EXPECT_NEAR(fly(s, trajectory("vertical_3p1")).mean_error_z_m, (1.0 - 1.0 / 1.08) * 9.80665 / (wv * wv), 0.012);
}

TEST(AllFlights, SameSeedGivesTheSameBits) {
  const FlightFigures a = fly(setup(kThrustDrag), trajectory("general"));
  EXPECT_EQ(a.mean_error_m, flown("general", kThrustDrag).mean_error_m);
  EXPECT_EQ(a.max_error_m, flown("general", kThrustDrag).max_error_m);
}

}  // namespace
}  // namespace rotorloop::host
