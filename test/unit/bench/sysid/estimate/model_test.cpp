// The model's step and its derivatives: against differences, against exact motions, against the integrator's order.
#include "bench/sysid/estimate/model/model.hpp"

#include <gtest/gtest.h>

#include <random>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::estimate {
namespace {

host::VehicleModel paper_vehicle() {
  host::VehicleModel m;
  m.mass_kg = 0.682;
  m.inertia_kg_m2 = {2.41e-3, 3.42e-3, 5.22e-3};
  m.com_offset_m = {1.4e-3, 2e-4, 0.0};
  const double l = 0.0885;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {3.12e-6, -1.55e-4, 0.0635, 1.2};
  m.c_q_N_m_s2 = 3.1e-8;
  m.drag = {0.0175, 0.0055, 0.0185};
  m.pose_sensor_p_BS_m = {0.09, 0.006, 0.014};
  return m;
}

log::FlightRecord wavy_speeds() {
  log::FlightRecord r;
  r.name = "wavy";
  for (int k = 0; k <= 200; ++k) {
    const double t = k * 1e-3;
    r.rotor_omega_rad_s.add(
        t, {930 + 40 * std::sin(30 * t), 900 + 60 * std::cos(21 * t), 960 - 30 * std::sin(40 * t), 940 + 20 * std::sin(9 * t)});
    r.battery_V.add(t, 16.0 - t);
  }
  return r;
}

BodyState fast_state() {
  BodyState x;
  x.p_W_m = {1.0, -2.0, 3.0};
  x.v_W_m_s = {5.0, -2.0, 1.5};
  x.q_WB = exp_q({0.4, -0.3, 0.9});
  x.w_B_rad_s = {2.0, -3.0, 1.0};
  return x;
}

host::TermList both_terms() {
  host::TermList terms;
  terms.add(*host::find_term("rotor_local_inflow"));
  terms.add(*host::find_term("rotor_inertia_reaction"));
  return terms;
}

// Central differences of a step by state and by every dynamics, input and term parameter.
void expect_exact_derivatives(const ModelValues& values, const RotorInput& rotors, const Columns& columns) {
  RotorInput input = rotors;
  input.prepare(values);
  const Model model(values, columns);
  const BodyState x = fast_state();
  std::size_t hint = 0;
  StateJacobian by_state;
  ParameterJacobian by_columns;
  const BodyState end = model.step(x, input, hint, 0.02, 0.03, 2, by_state, by_columns);
  EXPECT_LT(difference(end, model.step(x, input, hint, 0.02, 0.03, 2)).norm(), 1e-12) << "with and without derivatives: the same step";
  for (int i = 0; i < 12; ++i) {
    const double e = 1e-5;
    const StateError d = e * StateError::Unit(i);
    const StateError slope =
        difference(model.step(moved(x, -d), input, hint, 0.02, 0.03, 2), model.step(moved(x, d), input, hint, 0.02, 0.03, 2)) / (2 * e);
    EXPECT_LT((slope - by_state.col(i)).norm(), 2e-6 * (1.0 + slope.norm())) << "state direction " << i;
  }
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const double e = 1e-3 * parameter_info(columns[c], values.terms).scale;
    BodyState at[2];
    for (int s = 0; s < 2; ++s) {
      ModelValues v = values;
      v[columns[c]] += s ? e : -e;
      RotorInput shifted = rotors;
      shifted.prepare(v);
      at[s] = Model(v).step(x, shifted, hint, 0.02, 0.03, 2);
    }
    const StateError slope = difference(at[0], at[1]) / (2 * e);
    EXPECT_LT((slope - by_columns.col(static_cast<Eigen::Index>(c))).norm(), 2e-5 * slope.norm())
        << parameter_info(columns[c], values.terms).name;
    EXPECT_GT(slope.norm(), 0.0) << parameter_info(columns[c], values.terms).name;
  }
}

