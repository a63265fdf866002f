// What a diagnosis says to the person who flies: sizes in everyday units, rotors by their place, and what to do.
#include <gtest/gtest.h>

#include "bench/sysid/diagnose/remarks.hpp"
#include "test/unit/bench/sysid/diagnose/small_quadrotor.hpp"

namespace rotorloop::diagnose {
namespace {

AddedEffect said(AddedEffect effect, const std::array<std::string, 4>& rotor_columns = {}) {
  Diagnosis d;
  d.added.push_back(std::move(effect));
  add_words(testing::quadrotor_of_0_7_kg_and_125_mm(), rotor_columns, {}, d);
  return d.added.front();
}

TEST(Words, AWeakRotorIsNamedByItsPlaceAndThoseWithinTheirUncertaintyAreNot) {
  const AddedEffect a =
      said({.id = "rotor_speed_scale",
            .parameters = {{"error_1", "1", 0.001, 0.002}, {"error_3", "1", -0.051, 0.002}, {"error_4", "1", 0.0, 0.002}}});
  EXPECT_EQ(a.in_words, "rotor 3 (front left) -5.1 %");
  EXPECT_NE(a.next.find("pole pairs"), std::string::npos) << a.next;
}

TEST(Words, ARotorIsAlsoNamedAsTheLogCallsIt) {
  const AddedEffect a = said({.id = "weak_rotor", .parameters = {{"epsilon_3", "1", -0.051, 0.002}}}, {"m4", "m2", "m3", "m1"});
  EXPECT_EQ(a.in_words, "rotor 3 (front left, m3 in this log) -5.1 %");
}

TEST(Words, WhatDriftsIsSaidInPerCentAMinuteAndAGradientOfTheWindIsNot) {
  EXPECT_EQ(said({.id = "thrust_drift", .parameters = {{"rate_1_s", "1/s", -1.5e-3, 1e-5}}}).in_words, "rate -9 % a minute");
  EXPECT_EQ(said({.id = "rotor_thrust_drift", .parameters = {{"rate_1", "1/s", 0.0, 1e-5}, {"rate_2", "1/s", -2e-3, 1e-5}}}).in_words,
            "rotor 2 (rear left) -12 % a minute");
  EXPECT_EQ(said({.id = "wind_shear", .parameters = {{"gradient_x_1_s", "1/s", 0.3, 0.01}}}).in_words, "gradient x +0.3 1/s");
}

TEST(Words, ATurnedImuIsTurnedInDegreesAndItsMountingIsLookedAt) {
  const AddedEffect a = said({.id = "imu_rotation", .parameters = {{"roll_rad", "rad", 0.0, 1e-4}, {"pitch_rad", "rad", -0.052, 1e-4}}});
  EXPECT_EQ(a.in_words, "pitch -3 deg");
  EXPECT_NE(a.next.find("mounting of the flight controller"), std::string::npos) << a.next;
}

TEST(Words, ALatePoseIsLateInMilliseconds) {
  EXPECT_EQ(said({.id = "pose_delay", .parameters = {{"delay_s", "s", 0.012, 1e-4}}}).in_words, "delay +12 ms");
}

TEST(Words, AWindIsSaidInMetresPerSecondWithoutItsUnitInTheName) {
  EXPECT_EQ(said({.id = "wind_steady", .parameters = {{"w_x_m_s", "m/s", 2.02, 0.03}, {"w_y_m_s", "m/s", 0.01, 0.03}}}).in_words,
            "w x +2.02 m/s");
}

TEST(Words, AnEffectOfTheAirframeIsHeldByTheVehicleFileAndAsksForNothingElse) {
  EXPECT_EQ(said({.id = "rotor_inertia_reaction", .parameters = {{"J_r_kg_m2", "kg m2", 9e-6, 1e-7}}}).next, "");
}

}  // namespace
}  // namespace rotorloop::diagnose
