// From logs to parameters on short flights that obey the model: stages, joint fit, poor starts, other inputs than pose and speeds.
#include "bench/sysid/identify/identify.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/identify/derived.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"
#include "host/base/error.hpp"
#include "host/vehicle/thrust.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::identify {
namespace {

using model_true::Manoeuvre;

host::VehicleFile paper() {
  return host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue());
}

FlightToFit flown(Manoeuvre m, double duration_s, bool imu = false) {
  model_true::FlightSettings s;
  s.manoeuvre = m;
  s.seed = 11 + static_cast<std::uint64_t>(m);
  s.duration_s = duration_s;
  s.imu_every_ms = imu ? 2 : 0;
  const FlightRole role = m == Manoeuvre::vertical     ? FlightRole::vertical
                          : m == Manoeuvre::horizontal ? FlightRole::horizontal
                                                       : FlightRole::rotation;
  return {model_true::fly({}, s).record, role, {}, {}};
}

// The three flights, flown once for all tests.
const std::vector<FlightToFit>& three_flights() {
  static const std::vector<FlightToFit> flights{flown(Manoeuvre::vertical, 6.0), flown(Manoeuvre::horizontal, 6.0),
                                                flown(Manoeuvre::rotation, 6.0)};
  return flights;
}

// The noise that the flights have, kept: these tests are about parameters.
IdentifyOptions quick() {
  IdentifyOptions o;
  o.grid.rate_Hz = 200.0;
  o.noise.force_m_s2_rtHz.setConstant(0.03);
  o.noise.angular_rad_s2_rtHz.setConstant(0.3);
  return o;
}

// Their fit from the paper's values, made once.
const Identification& result() {
  static const Identification r = identify(three_flights(), paper(), quick());
  return r;
}

// The values of the truth in the order of Parameter, for what a vehicle has.
double truth(int p) {
  const model_true::Truth t;
  switch (p) {
    case estimate::kIxx:
      return t.inertia_kg_m2.x();
    case estimate::kIyy:
      return t.inertia_kg_m2.y();
    case estimate::kIzz:
      return t.inertia_kg_m2.z();
    case estimate::kCq:
      return t.c_q_N_m_s2;
    case estimate::kComX:
      return t.com_offset_m.x();
    case estimate::kComY:
      return t.com_offset_m.y();
    case estimate::kK1:
      return t.k1_N_s2;
    case estimate::kK2:
      return t.k2_N_s2_m;
    case estimate::kCdh:
      return t.c_dh_s_m;
    case estimate::kCdxy:
      return t.c_dxy_N_s2_m2;
    case estimate::kCdz:
      return t.c_dz_N_s2_m2;
    case estimate::kOffsetX:
      return t.r_BS_m.x();
    case estimate::kOffsetY:
      return t.r_BS_m.y();
    case estimate::kOffsetZ:
      return t.r_BS_m.z();
    default:
      return 0.0;
  }
}

void expect_truth_within(double z, const std::vector<estimate::Estimate>& estimates, const std::string& what) {
  for (const estimate::Estimate& e : estimates) {
    if (e.parameter == estimate::kMass || (e.parameter >= estimate::kTurnX && e.parameter <= estimate::kTurnZ)) continue;
    EXPECT_LT(std::fabs(e.value - truth(e.parameter)), z * reported_u(e))
        << what << " " << estimate::parameter_info(e.parameter, {}).symbol;
  }
}

TEST(Identify, FindsAllParametersOfThreeFlightsWithinFourStandardUncertainties) {
  const Identification& r = result();
  ASSERT_TRUE(r.fit.converged);
  EXPECT_EQ(r.fit.estimates.size(), 19u);  // mass, 17 of the paper (q_BS counts three), pose delay
  expect_truth_within(4.0, r.fit.estimates, "joint");
  EXPECT_LT(r.fit.find(estimate::kIxx)->u / truth(estimate::kIxx), 0.02);
  EXPECT_NEAR(2.0 * r.fit.cost / r.fit.degrees_of_freedom, 1.0, 0.05);
}

