// The shipped motor by its numbers, and bad motor files by their messages.
#include "sim/plant/motor_file.hpp"

#include "test/unit/sim/plant/bad_input.hpp"

namespace rotorloop::sim {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string message_of_motor(const std::string& from, const std::string& to, const std::string& line_of = "") {
  return test::message_after(
      "motors/2306_2300kv.toml", from, to, [](const TomlFile& f) { return read_motor(f); }, line_of);
}

TEST(MotorFile, TheShippedMotorIsThe2300KvMotorOfTheReferenceDrive) {
  const MotorFile m = read_motor(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/motors/2306_2300kv.toml");
  EXPECT_NEAR(speed_constant_rpm_V(m), 2300.0, 5.0);
  EXPECT_EQ(m.pole_pairs, 7);
  EXPECT_EQ(m.resistance_ohm, 0.06);
  EXPECT_EQ(m.inductance_d_H, 15e-6);
  EXPECT_EQ(m.inductance_q_H, 18e-6);
  EXPECT_EQ(m.inertia_kg_m2, 5.0e-6);
  EXPECT_EQ(m.static_friction_N_m, 1.5e-3);
  EXPECT_EQ(m.cogging_N_m, 1e-3);
}
TEST(MotorFile, FluxInOtherUnitsShowsInTheSpeedConstant) {
  EXPECT_THAT(message_of_motor("flux_linkage_Wb = 3.42e-4", "flux_linkage_Wb = 0.0342"),
              AllOf(HasSubstr("flux_linkage_Wb = 0.0342 Wb with 7 pole pairs is a motor of 23 rpm/V, credible is 50 to 20000"),
                    HasSubstr("likely: poles given instead of pole pairs"),
                    HasSubstr("do:     use flux = 60 / (sqrt(3) * 2 pi * Kv * pole_pairs)")));
}
TEST(MotorFile, ResistanceInMilliohmIsOutOfRange) {
  EXPECT_THAT(message_of_motor("resistance_ohm = 0.06", "resistance_ohm = 60"),
              HasSubstr("resistance_ohm = 60 ohm is outside 0.001 to 10 ohm"));
}
TEST(MotorFile, InductanceInMicrohenryIsOutOfRange) {
  EXPECT_THAT(message_of_motor("{ d = 15e-6, q = 18e-6 }", "{ d = 15.0, q = 18.0 }"),
              HasSubstr("inductance_H.d = 15 H is outside 5e-07 to 0.01 H"));
}
TEST(MotorFile, ExchangedInductancesAreRefused) {
  EXPECT_THAT(message_of_motor("{ d = 15e-6, q = 18e-6 }", "{ d = 18e-6, q = 15e-6 }"),
              AllOf(HasSubstr("saliency 0.83 is outside 1 to 3"), HasSubstr("likely: d and q exchanged")));
}
TEST(MotorFile, HalfAPolePairIsNotAnInteger) {
  EXPECT_THAT(message_of_motor("pole_pairs = 7", "pole_pairs = 7.5"), HasSubstr("pole_pairs = 7.5 is a number, expected an integer"));
}
TEST(MotorFile, NegativeFrictionIsRefused) {
  EXPECT_THAT(message_of_motor("static_friction_N_m = 1.5e-3", "static_friction_N_m = -1.5e-3"),
              HasSubstr("static_friction_N_m = -0.0015 N m is outside 0 to 0.5 N m"));
}
TEST(MotorFile, AnUnknownKeyIsRefused) {
  EXPECT_THAT(message_of_motor("cogging_N_m = 1e-3", "cogging_N_m = 1e-3\nkv = 2300", "kv = 2300"), HasSubstr("unknown key \"kv\""));
}

}  // namespace
}  // namespace rotorloop::sim
