// The shipped plant by its numbers, and bad plant files by their messages.
#include "sim/plant/plant_file.hpp"

#include "test/unit/sim/plant/bad_input.hpp"

namespace rotorloop::sim {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

PlantFile reference() { return read_plant(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/reference_plant.toml"); }
std::string message(const std::string& from, const std::string& to, const std::string& line_of = "") {
  return test::message_after(
      "reference_plant.toml", from, to, [](const TomlFile& f) { return read_plant(f); }, line_of);
}

TEST(PlantFile, TheShippedPlantIsThePapersVehicle) {
  const PlantFile p = reference();
  EXPECT_EQ(p.body.mass_kg, 0.682);
  EXPECT_EQ(p.body.inertia_kg_m2.diagonal(), Eigen::Vector3d(2.41e-3, 3.42e-3, 5.22e-3));
  EXPECT_EQ(p.body.com_offset_m, Eigen::Vector3d(0.0014, 0.0002, 0.0));
  EXPECT_EQ(p.body.drag_xy_N_s2_m2, 0.0055);
  EXPECT_EQ(p.body.drag_z_N_s2_m2, 0.0185);
  EXPECT_EQ(p.rotors[0].hub_m, Eigen::Vector3d(0.0885, -0.0885, 0.02));
  EXPECT_EQ(p.rotors[3].hub_m, Eigen::Vector3d(-0.0885, -0.0885, 0.02));
  EXPECT_EQ(p.rotors[1].spin, 1);
  EXPECT_EQ(p.rotors[2].spin, -1);
  EXPECT_EQ(p.battery.cells, 4);
  EXPECT_EQ(p.battery.resistance_ohm, 0.03);
  EXPECT_EQ(p.density_kg_m3, 1.2);
  EXPECT_TRUE(p.rotors[0].blade_path.generic_string().ends_with("vehicles/blades/triblade_5in.toml"));
  ASSERT_EQ(p.effects.size(), 3u);
  EXPECT_EQ(p.effects[2].id, "rotor_body_interference");
  EXPECT_GE(p.effects[2].values[0], 1.0);
}
TEST(PlantFile, TheShippedSensorsAreTheReferenceSensorsNeverSoftened) {
  const PlantFile p = reference();
  EXPECT_EQ(p.pose.rate_Hz, 200);
  EXPECT_EQ(p.pose.latency_s, 0.015);
  EXPECT_EQ(p.pose.jitter_s, 0.003);
  EXPECT_EQ(p.pose.noise_m, 0.002);
  EXPECT_EQ(p.pose.noise_rad, 0.002);
  EXPECT_EQ(p.pose.velocity_noise_m_s, 0.05);
  EXPECT_EQ(p.pose.drift_m, 0.005);
  EXPECT_EQ(p.pose.drift_tau_s, 15.0);
  EXPECT_TRUE(p.pose.drift_enabled);
  EXPECT_EQ(p.pose.offset_B_m, Eigen::Vector3d(0.090, 0.006, 0.014));
  EXPECT_EQ(p.imu.rate_Hz, 1000);
  EXPECT_EQ(p.imu.gyro_noise_rad_s, 0.01);
  EXPECT_EQ(p.imu.accel_noise_m_s2, 0.15);
  EXPECT_EQ(p.imu.gyro_bias_rad_s, 0.005);
  EXPECT_EQ(p.imu.accel_bias_m_s2, 0.05);
  EXPECT_EQ(p.imu.vibration, 1.0);
}
TEST(PlantFile, TheAirframeGetsBellAndBladeInertiaAndTheEffects) {
  const AirframeConfig c = airframe_config(reference(), {4.4e-6, 4.4e-6, 4.4e-6, 5.0e-6});
  EXPECT_NEAR(c.rotors[0].spin_inertia_kg_m2, 9.4e-6, 1e-12);
  EXPECT_NEAR(c.rotors[3].spin_inertia_kg_m2, 10.0e-6, 1e-12);
  EXPECT_EQ(c.rotors[2].spin, -1);
  EXPECT_EQ(c.mass_kg, 0.682);
  EXPECT_EQ(c.density_kg_m3, 1.2);
  const EffectSet effects = effect_set(reference());
  EXPECT_TRUE(effects.has("rotor_inertia_reaction") && effects.has("gyroscopic") && effects.has("rotor_body_interference"));
  EXPECT_FALSE(effects.has("blockage_strut"));
  EXPECT_NO_THROW(Airframe(c, AirframeState{}));
}
TEST(PlantFile, ProductsOfInertiaAndTiltReachTheirPlaces) {
  std::string text = test::shipped("reference_plant.toml");
  text.replace(text.find("5.22e-3, 0.0, 0.0, 0.0]"), 23, "5.22e-3, 1e-4, 2e-4, 3e-4]");
  text.replace(text.find("tilt_deg = [0.0, 0.0]"), 21, "tilt_deg = [180e-1, -9]");
  const PlantFile p = read_plant(TomlFile::parse(text, std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/p.toml"));
  EXPECT_EQ(p.body.inertia_kg_m2(0, 1), 1e-4);
  EXPECT_EQ(p.body.inertia_kg_m2(2, 0), 2e-4);
  EXPECT_EQ(p.body.inertia_kg_m2(1, 2), 3e-4);
  EXPECT_NEAR(p.rotors[0].tilt_rad.x(), 0.314159265, 1e-9);
  EXPECT_NEAR(p.rotors[0].tilt_rad.y(), -0.157079633, 1e-9);
}

TEST(PlantFileErrors, MassInGrams) {
  EXPECT_THAT(message("mass_kg = 0.682", "mass_kg = 682"),
              AllOf(HasSubstr("body.mass_kg = 682 kg is outside 0.01 to 100 kg"), HasSubstr("do:     give mass_kg in kg")));
}
TEST(PlantFileErrors, MassMissing) {
  EXPECT_THAT(message("mass_kg = 0.682\n", "", "[body]"), HasSubstr("key \"body.mass_kg\" is missing"));
}
TEST(PlantFileErrors, MassNotANumber) { EXPECT_THAT(message("mass_kg = 0.682", "mass_kg = nan"), HasSubstr("is outside 0.01 to 100 kg")); }
TEST(PlantFileErrors, InertiaOfNoBody) {
  EXPECT_THAT(message("[2.41e-3, 3.42e-3, 5.22e-3,", "[2.41e-3, 3.42e-3, 5.22e-2,"),
              AllOf(HasSubstr("has the principal moments 0.00241, 0.00342, 0.0522 kg m^2, which no body has"),
                    HasSubstr("at most the sum of the other two")));
}
TEST(PlantFileErrors, InertiaNotPositive) {
  EXPECT_THAT(message("5.22e-3, 0.0, 0.0, 0.0]", "5.22e-3, 4e-3, 0.0, 0.0]"), HasSubstr("which no body has"));
}
TEST(PlantFileErrors, InertiaInGramSquareCentimetres) {
  EXPECT_THAT(message("[2.41e-3, 3.42e-3, 5.22e-3,", "[2.41e-9, 3.42e-9, 5.22e-9,"),
              AllOf(HasSubstr("is a radius of gyration of 8.75e-05 m, credible is 0.001 to 10 m"),
                    HasSubstr("likely: inertia or mass in another unit")));
}
TEST(PlantFileErrors, FiveInertias) {
  EXPECT_THAT(message("5.22e-3, 0.0, 0.0, 0.0]", "5.22e-3, 0.0, 0.0]"), HasSubstr("body.inertia_kg_m2 has 5 values, expected 6"));
}
TEST(PlantFileErrors, NegativeDragArea) {
  EXPECT_THAT(message("z_N_s2_m2 = 0.0185", "z_N_s2_m2 = -0.0185"),
              HasSubstr("body.drag_area.z_N_s2_m2 = -0.0185 N s^2/m^2 is outside 0 to 10 N s^2/m^2"));
}
TEST(PlantFileErrors, RotorOrderOfAnotherAutopilot) {
  EXPECT_THAT(message("position_m = [0.0885, -0.0885, 0.02]", "position_m = [0.0885, 0.0885, 0.02]"),
              AllOf(HasSubstr("rotor[1].position_m = [0.0885, 0.0885, 0.02] m is not front-right"),
                    HasSubstr("do:     order the rotors 1 front-right, 2 rear-left, 3 front-left, 4 rear-right")));
}
TEST(PlantFileErrors, SpinReversed) {
  EXPECT_THAT(message("spin = -1", "spin = 1 ", "spin = 1 \n"),
              AllOf(HasSubstr("rotor[3].spin = 1, expected -1 for front-left"),
                    HasSubstr("rotors 1 and 2 turn counter-clockwise seen from above (1)")));
}
TEST(PlantFileErrors, SpinZero) { EXPECT_THAT(message("spin = -1", "spin = 0 "), HasSubstr("rotor[3].spin = 0, expected -1")); }
TEST(PlantFileErrors, MotorFileMissing) {
  EXPECT_THAT(message("motors/2306_2300kv.toml", "motors/2307.toml"),
              AllOf(HasSubstr("rotor[1].motor = \"motors/2307.toml\": no such file"), HasSubstr("relative to the folder of this file")));
}
TEST(PlantFileErrors, ChargeInPercent) {
  EXPECT_THAT(message("state_of_charge = 0.9", "state_of_charge = 90"), HasSubstr("battery.state_of_charge = 90 is outside 0 to 1"));
}
TEST(PlantFileErrors, NoCells) { EXPECT_THAT(message("cells = 4", "cells = 0"), HasSubstr("battery.cells = 0 is outside 1 to 14")); }
TEST(PlantFileErrors, DensityInGramsPerLitreTimesThousand) {
  EXPECT_THAT(message("density_kg_m3 = 1.2", "density_kg_m3 = 1200"),
              HasSubstr("air.density_kg_m3 = 1200 kg/m^3 is outside 0.01 to 5 kg/m^3"));
}
TEST(PlantFileErrors, JitterBeyondLatency) {
  EXPECT_THAT(message("jitter_s = 0.003", "jitter_s = 0.03"),
              AllOf(HasSubstr("jitter_s = 0.03 s is larger than latency_s = 0.015 s"), HasSubstr("would arrive before it was measured")));
}
TEST(PlantFileErrors, MorePosesUnderWayThanTheQueueHolds) {
  EXPECT_THAT(message("latency_s = 0.015", "latency_s = 0.9"), HasSubstr("has 181 readings under way, possible are 62"));
}
TEST(PlantFileErrors, QuaternionNotOfUnitLength) {
  EXPECT_THAT(message("quaternion_wxyz = [1, 0, 0, 0]", "quaternion_wxyz = [1, 0, 0, 0.5]"),
              AllOf(HasSubstr("has the length 1.1180, expected 1 within 0.001"), HasSubstr("normalise it")));
}
TEST(PlantFileErrors, UnknownEffectListsTheKnownOnes) {
  EXPECT_THAT(message("id = \"gyroscopic\"", "id = \"gyroscopics\""),
              AllOf(HasSubstr("effect \"gyroscopics\" is not known"), HasSubstr("use one of: "),
                    HasSubstr(", rotor_inertia_reaction, gyroscopic")));
}
TEST(PlantFileErrors, EffectParameterOutOfRange) {
  EXPECT_THAT(message("k_H = 1.56", "k_H = 0.5"), HasSubstr("k_H = 0.5 is outside 1 to 4"));
}
TEST(PlantFileErrors, EffectParameterMissing) {
  EXPECT_THAT(message("id = \"gyroscopic\"", "id = \"blockage_strut\"", "[[effect]]\nid = \"blockage_strut\""),
              HasSubstr(".loss\" is missing"));
}
TEST(PlantFileErrors, InertiaOfARotorIsNotASecondTime) {
  EXPECT_THAT(message("id = \"gyroscopic\"", "id = \"gyroscopic\"\nJ_r_kg_m2 = 9.4e-6", "J_r_kg_m2 = 9.4e-6"),
              AllOf(HasSubstr("effect \"gyroscopic\" takes J_r_kg_m2 from the rotor"), HasSubstr("blade_inertia_kg_m2 of the blade file")));
}
TEST(PlantFileErrors, EffectTwice) {
  EXPECT_THAT(message("id = \"gyroscopic\"", "id = \"rotor_inertia_reaction\" ", "id = \"rotor_inertia_reaction\" "),
              HasSubstr("effect \"rotor_inertia_reaction\" is switched on twice"));
}
TEST(PlantFileErrors, MisspeltKey) {
  EXPECT_THAT(message("capacity_Ah = 1.5", "capacity_Ah = 1.5\ncapcity = 1", "capcity = 1"), HasSubstr("unknown key \"battery.capcity\""));
}
TEST(PlantFileErrors, ThreeRotors) {
  std::string text = test::shipped("reference_plant.toml");
  text.erase(text.find("[[rotor]]"), text.find("[[rotor]]", text.find("[[rotor]]") + 1) - text.find("[[rotor]]"));
  try {
    (void)read_plant(TomlFile::parse(text, "p.toml"));
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("[[rotor]] occurs 3 times, expected 4"));
  }
}
TEST(PlantFileErrors, FormatOfAnotherVersion) {
  EXPECT_THAT(message("format = 1", "format = 2"), HasSubstr("format = 2 is not known here; known: 1"));
}

}  // namespace
}  // namespace rotorloop::sim