TEST(RotorInput, MeanSpeedOfAStepChangesWithTheDelayAsDifferencesSayHoweverNoisyTheMeasurements) {
  log::FlightRecord record;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise_rad_s(0.0, 3.0);
  for (int k = 0; k < 1000; ++k) {
    const double t = 1e-3 * k, smooth = 950.0 + 60.0 * std::sin(12.0 * t);
    log::RotorValues v;
    for (std::size_t r = 0; r < host::kRotors; ++r) v[r] = smooth + noise_rad_s(random);
    record.rotor_omega_rad_s.add(t, v);
  }
  RotorInput input(record);
  ModelValues values = model_values(host::VehicleModel{});
  const auto mean_at = [&](double delay_s, bool derivatives) {
    values[kRotorDelay] = delay_s;
    input.prepare(values);
    std::size_t hint = 0;
    return input.mean(0.5, 0.52, 8, hint, derivatives);
  };
  const double e = 2e-3;
  const RotorInputSample now = mean_at(0.0, true), later = mean_at(e, false), earlier = mean_at(-e, false);
  for (std::size_t r = 0; r < host::kRotors; ++r) {
    const double slope = (later.omega_rad_s[r] - earlier.omega_rad_s[r]) / (2 * e);
    EXPECT_NEAR(now.omega_by[0][r], slope, 250.0) << "rad/s²; measurements 1 ms apart would scatter by 4000";
    EXPECT_NEAR(now.omega_by[0][r], 720.0 * std::cos(12.0 * 0.51), 250.0);
  }
}

TEST(RotorInput, SpeedsReadAtAHighRateLoseHalfOfTheirScatterAndNothingOfTheirCourse) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise_rad_s(0.0, 1.0);
  const auto course = [](double t) { return 950.0 + 60.0 * std::sin(30.0 * t); };  // 5 Hz
  for (const double scatter_rad_s : {0.0, 3.0}) {
    log::FlightRecord record;
    for (int k = 0; k < 1000; ++k) {
      log::RotorValues v;
      for (std::size_t r = 0; r < host::kRotors; ++r) v[r] = course(1e-3 * k) + scatter_rad_s * noise_rad_s(random);
      record.rotor_omega_rad_s.add(1e-3 * k, v);
    }
    RotorInput input(record);
    input.prepare(model_values(host::VehicleModel{}));
    double squares = 0.0, n = 0.0;
    std::size_t hint = 0;
    for (double t = 0.05; t < 0.95; t += 0.01) {
      for (const double omega : input.at(t, hint, false).omega_rad_s) {
        squares += std::pow(omega - course(t), 2);
        n += 1.0;
      }
    }
    const double rms_rad_s = std::sqrt(squares / n);
    EXPECT_LT(rms_rad_s, scatter_rad_s > 0.0 ? 0.55 * scatter_rad_s : 0.01);  // a parabola through nine: 0.505
  }
}

const Columns kAllDynamics{kMass, kIxx, kIyy, kIzz, kIxy, kIxz, kIyz, kCq, kComX, kComY, kK1, kK2, kCdh, kCdxy, kCdz, kTiltX, kTiltY};

TEST(IdentifyModel, DerivativesOfAStepAreThoseOfDifferencesForThePapersModel) {
  expect_exact_derivatives(model_values(paper_vehicle()), RotorInput(wavy_speeds()), kAllDynamics);
}

TEST(IdentifyModel, DerivativesAreExactWithTermsTooAndByTheirParameters) {
  ModelValues v = model_values(paper_vehicle(), both_terms());
  v[kCoreParameters] = 0.9;
  v[kCoreParameters + 1] = 7e-6;
  v[kIxz] = 2e-4;
  Columns columns = kAllDynamics;
  columns.push_back(kCoreParameters);
  columns.push_back(kCoreParameters + 1);
  expect_exact_derivatives(v, RotorInput(wavy_speeds()), columns);
}

TEST(IdentifyModel, DerivativesAboutTheMiddleOfA20msStepAreThoseAlongItWithin5percentAndTheStepIsTheSame) {
  ModelValues v = model_values(paper_vehicle(), both_terms());
  v[kCoreParameters] = 0.9;
  v[kCoreParameters + 1] = 7e-6;
  Columns columns = kAllDynamics;
  columns.push_back(kCoreParameters);
  columns.push_back(kCoreParameters + 1);
  RotorInput input(wavy_speeds());
  input.prepare(v);
  const Model model(v, columns);
  StateJacobian along, middle;
  ParameterJacobian along_by, middle_by;
  std::size_t hint = 0;
  const BodyState a = model.step(fast_state(), input, hint, 0.02, 0.04, 2, along, along_by);
  const BodyState b = model.step_by_middle(fast_state(), input, hint, 0.02, 0.04, 2, middle, middle_by);
  EXPECT_LT(difference(a, b).norm(), 1e-12);
  EXPECT_LT((along - middle).norm(), 1e-3 * along.norm());
  for (Eigen::Index c = 0; c < along_by.cols(); ++c)
    EXPECT_LT((along_by.col(c) - middle_by.col(c)).norm(), 0.05 * along_by.col(c).norm())
        << parameter_info(columns[static_cast<std::size_t>(c)], v.terms).name;
}

