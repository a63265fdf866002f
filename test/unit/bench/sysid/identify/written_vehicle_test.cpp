// The vehicle file against the estimates that it is made of: what cannot be is moved, what is tied goes along, and a line says so.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/identify/mass_check.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::identify {
namespace {

host::VehicleFile start() {
  return host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue());
}

struct Number {
  int parameter;
  double value, u, prior_share = 0.0, prior_z = 0.0;
};

// A fit with these estimates; `correlation` between the last two.
estimate::Fit fit_with(const std::vector<Number>& numbers, double correlation = 0.0, const host::TermList& terms = {}) {
  estimate::Fit fit;
  fit.values = {estimate::model_values(host::to_model(start()), terms)};
  const auto n = static_cast<Eigen::Index>(numbers.size());
  fit.covariance = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Number& x = numbers[static_cast<std::size_t>(i)];
    fit.estimates.push_back(
        {.parameter = x.parameter, .value = x.value, .u = x.u, .u_robust = x.u, .prior_share = x.prior_share, .prior_z = x.prior_z});
    fit.values.front()[x.parameter] = x.value;
    fit.covariance(i, i) = x.u * x.u;
  }
  if (n > 1) fit.covariance(n - 2, n - 1) = fit.covariance(n - 1, n - 2) = correlation * numbers[numbers.size() - 2].u * numbers.back().u;
  fit.robust_covariance = fit.covariance;
  return fit;
}

WrittenVehicle written(const estimate::Fit& fit, const host::VehicleFile& base = start()) {
  return written_vehicle(fit, base, {0, 0}, "test", {});
}

TEST(WrittenVehicle, AnEstimateThatCanBeStandsInTheFileAsItIsAndNeedsNoLine) {
  const WrittenVehicle w = written(fit_with({{estimate::kCdz, 0.02, 0.01}, {estimate::kIzz, 4.5e-3, 1e-4}}));
  EXPECT_EQ(w.file.c_dz_N_s2_m2.value, 0.02);
  EXPECT_EQ(w.file.inertia_kg_m2[2].value, 4.5e-3);
  EXPECT_TRUE(w.differences.empty());
}
TEST(WrittenVehicle, ADragOfMinusOneUncertaintyIsWrittenAs0AndALineNamesBothFigures) {
  const WrittenVehicle w = written(fit_with({{estimate::kCdz, -0.01, 0.01}}));
  EXPECT_EQ(w.file.c_dz_N_s2_m2.value, 0.0);
  ASSERT_EQ(w.differences.size(), 1u);
  EXPECT_NE(w.differences[0].find("c_d,z 0 instead of -0.01 N s2/m2"), std::string::npos) << w.differences[0];
}
TEST(WrittenVehicle, CQMovesAlongWithTheYawInertiaThatItIsTiedToAndBothStandInTheLine) {
  const host::VehicleFile base = start();
  const double sum = base.inertia_kg_m2[0].value + base.inertia_kg_m2[1].value, c_q = base.c_q_N_m_s2.value;
  // The fit is above what a body can have by a tenth, within its u of a fifth; the ratio I_zz / c_q is known ten times better.
  const WrittenVehicle w = written(fit_with({{estimate::kIzz, 1.1 * sum, 0.2 * sum}, {estimate::kCq, 1.1 * c_q, 0.2 * c_q}}, 0.995));
  EXPECT_NEAR(w.file.inertia_kg_m2[2].value, sum, 1e-6 * sum);
  EXPECT_NEAR(w.file.inertia_kg_m2[2].value / w.file.c_q_N_m_s2.value, sum / c_q, 2e-3 * sum / c_q);
  ASSERT_EQ(w.differences.size(), 1u);
  EXPECT_NE(w.differences[0].find("I_zz"), std::string::npos) << w.differences[0];
  EXPECT_NE(w.differences[0].find("c_q"), std::string::npos) << w.differences[0];
}
TEST(WrittenVehicle, ATorqueCoefficientBelowTheIdealPowersByTwoOfItsUIsMovedToWhereTheFigureOfMeritCanBe) {
  const double c_q = 0.4 * start().c_q_N_m_s2.value;
  const host::ThrustModel thrust = host::to_model(start()).thrust;
  ASSERT_GT(host::figure_of_merit(thrust, c_q), 1.0);
  const WrittenVehicle w = written(fit_with({{estimate::kCq, c_q, 0.5 * c_q}}));
  const double merit = host::figure_of_merit(thrust, w.file.c_q_N_m_s2.value);
  EXPECT_LT(merit, 0.85);
  EXPECT_GT(merit, 0.84);
  ASSERT_EQ(w.differences.size(), 1u);
  EXPECT_NE(w.differences[0].find("figure of merit"), std::string::npos) << w.differences[0];
  EXPECT_EQ(written(fit_with({{estimate::kCq, c_q, 0.01 * c_q}})).file.c_q_N_m_s2.value, c_q)
      << "so sure a figure is for the reader to refuse";
}
TEST(WrittenVehicle, ANumberThatItsPriorDeterminesKeepsTheOriginOfAGuess) {
  host::VehicleFile base = start();
  base.c_q_N_m_s2.origin = host::Origin::guess;
  EXPECT_EQ(written(fit_with({{estimate::kCq, base.c_q_N_m_s2.value, 1e-9, 0.9}}), base).file.c_q_N_m_s2.origin, host::Origin::guess);
  EXPECT_EQ(written(fit_with({{estimate::kCq, base.c_q_N_m_s2.value, 1e-9, 0.1}}), base).file.c_q_N_m_s2.origin, host::Origin::flight);
}

