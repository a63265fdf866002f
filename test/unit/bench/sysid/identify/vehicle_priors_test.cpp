// What a fit knows beforehand from a vehicle file: measured values, guesses, and what earlier flights found.
#include "bench/sysid/identify/vehicle_priors.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace rotorloop::identify {
namespace {

using estimate::JointPrior;

host::VehicleFile file() {
  host::VehicleFile v;
  v.mass_kg = {0.037, 0.0005, host::Origin::cad};
  v.inertia_kg_m2 = {{{1.6e-5, 5e-6, host::Origin::guess}, {1.7e-5, 1e-6, host::Origin::cad}, {2.9e-5, 1e-6, host::Origin::flight}}};
  v.com_offset_m[0] = {0.0, 0.002, host::Origin::guess};
  v.rotor_inertia_kg_m2 = {3.9e-8, 0.0, host::Origin::guess};
  return v;
}

const JointPrior* about(int parameter, const std::vector<JointPrior>& priors) {
  for (const JointPrior& p : priors) {
    if (p.parameters == std::vector<int>{parameter}) return &p;
  }
  return nullptr;
}

double u_of(const JointPrior& p) { return 1.0 / std::sqrt(p.information(0, 0)); }

struct Case {
  host::VehicleFile v = file();
  estimate::ModelValues at;
  std::vector<estimate::FreeParameter> free{
      {estimate::kMass, false, 0.0005}, {estimate::kIxx}, {estimate::kIyy}, {estimate::kIzz}, {estimate::kComX}};
  Case() {
    host::TermList terms;
    terms.add(*host::find_term("rotor_inertia_reaction"));
    at = estimate::model_values(host::VehicleModel{}, terms);
    for (int i = 0; i < 3; ++i) at[estimate::kIxx + i] = v.inertia_kg_m2[static_cast<std::size_t>(i)].value;
    at[estimate::kCoreParameters] = v.rotor_inertia_kg_m2.value;
    free.push_back({estimate::kCoreParameters});
  }
};

TEST(VehiclePriors, AGuessedInertiaIsRightToAFactorOfThreeAndNothingToHoldItAt) {
  const Case c;
  const auto priors = priors_beside_flights(c.v, c.free, c.at);
  const JointPrior* ixx = about(estimate::kIxx, priors);
  ASSERT_NE(ixx, nullptr);
  EXPECT_TRUE(ixx->weak);
  EXPECT_NEAR(u_of(*ixx), std::log(3.0) * 1.6e-5, 1e-9);
  EXPECT_DOUBLE_EQ(ixx->mean[0], 1.6e-5);
  EXPECT_EQ(about(estimate::kIxx, vehicle_priors(c.v, c.free, c.at)), nullptr) << "a diagnosis knows nothing of what was guessed";
}
TEST(VehiclePriors, AnInertiaFromCadCountsWithItsOwnUncertainty) {
  const Case c;
  const auto priors = priors_beside_flights(c.v, c.free, c.at);
  const JointPrior* iyy = about(estimate::kIyy, priors);
  ASSERT_NE(iyy, nullptr);
  EXPECT_FALSE(iyy->weak);
  EXPECT_NEAR(u_of(*iyy), 1e-6, 1e-12);
}
TEST(VehiclePriors, WhatEarlierFlightsFoundCountsForADiagnosisAndIsAGuessForAFitThatMayBeOfTheSameFlights) {
  const Case c;
  const auto of_diagnosis = vehicle_priors(c.v, c.free, c.at), of_fit = priors_beside_flights(c.v, c.free, c.at);
  ASSERT_NE(about(estimate::kIzz, of_diagnosis), nullptr);
  EXPECT_FALSE(about(estimate::kIzz, of_diagnosis)->weak);
  EXPECT_TRUE(about(estimate::kIzz, of_fit)->weak);
}
TEST(VehiclePriors, AGuessOfZeroIsRightToThreeOfItsUncertainties) {
  const Case c;
  const auto priors = priors_beside_flights(c.v, c.free, c.at);
  const JointPrior* com = about(estimate::kComX, priors);
  ASSERT_NE(com, nullptr);
  EXPECT_NEAR(u_of(*com), 0.006, 1e-9);
}
TEST(VehiclePriors, ARotorInertiaThatNoEffectOfTheFileHasIsThatOfTheTorqueModel) {
  const Case c;
  const auto priors = priors_beside_flights(c.v, c.free, c.at);
  const JointPrior* j = about(estimate::kCoreParameters, priors);
  ASSERT_NE(j, nullptr);
  EXPECT_TRUE(j->weak);
  EXPECT_DOUBLE_EQ(j->mean[0], 3.9e-8);
}
TEST(VehiclePriors, TheMassIsLeftToTheFitWhichAsksTheFileItself) {
  const Case c;
  EXPECT_EQ(about(estimate::kMass, vehicle_priors(c.v, c.free, c.at)), nullptr);
}

}  // namespace
}  // namespace rotorloop::identify
