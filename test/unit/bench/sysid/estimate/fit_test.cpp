// The fit as a whole, on flights that obey the paper's equations: noise, outliers, priors, flights of their own, what is not observable.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/error.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::estimate {
namespace {

host::VehicleModel guessed_vehicle() {
  host::VehicleModel m;
  m.mass_kg = 0.682;
  m.inertia_kg_m2 = {2.7e-3, 3.1e-3, 5.7e-3};
  const double l = 0.0885;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {2.6e-6, -1.2e-4, 0.0635, 1.2};
  m.c_q_N_m_s2 = 2.5e-8;
  m.drag = {0.01, 0.003, 0.01};
  m.pose_sensor_p_BS_m = {0.08, 0.0, 0.01};
  return m;
}

log::FlightRecord rotation_flight(std::uint64_t seed, const model_true::Truth& truth = {}, double duration_s = 6.0) {
  model_true::FlightSettings s;
  s.manoeuvre = model_true::Manoeuvre::rotation;
  s.seed = seed;
  s.duration_s = duration_s;
  return model_true::fly(truth, s).record;
}

FitProblem rotation_problem(const std::vector<GridFlight>& flights) {
  FitProblem p;
  p.start = model_values(guessed_vehicle());
  for (const GridFlight& f : flights) p.flights.push_back(&f);
  for (const int k : {kIxx, kIyy, kIzz, kCq, kComX, kComY, kK1, kOffsetX, kOffsetY, kOffsetZ, kTurnX, kTurnY, kTurnZ})
    p.free.push_back({k});
  p.start[kK2] = -1.55e-4;
  p.start[kCdh] = 0.0175;
  p.start[kCdxy] = 0.0055;
  p.start[kCdz] = 0.0185;
  p.noise.force_m_s2_rtHz.setConstant(0.03);
  p.noise.angular_rad_s2_rtHz.setConstant(0.3);
  return p;
}

double z_of(const Fit& f, int parameter, double truth) {
  const Estimate* e = f.find(parameter);
  return (e->value - truth) / e->u;
}

// Every fifth measurement of a stream.
template <class T>
log::Stream<T> a_fifth(const log::Stream<T>& s, std::size_t first) {
  log::Stream<T> out;
  for (std::size_t i = first; i < s.size(); i += 5) out.add(s.t_s[i], s.value[i]);
  return out;
}

// Gyro and accelerometer at 200 Hz and 100 nodes a second: two measurements each, whose mean stands 2 to 3 ms off the node, on one side of
// it always. Taken for measurements at the node their means made rotor speeds that are stamped right 2 ms late or early.
TEST(Fit, DelayOfRotorSpeedsIs0WithinHalfAMillisecondWhetherTwoMeasurementsOfANodeStand2msBeforeOrBehindIt) {
  std::vector<double> delay_s;
  for (const std::size_t first : {0u, 4u}) {
    model_true::FlightSettings s;
    s.manoeuvre = model_true::Manoeuvre::rotation;
    s.duration_s = 8.0;
    s.imu_every_ms = 1;
    log::FlightRecord record = model_true::fly({}, s).record;
    record.gyro_B_rad_s = a_fifth(record.gyro_B_rad_s, first);
    record.accel_B_m_s2 = a_fifth(record.accel_B_m_s2, first);
    const std::vector<GridFlight> flights{make_grid(record, {.rate_Hz = 100.0, .use_gyro = true, .use_accel = true})};
    FitProblem p = rotation_problem(flights);
    p.free.push_back({kRotorDelay});
    p.noise.gyro_rad_s.setConstant(0.005);
    p.noise.accel_m_s2.setConstant(0.1);
    const Fit f = fit(p);
    EXPECT_TRUE(f.converged);
    delay_s.push_back(f.find(kRotorDelay)->value);
    EXPECT_LT(std::fabs(delay_s.back()), 5e-4) << "from measurement " << first << " on";
    const Estimate& e = *f.find(kRotorDelay);
    EXPECT_LT(std::fabs(e.value), 4.0 * std::max(e.u, e.u_robust));  // the standard error that is reported
  }
  EXPECT_NEAR(delay_s[0], delay_s[1], 1e-4) << "what is left is the flight's";
}

TEST(Fit, FindsProcessAndPoseNoiseFromTwiceAndHalfTheirSize) {
  const std::vector<GridFlight> flights{make_grid(rotation_flight(3), {})};
  FitProblem p = rotation_problem(flights);
  p.noise.force_m_s2_rtHz.setConstant(0.06);
  p.noise.angular_rad_s2_rtHz.setConstant(0.15);
  p.noise.position_m.setConstant(1e-3);
  p.noise.attitude_rad.setConstant(4e-3);
  FitOptions o;
  o.noise.rounds = 20;
  o.noise.per_axis = false;
  const Fit f = fit(p, o);
  EXPECT_TRUE(f.converged);
  EXPECT_LT(f.noise_rounds, 15);
  // 6 s of flight know the force density to about 8 %, the others better.
  EXPECT_NEAR(f.noise[0].force_m_s2_rtHz[0], 0.03, 0.3 * 0.03);
  EXPECT_NEAR(f.noise[0].angular_rad_s2_rtHz[0], 0.3, 0.15 * 0.3);
  EXPECT_NEAR(f.noise[0].position_m[0], 2e-3, 0.05 * 2e-3);
  EXPECT_NEAR(f.noise[0].attitude_rad[0], 2e-3, 0.05 * 2e-3);
  EXPECT_NEAR(2.0 * f.cost / f.degrees_of_freedom, 1.0, 0.03);

  // And that is a maximum: half or twice the angular density is less likely.
  for (const double factor : {0.5, 2.0}) {
    FitProblem other = p;
    other.noise = f.noise[0];
    other.noise.angular_rad_s2_rtHz *= factor;
    EXPECT_LT(fit(other).log_likelihood, f.log_likelihood - 10.0) << factor;
  }
}

// A heading that sways by 3 degrees in two seconds is an error of the poses, but no noise of theirs: neighbours differ by 2 mrad.
TEST(Fit, AttitudeNoiseIsNoMoreThanNeighbouringPosesScatterByWhenThePosesSwaySlowly) {
  log::FlightRecord swaying = rotation_flight(12);
  for (std::size_t k = 0; k < swaying.pose.size(); ++k)
    swaying.pose.value[k].q_WS = exp_q({0.0, 0.0, 0.05 * std::sin(3.0 * swaying.pose.t_s[k])}) * swaying.pose.value[k].q_WS;
  const std::vector<GridFlight> flights{make_grid(swaying, {})};
  FitProblem p = rotation_problem(flights);
  FitOptions o;
  o.noise.rounds = 20;
  o.max_iterations = 100;
  const Fit f = fit(p, o);
  EXPECT_TRUE(f.converged);
  EXPECT_LT(f.noise[0].attitude_rad.maxCoeff(), 1.6 * 2e-3);
  EXPECT_GT(f.noise[0].attitude_rad.minCoeff(), 1e-3);
}

TEST(Fit, NoiseFiguresThatChaseEachOtherEndWhenTheFlightsBecomeNoLikelier) {
  const std::vector<GridFlight> flights{make_grid(rotation_flight(3), {})};
  FitOptions o;
  o.noise.rounds = 30;
  o.noise.tolerance = 1e-9;  // no figure ever comes to rest as near as this
  o.max_iterations = 200;
  const Fit f = fit(rotation_problem(flights), o);
  EXPECT_TRUE(f.converged);
  EXPECT_TRUE(f.noise_settled);
  EXPECT_LT(f.noise_rounds, 12);
}

TEST(Fit, AFewWildPosesMoveNothingWhenTheLossIsRobust) {
  log::FlightRecord wild = rotation_flight(4);
  for (std::size_t k = 50; k < wild.pose.size(); k += 100) wild.pose.value[k].p_W_m += Eigen::Vector3d(0.2, -0.1, 0.15);
  const std::vector<GridFlight> flights{make_grid(wild, {})};
  const FitProblem p = rotation_problem(flights);
  FitOptions robust;
  robust.robust_scale = 5.0;
  const Fit with = fit(p, robust), without = fit(p);
  double worst_with = 0.0, worst_without = 0.0;
  const model_true::Truth truth;
  for (int i = 0; i < 3; ++i) {
    worst_with = std::max(worst_with, std::fabs(z_of(with, kIxx + i, truth.inertia_kg_m2[i])));
    worst_with = std::max(worst_with, std::fabs(z_of(with, kOffsetX + i, truth.r_BS_m[i])));
    worst_without = std::max(worst_without, std::fabs(z_of(without, kIxx + i, truth.inertia_kg_m2[i])));
    worst_without = std::max(worst_without, std::fabs(z_of(without, kOffsetX + i, truth.r_BS_m[i])));
  }
  EXPECT_LT(worst_with, 3.5);
  EXPECT_GT(worst_without, 5.0) << "the poses were wild enough to matter";
}

TEST(Fit, EachFlightHasItsOwnCentreOfMassWhenAsked) {
  model_true::Truth moved;
  moved.com_offset_m = {-2.0e-3, 1.0e-3};
  moved.r_BS_m -= Eigen::Vector3d(-3.4e-3, 0.8e-3, 0.0);  // the sensor stays where it is, the centre of mass moves
  const std::vector<GridFlight> flights{make_grid(rotation_flight(5), {}), make_grid(rotation_flight(6, moved), {})};
  FitProblem p = rotation_problem(flights);
  for (FreeParameter& f : p.free)
    f.per_flight = f.parameter == kComX || f.parameter == kComY || (f.parameter >= kOffsetX && f.parameter <= kOffsetZ);
  const Fit f = fit(p);
  EXPECT_EQ(f.estimates.size(), p.free.size() + 5);
  EXPECT_NEAR(f.find(kComX, 0)->value, 1.4e-3, 4.0 * f.find(kComX, 0)->u);
  EXPECT_NEAR(f.find(kComX, 1)->value, -2.0e-3, 4.0 * f.find(kComX, 1)->u);
  EXPECT_LT(f.find(kComX, 1)->u, 3e-4);
  EXPECT_NEAR(f.find(kIxx)->value, 2.41e-3, 4.0 * f.find(kIxx)->u);
}

TEST(Fit, APriorThatIsSharperThanTheDataDecidesAndIsNamedByItsShare) {
  const std::vector<GridFlight> flights{make_grid(rotation_flight(7), {})};
  FitProblem p = rotation_problem(flights);
  for (FreeParameter& f : p.free) {
    if (f.parameter == kIxx) f.prior_u = 1e-9;
  }
  const Fit f = fit(p);
  EXPECT_NEAR(f.find(kIxx)->value, 2.7e-3, 1e-7);
  EXPECT_GT(f.find(kIxx)->prior_share, 0.99);
  EXPECT_LT(f.find(kIyy)->prior_share, 1e-12);
}

TEST(Fit, DoesNotDependOnTheNumberOfThreads) {
  const std::vector<GridFlight> flights{make_grid(rotation_flight(8, {}, 2.0), {}), make_grid(rotation_flight(9, {}, 2.0), {})};
  const FitProblem p = rotation_problem(flights);
  FitOptions two;
  two.threads = 2;
  const Fit a = fit(p), b = fit(p, two);
  EXPECT_EQ(a.cost, b.cost);
  for (std::size_t i = 0; i < a.estimates.size(); ++i) EXPECT_EQ(a.estimates[i].value, b.estimates[i].value);
}

TEST(Fit, EndsAtTheSameMisfitWithSlopesAboutTheMiddleOfStepsOf50ms) {
  GridOptions exact, middle;
  exact.rate_Hz = middle.rate_Hz = 20.0;
  middle.slopes_by_middle = true;
  const log::FlightRecord flown = rotation_flight(11);
  const std::vector<GridFlight> by_exact{make_grid(flown, exact)}, by_middle{make_grid(flown, middle)};
  const Fit a = fit(rotation_problem(by_exact)), b = fit(rotation_problem(by_middle));
  ASSERT_TRUE(a.converged);
  ASSERT_TRUE(b.converged);
  EXPECT_NEAR(b.cost, a.cost, 1e-3 * a.cost);
}

TEST(Fit, EndsWithTheUnobservableCombinationsInsteadOfNumbers) {
  const std::vector<GridFlight> flights{make_grid(rotation_flight(10, {}, 2.0), {})};
  FitProblem p = rotation_problem(flights);
  p.free.push_back({kMass});
  p.free.push_back({kCdh});  // with mass free, every load may be scaled: mass, inertia, k1, c_q together with k2 and airframe drag
  p.free.push_back({kK2});
  p.free.push_back({kCdxy});
  p.free.push_back({kCdz});
  // The scale of the disk's momentum (density, radius) still ties thrust to Newtons, but the battery of measurements here cannot: without
  // that tie nothing is left. Remove it.
  p.start.geometry.air_density_kg_m3 *= 1e9;
  try {
    fit(p);
    FAIL() << "a singular problem gave numbers";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
    const std::string text = e.what();
    EXPECT_NE(text.find("direction"), std::string::npos) << text;
    EXPECT_NE(text.find("m ("), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace rotorloop::estimate