struct RotorInertia {
  host::TermList terms;
  int parameter;
  host::VehicleFile base = start();
  RotorInertia(double u, host::Origin origin) {
    terms.add(*host::find_term("rotor_inertia_reaction"));
    parameter = estimate::find_parameter("effect.rotor_inertia_reaction.J_r_kg_m2", terms);
    base.rotor_inertia_kg_m2 = {9.4e-6, u, origin};
  }
  WrittenVehicle written_with(double value, double u) const { return written(fit_with({{parameter, value, u}}, 0.0, terms), base); }
};

TEST(WrittenVehicle, AGuessOfTheRotorsInertiaGivesWayToTheFlightsHoweverSureItCalledItself) {
  const WrittenVehicle w = RotorInertia(1e-7, host::Origin::guess).written_with(7e-6, 5e-7);
  EXPECT_EQ(w.file.rotor_inertia_kg_m2.value, 7e-6);
  EXPECT_EQ(w.file.rotor_inertia_kg_m2.origin, host::Origin::flight);
  EXPECT_TRUE(w.differences.empty());
}
TEST(WrittenVehicle, ARotorInertiaThatADrawingKnowsBetterStaysAndALineSaysSo) {
  const WrittenVehicle w = RotorInertia(1e-7, host::Origin::cad).written_with(7e-6, 5e-7);
  EXPECT_EQ(w.file.rotor_inertia_kg_m2.value, 9.4e-6);
  ASSERT_EQ(w.differences.size(), 1u);
  EXPECT_NE(w.differences[0].find("keeps its rotor inertia of 9.4e-06"), std::string::npos) << w.differences[0];
}
TEST(WrittenVehicle, NoRotorIsWithoutInertia) {
  const WrittenVehicle w = RotorInertia(1e-7, host::Origin::guess).written_with(-1e-7, 5e-7);
  EXPECT_EQ(w.file.rotor_inertia_kg_m2.value, 9.4e-6);
  EXPECT_EQ(w.differences.size(), 1u);
}

Identification with_mass(double kg) {
  Identification r;
  r.fit = fit_with({{estimate::kMass, kg, 0.001, 0.5}});
  return r;
}

TEST(MassCheck, AWeighedMassThatTheFlightsMoveBySixOfItsUEndsWithBothMassesAndWhatToDo) {
  host::VehicleFile v = start();
  v.mass_kg = {0.682, 0.001, host::Origin::cad};
  EXPECT_FALSE(mass_contradicted(with_mass(0.686), v));
  const auto error = mass_contradicted(with_mass(0.688), v);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->exit_code(), ExitCode::data_quality);
  const std::string text = error->what();
  for (const char* part : {"688.00", "682.00", "6.0 of its u", "--hold body.mass"}) EXPECT_NE(text.find(part), std::string::npos) << text;
}
TEST(MassCheck, AGuessedMassMayMove) {
  host::VehicleFile v = start();
  v.mass_kg = {0.682, 0.001, host::Origin::guess};
  EXPECT_FALSE(mass_contradicted(with_mass(0.8), v));
}

}  // namespace
}  // namespace rotorloop::identify
