// The word that was meant: found for slips of the pen, and not made up where nothing is near.
#include "host/base/nearest.hpp"

#include <gtest/gtest.h>

namespace rotorloop {
namespace {

TEST(Nearest, EditDistanceCountsInsertionsDeletionsSubstitutionsAndSwapsOfNeighbours) {
  EXPECT_EQ(edit_distance("", ""), 0u);
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);  // the textbook's pair
  EXPECT_EQ(edit_distance("seeds", "sedes"), 1u);     // one swap
  EXPECT_EQ(edit_distance("mass_kg", "mass_kg"), 0u);
}

TEST(Nearest, ASlipOfOneThirdOfTheLettersIsFoundAndAnythingFartherIsNot) {
  const std::vector<std::string> words{"hil", "identify", "diagnose", "calibrate"};
  EXPECT_EQ(nearest("idnetify", words), "identify");
  EXPECT_EQ(nearest("diagnos", words), "diagnose");
  EXPECT_EQ(nearest("Calibrate", words), "calibrate");
  EXPECT_EQ(nearest("fly", words), "");
  EXPECT_EQ(nearest("", words), "");
  EXPECT_EQ(nearest("identify", {}), "");
}

TEST(Nearest, AKeyWithoutItsUnitAndADashForAnUnderscoreAreFound) {
  EXPECT_EQ(nearest("mass", {"name", "mass_kg"}), "mass_kg");
  EXPECT_EQ(nearest("rotor-drag", {"rotor_drag"}), "rotor_drag");
  EXPECT_EQ(did_you_mean("sedes", {"seeds"}), "did you mean \"seeds\"? ");
  EXPECT_EQ(did_you_mean("quite other", {"seeds"}), "");
}

TEST(Nearest, AKeyIsASlipOfAnotherOnlyWhereItCannotBeAKeyOfItsOwn) {
  EXPECT_TRUE(slip_of_key("vehcle", "vehicle"));
  EXPECT_TRUE(slip_of_key("Vehicle", "vehicle"));
  EXPECT_TRUE(slip_of_key("mass", "mass_kg"));
  EXPECT_TRUE(slip_of_key("mass_g", "mass_kg"));
  EXPECT_TRUE(slip_of_key("densty_kg_m3", "density_kg_m3"));
  EXPECT_TRUE(slip_of_key("masskg", "mass_kg"));
  EXPECT_FALSE(slip_of_key("attitude_kd", "attitude_kp"));
  EXPECT_FALSE(slip_of_key("I_yy_kg_m2", "I_xx_kg_m2"));
  EXPECT_FALSE(slip_of_key("Iyyy_kg_m2", "Ixxx_kg_m2"));
  EXPECT_FALSE(slip_of_key("rotor2", "rotor1"));
  EXPECT_FALSE(slip_of_key("thrust_min_N", "thrust_max_N"));
  EXPECT_FALSE(slip_of_key("k2", "k1"));
  EXPECT_FALSE(slip_of_key("plant", "vehicle"));
}

}  // namespace
}  // namespace rotorloop