TEST(Identify, StagesFindTheirParametersAndAgreeWithTheJointFit) {
  const Identification& r = result();
  ASSERT_EQ(r.stages.size(), 3u);
  for (const StageResult& s : r.stages) expect_truth_within(4.0, s.estimates, std::string(name(s.role)));
  for (const StageComparison& c : r.comparison)
    EXPECT_TRUE(c.agrees) << name(c.role) << " " << estimate::parameter_info(c.parameter, {}).symbol << " " << c.z;
}

TEST(Identify, AStageCarriesTheUncertaintyOfWhatItHolds) {
  // Stage 1 holds c_d,z; with its uncertainty, k_2 is less certain than if c_d,z were known.
  const Identification& r = result();
  const StageResult& vertical = r.stages.front();
  bool found = false;
  for (std::size_t i = 0; i < vertical.estimates.size(); ++i) {
    if (vertical.estimates[i].parameter == estimate::kK2) {
      found = true;
      EXPECT_GT(reported_u(vertical.estimates[i]), 1.5 * vertical.u_alone[i]);
    }
  }
  EXPECT_TRUE(found) << "stage 1 estimates k_2";
}

TEST(Identify, ConvergesToTheSameOptimumFromStartsOffByAFactorOfTwo) {
  const Identification& good = result();
  for (const double factor : {0.5, 2.0}) {
    host::VehicleFile v = paper();
    for (host::Quantity* q : {&v.inertia_kg_m2[0], &v.inertia_kg_m2[1], &v.inertia_kg_m2[2], &v.k1_N_s2, &v.k2_N_s2_m, &v.c_q_N_m_s2,
                              &v.c_dh_s_m, &v.c_dxy_N_s2_m2, &v.c_dz_N_s2_m2}) {
      q->value *= factor;
      q->u = std::fabs(q->value);
    }
    const Identification poor = identify(three_flights(), v, quick());
    ASSERT_TRUE(poor.fit.converged) << factor;
    if (factor == 2.0) {
      EXPECT_LT(poor.start.thrust_scale, 0.7) << "the start already carries the weight";
    }
    for (std::size_t i = 0; i < good.fit.estimates.size(); ++i) {
      const estimate::Estimate &a = good.fit.estimates[i], &b = poor.fit.estimates[i];
      EXPECT_NEAR(a.value, b.value, 0.02 * a.u) << factor << " " << estimate::parameter_info(a.parameter, {}).symbol;
    }
  }
}

TEST(Identify, StaticThrustIsKnownFarBetterThanItsTwoConstants) {
  const Identification& r = result();
  const auto derived = derived_quantities(r.fit, host::to_model(paper()), 8.5);
  ASSERT_EQ(derived.front().id, "static_c_t");
  const double c_t = model_true::static_thrust_coefficient({});
  EXPECT_NEAR(derived.front().value, c_t, 4.0 * derived.front().u);
  EXPECT_LT(derived.front().u / c_t, 0.4 * r.fit.find(estimate::kK1)->u / truth(estimate::kK1));
}

TEST(Identify, WritesAVehicleThatReadsBackWithCovarianceOriginAndWindow) {
  const Identification& r = result();
  const host::VehicleFile v = identified_vehicle(r.fit, paper(), flown_rpm(r.flights), "test", {"sha256:00"});
  const host::VehicleFile back = host::parse_vehicle(host::vehicle_text(v), "out.toml", host::builtin_effect_catalogue());
  EXPECT_EQ(back, v);
  EXPECT_EQ(v.k1_N_s2.origin, host::Origin::flight);
  EXPECT_EQ(v.mass_kg.origin, host::Origin::cad) << "no flight weighs";
  EXPECT_EQ(v.rotor_inertia_kg_m2, paper().rotor_inertia_kg_m2) << "held: as it was";
  ASSERT_EQ(v.covariance.size(), 1u);
  EXPECT_GT(v.rpm_window[0], 2000.0);
  EXPECT_LT(v.rpm_window[1], 20000.0);
  const host::StaticThrust* c_t = v.static_thrust_of(host::Origin::flight);
  ASSERT_NE(c_t, nullptr);
  EXPECT_NEAR(c_t->c_t_N_s2, host::static_c_t(host::to_model(v).thrust), 1e-15);
  EXPECT_NE(v.static_thrust_of(host::Origin::stand), nullptr) << "what the stand said stays beside it";
  // The sensor's rotation: within 4 u of the truth, about each axis.
  const Eigen::Quaterniond q(v.pose_sensor.quaternion_wxyz[0], v.pose_sensor.quaternion_wxyz[1], v.pose_sensor.quaternion_wxyz[2],
                             v.pose_sensor.quaternion_wxyz[3]);
  const Eigen::Vector3d off = 2.0 * (model_true::Truth{}.q_BS.conjugate() * q).vec();
  for (int i = 0; i < 3; ++i) EXPECT_LT(std::fabs(off[i]), 4.0 * v.pose_sensor.rotation_u_rad[static_cast<std::size_t>(i)]) << i;
}

