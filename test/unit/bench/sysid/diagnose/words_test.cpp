// What a diagnosis says to the person who flies: sizes in everyday units, rotors by their place, and what to do.
#include <gtest/gtest.h>

#include "bench/sysid/diagnose/remarks.hpp"
#include "test/unit/bench/sysid/diagnose/small_quadrotor.hpp"

namespace rotorloop::diagnose {
namespace {

AddedEffect said(AddedEffect effect) {
  Diagnosis d;
  d.added.push_back(std::move(effect));
  add_words(testing::quadrotor_of_0_7_kg_and_125_mm(), {}, d);
  return d.added.front();
}

TEST(Words, AWeakRotorIsNamedByItsPlaceAndThoseWithinTheirUncertaintyAreNot) {
  const AddedEffect a =
      said({.id = "rotor_speed_scale",
            .parameters = {{"error_1", "1", 0.001, 0.002}, {"error_3", "1", -0.051, 0.002}, {"error_4", "1", 0.0, 0.002}}});
  EXPECT_EQ(a.in_words, "rotor 3 (front left) -5.1 %");
  EXPECT_NE(a.next.find("pole pairs"), std::string::npos) << a.next;
}

TEST(Words, ATurnedImuIsTurnedInDegreesAndItsMountingIsLookedAt) {
  const AddedEffect a = said({.id = "imu_rotation", .parameters = {{"roll_rad", "rad", 0.0, 1e-4}, {"pitch_rad", "rad", -0.052, 1e-4}}});
  EXPECT_EQ(a.in_words, "pitch -3 deg");
  EXPECT_NE(a.next.find("mounting of the flight controller"), std::string::npos) << a.next;
}

TEST(Words, ALatePoseIsLateInMilliseconds) {
  EXPECT_EQ(said({.id = "pose_delay", .parameters = {{"delay_s", "s", 0.012, 1e-4}}}).in_words, "delay +12 ms");
}

TEST(Words, AnEffectOfTheAirframeIsHeldByTheVehicleFileAndAsksForNothingElse) {
  EXPECT_EQ(said({.id = "rotor_inertia_reaction", .parameters = {{"J_r_kg_m2", "kg m2", 9e-6, 1e-7}}}).next, "");
}

}  // namespace
}  // namespace rotorloop::diagnose