TEST(IdentifyModel, DerivativeByTheDelayOfTheRotorLogIsThatOfDifferences) {
  // The time lies inside a sample interval for all stages, so that the interpolation has one slope there.
  log::FlightRecord r = wavy_speeds();
  for (double& t : r.rotor_omega_rad_s.t_s) t *= 40.0;  // one interval of 40 ms
  ModelValues v = model_values(paper_vehicle(), both_terms());
  v[kCoreParameters + 1] = 7e-6;
  v[kRotorDelay] = 0.004;
  for (double& t : r.rotor_omega_rad_s.t_s) t -= 3 * 0.04 - 0.015;
  expect_exact_derivatives(v, RotorInput(r), {kRotorDelay});
}

TEST(IdentifyModel, DerivativesByGainOffsetVoltageExponentAndLagOfACommandedMotorAreThoseOfDifferences) {
  log::FlightRecord r = wavy_speeds();
  for (std::size_t k = 0; k < r.rotor_omega_rad_s.size(); ++k) {
    log::RotorValues u = r.rotor_omega_rad_s.value[k];
    for (double& x : u) x = x / 2000.0 + (k > 60 ? 0.05 : 0.0);
    r.motor_command.add(r.rotor_omega_rad_s.t_s[k], u);
  }
  r.rotor_omega_rad_s = {};
  ModelValues v = model_values(paper_vehicle());
  v.reference_V = 15.0;
  v[kCommandGain] = 1900.0;
  v[kCommandOffset] = 30.0;
  v[kVoltageExponent] = 0.8;
  v[kCommandLag] = 0.03;
  expect_exact_derivatives(v, RotorInput(r), {kCommandGain, kCommandOffset, kVoltageExponent, kCommandLag});
}

TEST(IdentifyModel, HoversWithoutMotionAtTheHoverSpeedOfTheVehicleModel) {
  host::VehicleModel m = paper_vehicle();
  m.com_offset_m.setZero();
  log::FlightRecord r;
  const double hover = host::hover_omega_rad_s(m);
  for (double t : {0.0, 1.0}) r.rotor_omega_rad_s.add(t, {hover, hover, hover, hover});
  std::size_t hint = 0;
  const BodyState end = Model(model_values(m)).step({}, RotorInput(r), hint, 0.0, 1.0, 200);
  EXPECT_LT(end.v_W_m_s.norm(), 1e-9);
  EXPECT_LT(end.w_B_rad_s.norm(), 1e-9);
}

TEST(IdentifyModel, HalvingTheStepDividesTheErrorBySixteen) {
  const Model model(model_values(paper_vehicle()));
  log::FlightRecord r;  // speeds that change linearly: the input has no kink inside
  r.rotor_omega_rad_s.add(0.0, {900, 950, 930, 940});
  r.rotor_omega_rad_s.add(0.2, {960, 910, 950, 900});
  const RotorInput input(r, 0.012, 1.0);
  std::size_t hint = 0;
  const auto after = [&](int substeps) { return model.step(fast_state(), input, hint, 0.0, 0.1, substeps); };
  const BodyState best = after(256);
  const double coarse = difference(best, after(4)).norm(), fine = difference(best, after(8)).norm();
  EXPECT_NEAR(coarse / fine, 16.0, 3.0);
}

TEST(IdentifyModel, AFreeBodyKeepsItsAngularMomentumAndEnergy) {
  host::VehicleModel m = paper_vehicle();
  m.drag = {};
  log::FlightRecord r;
  for (double t : {0.0, 2.0}) r.rotor_omega_rad_s.add(t, {0, 0, 0, 0});
  const RotorInput input(r, 0.012, 10.0);
  std::size_t hint = 0;
  BodyState x = fast_state();
  const Eigen::Vector3d momentum = x.q_WB * m.inertia_kg_m2.cwiseProduct(x.w_B_rad_s);
  const double energy = x.w_B_rad_s.dot(m.inertia_kg_m2.cwiseProduct(x.w_B_rad_s));
  for (int k = 0; k < 100; ++k) x = Model(model_values(m)).step(x, input, hint, 0.01 * k, 0.01 * (k + 1), 4);
  EXPECT_LT((x.q_WB * m.inertia_kg_m2.cwiseProduct(x.w_B_rad_s) - momentum).norm(), 1e-7 * momentum.norm());
  EXPECT_NEAR(x.w_B_rad_s.dot(m.inertia_kg_m2.cwiseProduct(x.w_B_rad_s)), energy, 1e-7 * energy);
}

}  // namespace
}  // namespace rotorloop::estimate