TEST(Identify, WritesADragJustBelowZeroAsNone) {
  estimate::Fit fit = result().fit;
  const auto written = [&](double uncertainties) {
    for (estimate::Estimate& e : fit.estimates) {
      if (e.parameter == estimate::kCdz) e.value = uncertainties * reported_u(e);
    }
    return identified_vehicle(fit, paper(), {0, 0}, "test", {}).c_dz_N_s2_m2.value;
  };
  EXPECT_EQ(written(-1.0), 0.0);
  EXPECT_LT(written(-5.0), 0.0) << "that is no rounding: for the reader to refuse";
  EXPECT_GT(written(1.0), 0.0);
}

TEST(Identify, WritesInertiaJustBeyondARigidBodysAsTheNearestThatOneHas) {
  estimate::Fit fit = result().fit;
  const auto written = [&](double uncertainties) {
    double sum = 0.0, u2 = 0.0;
    for (const estimate::Estimate& e : fit.estimates) {
      if (e.parameter == estimate::kIxx || e.parameter == estimate::kIyy) sum += e.value;
      if (e.parameter >= estimate::kIxx && e.parameter <= estimate::kIzz) u2 += reported_u(e) * reported_u(e);
    }
    for (estimate::Estimate& e : fit.estimates) {
      if (e.parameter == estimate::kIzz) e.value = sum + uncertainties * std::sqrt(u2);
    }
    const auto inertia = identified_vehicle(fit, paper(), {0, 0}, "test", {}).inertia_kg_m2;
    return (inertia[0].value + inertia[1].value - inertia[2].value) / std::sqrt(u2);
  };
  EXPECT_NEAR(written(-2.0), 2.0, 1e-6) << "a body that can be is left alone";
  EXPECT_GE(written(2.0), 0.0);
  EXPECT_NEAR(written(2.0), 0.0, 1e-6);
  EXPECT_NEAR(written(5.0), -5.0, 1e-6) << "that is no rounding: for the reader to refuse";
}

TEST(Identify, WritesAMassThatTheFlightsMovedAsOneOfFlight) {
  estimate::Fit fit = result().fit;
  const auto written = [&](double weighed_u) {
    for (estimate::Estimate& e : fit.estimates) {
      if (e.parameter == estimate::kMass) e.value = paper().mass_kg.value + weighed_u * paper().mass_kg.u;
    }
    return identified_vehicle(fit, paper(), {0, 0}, "test", {}).mass_kg.origin;
  };
  EXPECT_EQ(written(-0.5), host::Origin::cad);
  EXPECT_EQ(written(-3.0), host::Origin::flight);
}

TEST(Identify, MarksAMassAgainstTheScalesAndAnEstimateAtItsBound) {
  EXPECT_EQ(mark_of({.parameter = estimate::kMass, .prior_share = 0.9, .prior_z = 1.0}), "weighed");
  EXPECT_EQ(mark_of({.parameter = estimate::kMass, .prior_share = 0.9, .prior_z = -3.9}), "contradicted");
  EXPECT_EQ(mark_of({.parameter = estimate::kIxx, .prior_share = 0.9, .prior_z = 1.0}), "not identified");
  EXPECT_EQ(mark_of({.parameter = estimate::kIxx, .u = 1.0, .u_robust = 6.0, .at_bound = true}), "at its bound");
  for (const estimate::Estimate& e : result().fit.estimates) EXPECT_FALSE(e.at_bound) << estimate::parameter_info(e.parameter, {}).symbol;
}

// Eq. (1)-(8) know no inertia of the rotors: its reaction comes out as next to nothing, better known than the file had it.
TEST(Identify, WritesTheRotorInertiaThatItsReactionDeterminedWhereTheControllerLooksForIt) {
  host::VehicleFile start = paper();
  ASSERT_GT(start.rotor_inertia_kg_m2.u, 0.0);
  start.rotor_inertia_kg_m2.value = 2.0 * start.rotor_inertia_kg_m2.u;
  IdentifyOptions o = quick();
  o.terms.add(*host::find_term("rotor_inertia_reaction"));
  const Identification r = identify(three_flights(), start, o);
  EXPECT_EQ(r.start.file[estimate::kCoreParameters], start.rotor_inertia_kg_m2.value) << "what the file says of it";
  const estimate::Estimate* estimate = r.fit.find(estimate::kCoreParameters);
  ASSERT_NE(estimate, nullptr);
  const host::VehicleFile v = identified_vehicle(r.fit, start, {0, 0}, "test", {});
  if (estimate->value > 0.0) {
    EXPECT_EQ(v.rotor_inertia_kg_m2.value, estimate->value);
    EXPECT_EQ(v.rotor_inertia_kg_m2.origin, host::Origin::flight);
  } else {
    EXPECT_EQ(v.rotor_inertia_kg_m2, start.rotor_inertia_kg_m2) << "no rotor is without";
  }
  EXPECT_LT(reported_u(*estimate), start.rotor_inertia_kg_m2.u);
}

TEST(Identify, AHeldEffectOfTheFileKeepsItsUncertaintyAndOrigin) {
  host::VehicleFile start = paper();
  const host::Quantity known{0.9, 0.05, host::Origin::stand};
  start.effects.push_back({"rotor_local_inflow", {{"share", known}}, {}});
  IdentifyOptions o = quick();
  o.terms.add(*host::find_term("rotor_local_inflow"));
  o.wishes.hold = {"effect.rotor_local_inflow"};
  const Identification r = identify({three_flights()[2]}, start, o);
  EXPECT_EQ(identified_vehicle(r.fit, start, {0, 0}, "test", {}).effects.front().parameters.front().quantity, known);
}

TEST(Identify, ExchangedRotorColumnsAreAFitThatRanAwayAndNotFlightsThatTellTooLittle) {
  FlightToFit f = flown(Manoeuvre::rotation, 8.0);
  for (log::RotorValues& w : f.record.rotor_omega_rad_s.value) std::swap(w[0], w[1]);
  f.role = FlightRole::any;
  try {
    const Identification r = identify({f}, paper(), quick());
    EXPECT_FALSE(r.fit.converged);
  } catch (const Error& e) {
    EXPECT_NE(e.text().what.find("ran away"), std::string::npos) << e.what();
    EXPECT_NE(e.text().likely.find("rotor columns exchanged"), std::string::npos) << e.what();
  }
}

TEST(Identify, EstimatesPerFlightWhatMovedBetweenFlights) {
  std::vector<FlightToFit> flights{three_flights()[0], three_flights()[2]};
  model_true::Truth shifted;
  shifted.com_offset_m.x() += 3e-3;
  model_true::FlightSettings s;
  s.manoeuvre = Manoeuvre::rotation;
  s.duration_s = 6.0;
  flights[1].record = model_true::fly(shifted, s).record;
  IdentifyOptions o = quick();
  o.wishes.per_flight = {"body.com_offset"};
  const Identification r = identify(flights, paper(), o);
  EXPECT_NEAR(r.fit.find(estimate::kComX, 1)->value - r.fit.find(estimate::kComX, 0)->value, 3e-3,
              4.0 * std::hypot(r.fit.find(estimate::kComX, 0)->u, r.fit.find(estimate::kComX, 1)->u));
}

TEST(Identify, FitsTheGainOfMotorCommandsInPlaceOfRotorSpeeds) {
  std::vector<FlightToFit> flights{three_flights()[0], three_flights()[2]};
  // Commands of a motor that follows with 30 ms: u = (ω + lag ω̇) / gain, by differences over the log's millisecond.
  constexpr double kGain = 2000.0, kLag_s = 0.03;
  for (FlightToFit& f : flights) {
    const auto& w = f.record.rotor_omega_rad_s;
    for (std::size_t i = 0; i + 1 < w.size(); ++i) {
      log::RotorValues u;
      for (std::size_t r = 0; r < 4; ++r)
        u[r] = (w.value[i][r] + kLag_s * (w.value[i + 1][r] - w.value[i][r]) / (w.t_s[i + 1] - w.t_s[i])) / kGain;
      f.record.motor_command.add(w.t_s[i], u);
    }
    f.record.rotor_omega_rad_s = {};
  }
  host::VehicleFile v = paper();
  v.k1_N_s2.value = truth(estimate::kK1);  // held: gain and k1 cannot be distinguished
  const Identification r = identify(flights, v, quick());
  EXPECT_EQ(r.fit.find(estimate::kK1), nullptr);
  EXPECT_NEAR(r.fit.find(estimate::kCommandGain)->value, kGain, 0.02 * kGain);
  EXPECT_NEAR(r.fit.find(estimate::kCommandLag)->value, kLag_s, 0.003);
}

TEST(Identify, FitsInertiaAndThrustFromGyroAndAccelerometerAlone) {
  FlightToFit f = flown(Manoeuvre::rotation, 8.0, true);
  f.role = FlightRole::any;
  f.record.pose = {};
  IdentifyOptions o = quick();
  o.noise.gyro_rad_s.setConstant(0.005);
  o.noise.accel_m_s2.setConstant(0.1);
  const Identification r = identify({f}, paper(), o);
  EXPECT_EQ(r.fit.find(estimate::kOffsetX), nullptr) << "no pose sensor";
  EXPECT_NEAR(r.fit.find(estimate::kIxx)->value, truth(estimate::kIxx), 0.03 * truth(estimate::kIxx));
  EXPECT_NEAR(r.fit.find(estimate::kIyy)->value, truth(estimate::kIyy), 0.03 * truth(estimate::kIyy));
}

// The message of the Error that `act` throws; its exit code goes to `code`.
template <class Act>
std::string error_of(Act&& act, ExitCode* code = nullptr) {
  try {
    act();
  } catch (const Error& e) {
    if (code) *code = e.exit_code();
    return e.what();
  }
  return "no error";
}

TEST(IdentifyRefuses, ALogWithoutWhatItsStageNeedsNamingColumnAndStage) {
  std::vector<FlightToFit> flights{three_flights()[0]};
  flights[0].record.rotor_omega_rad_s = {};
  ExitCode code{};
  std::string text = error_of([&] { (void)identify(flights, paper(), quick()); }, &code);
  EXPECT_EQ(code, ExitCode::data_quality);
  EXPECT_NE(text.find("stage vertical needs rotor speeds or motor commands"), std::string::npos) << text;
  EXPECT_NE(text.find("omega_1[rad/s]"), std::string::npos) << text;

  flights = {flown(Manoeuvre::horizontal, 2.0, true)};
  flights[0].record.pose = {};
  text = error_of([&] { (void)identify(flights, paper(), quick()); });
  EXPECT_NE(text.find("stage horizontal needs speed"), std::string::npos) << text;
  EXPECT_NE(text.find("p_x[m]"), std::string::npos) << text;

  IdentifyOptions o = quick();
  o.grid.use_gyro = true;
  text = error_of([&] { (void)identify(three_flights(), paper(), o); });
  EXPECT_NE(text.find("gyro_x[rad/s]"), std::string::npos) << text;
}

TEST(IdentifyRefuses, ParametersThatNoFlightTellsByNameInsteadOfGivingNumbers) {
  // The place of an accelerometer that is not read.
  IdentifyOptions o = quick();
  o.wishes.free = {"imu_place.x"};
  ExitCode code{};
  const std::string text = error_of([&] { (void)identify({three_flights()[2]}, paper(), o); }, &code);
  EXPECT_EQ(code, ExitCode::data_quality);
  EXPECT_NE(text.find("r_BI,x"), std::string::npos) << text;
}

TEST(IdentifyRefuses, UnknownNamesWithTheListOfThoseThatExist) {
  IdentifyOptions o = quick();
  o.wishes.hold = {"drag.cdh"};
  const std::string text = error_of([&] { (void)identify(three_flights(), paper(), o); });
  EXPECT_NE(text.find("drag.cdh"), std::string::npos) << text;
  EXPECT_NE(text.find("drag.c_dh"), std::string::npos) << text;
}

}  // namespace
}  // namespace rotorloop::identify
