// The vehicle file: the shipped one means the paper's quadrotor, writing and reading are inverse, and whatever cannot be a
// vehicle is refused with a text that leads to the mistake.
#include "host/vehicle/vehicle_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "host/base/error.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::host {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const EffectCatalogue kEffects{{{.id = "rotor_drag"}, {.id = "rotor_inertia_reaction", .model = {{"J_r_kg_m2", "kg m^2", 0.0, 1e-4}}}}};
const std::filesystem::path kPaperFile = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/paper.toml";

std::string paper_text() {
  std::ifstream in(kPaperFile);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string with(const std::string& from, const std::string& to) {
  std::string text = paper_text();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string refusal(const std::string& text) {
  try {
    parse_vehicle(text, "quad.toml", kEffects);
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    return e.what();
  }
  return "accepted";
}

TEST(PaperVehicle, HoversAtAbout8950RpmWithFigureOfMerit0p48) {
  const VehicleModel m = to_model(read_vehicle(kPaperFile, kEffects));
  EXPECT_NEAR(hover_omega_rad_s(m) * 60.0 / (2.0 * std::numbers::pi), 8950.0, 25.0);
  EXPECT_NEAR(figure_of_merit(m.thrust, m.c_q_N_m_s2), 0.48, 0.005);
  EXPECT_NEAR(static_c_t(m.thrust), 1.897e-6, 0.002e-6);
}

TEST(PaperVehicle, StandThrustIsEightPercentAboveFlight) {
  const VehicleFile v = read_vehicle(kPaperFile, kEffects);
  ASSERT_NE(v.static_thrust_of(Origin::stand), nullptr);
  EXPECT_NEAR(v.static_thrust_of(Origin::stand)->c_t_N_s2 / static_c_t(to_model(v).thrust), 1.08, 0.001);
  EXPECT_NEAR(v.static_thrust_of(Origin::flight)->c_t_N_s2, static_c_t(to_model(v).thrust), 1e-9);
}

TEST(PaperVehicle, TableIPerRpmIsKeptInSi) {
  const VehicleFile v = read_vehicle(kPaperFile, kEffects);
  constexpr double kPerRpm = 60.0 / (2.0 * std::numbers::pi);
  EXPECT_NEAR(v.k1_N_s2.value, 3.42e-8 * kPerRpm * kPerRpm, 1e-9);
  EXPECT_NEAR(v.k2_N_s2_m.value, -1.62e-5 * kPerRpm, 1e-7);
  EXPECT_NEAR(v.c_q_N_m_s2.value, 3.40e-10 * kPerRpm * kPerRpm, 1e-10);
  EXPECT_EQ(v.inertia_kg_m2[0].origin, Origin::cad);
  EXPECT_EQ(v.k1_N_s2.origin, Origin::flight);
}

TEST(VehicleFile, WrittenFileReadsBackEqual) {
  VehicleFile v = read_vehicle(kPaperFile, kEffects);
  v.name = "with \"quotes\", a \\ and a\ttab";
  v.covariance.push_back({{"thrust_model.k1", "thrust_model.k2"},
                          {v.k1_N_s2.u * v.k1_N_s2.u, -0.95 * v.k1_N_s2.u * v.k2_N_s2_m.u, -0.95 * v.k1_N_s2.u * v.k2_N_s2_m.u,
                           v.k2_N_s2_m.u * v.k2_N_s2_m.u}});
  v.effects.push_back(
      {"rotor_inertia_reaction", {{"J_r_kg_m2", {9.4e-6, 5e-7, Origin::flight}}}, EffectEvidence{0.819, 0.374, "rad/s", "run 12"}});
  v.inputs = {"sha256:0123"};
  v.ceiling_z_m = 2.7;
  const VehicleFile back = parse_vehicle(vehicle_text(v), "written.toml", kEffects);
  EXPECT_TRUE(back == v);
  EXPECT_EQ(vehicle_text(back), vehicle_text(v));
}

TEST(VehicleFile, TorqueThatGoesWithTheAdvanceRatioIsFormat2AndReadsBackEqual) {
  VehicleFile v = read_vehicle(kPaperFile, kEffects);
  EXPECT_THAT(vehicle_text(v), HasSubstr("format = 1\n"));
  v.advance = TorqueAdvanceFit{{-2e-8, 3e-9, Origin::stand}, {-0.1, 0.8}};
  EXPECT_THAT(vehicle_text(v), HasSubstr("format = 2\n"));
  const VehicleFile again = parse_vehicle(vehicle_text(v), "again.toml", kEffects);
  EXPECT_EQ(again, v);
  EXPECT_EQ(to_model(again).advance.c_q2_N_m_s2, -2e-8);
  EXPECT_EQ(to_model(again).advance.j_high, 0.8);
  EXPECT_EQ(uncertainty_of(again, "torque_model.c_q2"), 3e-9);
}

TEST(VehicleFileRefuses, TorqueOfTheAdvanceRatioInAFileThatOlderProgramsRead) {
  const std::string advance = "c_q2_N_m_s2 = { value = -2e-8, u = 3e-9, origin = \"stand\" }\nj_range = [0.0, 0.8]\n";
  EXPECT_THAT(refusal(with("[torque_model]\n", "[torque_model]\n" + advance)),
              AllOf(HasSubstr("c_q(J) in a file of format 1"), HasSubstr("set format = 2")));
}

TEST(VehicleFileRefuses, TorqueThatTurnsTheRotorWithinTheRangeOfAdvanceRatios) {
  VehicleFile v = read_vehicle(kPaperFile, kEffects);
  v.advance = TorqueAdvanceFit{{-5e-8, 3e-9, Origin::stand}, {0.0, 0.9}};  // 3.1e-8 - 5e-8 * 0.81
  EXPECT_THAT(refusal(vehicle_text(v)), AllOf(HasSubstr("must stay above 0"), HasSubstr("end j_range")));
}

TEST(VehicleFile, WithoutARoomNoCeilingIsKnownAndWithOneItIsWhereTheFileSays) {
  VehicleFile v = read_vehicle(kPaperFile, kEffects);
  EXPECT_TRUE(std::isinf(to_model(v).ceiling_z_m));
  v.ceiling_z_m = 2.7;
  EXPECT_EQ(to_model(parse_vehicle(vehicle_text(v), "written.toml", kEffects)).ceiling_z_m, 2.7);
}

TEST(VehicleFile, WriteReplacesTheFileAndLeavesNoPart) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "rotorloop_vehicle_file";
  std::filesystem::create_directories(folder);
  VehicleFile v = read_vehicle(kPaperFile, kEffects);
  write_vehicle(folder / "v.toml", v);
  v.mass_kg.value = 0.7;
  write_vehicle(folder / "v.toml", v);
  EXPECT_EQ(read_vehicle(folder / "v.toml", kEffects).mass_kg.value, 0.7);
  EXPECT_FALSE(std::filesystem::exists(folder / "v.toml.part"));
  std::filesystem::remove_all(folder);
  EXPECT_THROW(write_vehicle(folder / "none/v.toml", v), Error);
}

TEST(VehicleFile, CompleteExampleOfTheContractIsAccepted) {
  // The paper's file with inline tables, a covariance block and an effect, as other tools write it.
  const std::string text =
      with("[provenance]",
           "[[covariance]]\nof = [\"thrust_model.k1\", \"thrust_model.k2\"]\n"
           "matrix = [2.69e-14, -2.976e-12, -2.976e-12, 3.648e-10]\n"
           "[[effect]]\nid = \"rotor_inertia_reaction\"\n"
           "parameter = { J_r_kg_m2 = { value = 9.4e-6, u = 5e-7, origin = \"flight\" } }\n"
           "evidence = { held_out_before = 0.819, held_out_after = 0.374, unit = \"rad/s at 0.5 s\", run = \"hash\" }\n"
           "[provenance]");
  const VehicleFile v = parse_vehicle(text, "quad.toml", kEffects);
  ASSERT_EQ(v.effects.size(), 1u);
  EXPECT_EQ(v.effects[0].parameters[0].quantity.value, 9.4e-6);
  EXPECT_EQ(v.effects[0].evidence->held_out_after, 0.374);
  EXPECT_EQ(*uncertainty_of(v, "effect.rotor_inertia_reaction.J_r_kg_m2"), 5e-7);
  EXPECT_FALSE(uncertainty_of(v, "thrust_model.k3").has_value());
  EXPECT_EQ(*origin_of(v, "effect.rotor_inertia_reaction.J_r_kg_m2"), Origin::flight);
  EXPECT_FALSE(origin_of(v, "thrust_model.k3").has_value());
}

TEST(VehicleFileRefuses, TableIEnteredPerRpmAndSaysWhatToMultiply) {
  std::string text = with("value = 3.119e-6", "value = 3.42e-8");
  text.replace(text.find("value = -1.547e-4"), 17, "value = -1.62e-5");
  text.replace(text.find("value = 3.10e-8"), 15, "value = 3.40e-10");
  EXPECT_THAT(refusal(text), AllOf(HasSubstr("quad.toml:"), HasSubstr("figure of merit 0.05, credible is 0.3 to 0.85"),
                                   HasSubstr("likely: the values are per RPM (that reading gives 0.48)"),
                                   HasSubstr("do:     multiply k1 and c_q by 91.2 and k2 by 9.55")));
}

TEST(VehicleFileRefuses, RadiusOfAnotherPropeller) {
  EXPECT_THAT(refusal(with("radius_m = 0.0635", "radius_m = 0.3")),
              AllOf(HasSubstr("figure of merit"), HasSubstr("radius, air density or c_q does not belong to this propeller")));
}

TEST(VehicleFileRefuses, MassInGrams) {
  EXPECT_THAT(refusal(with("value = 0.682", "value = 682")), AllOf(HasSubstr("body.mass_kg.value = 682 kg is outside 0.02 to 20 kg")));
}

TEST(VehicleFileRefuses, HoverOutsideTheFittedSpeeds) {
  EXPECT_THAT(
      refusal(with("value = 0.682", "value = 3.0")),
      AllOf(HasSubstr("hover needs 18803 RPM, outside thrust_model.rpm_window = 5000 to 15000 RPM"), HasSubstr("correct body.mass_kg")));
}

TEST(VehicleFileRefuses, QuantityWithoutOrigin) {
  EXPECT_THAT(refusal(with("{ value = 0.682, u = 0.001, origin = \"cad\" }", "{ value = 0.682, u = 0.001 }")),
              HasSubstr("key \"body.mass_kg.origin\" is missing"));
}

TEST(VehicleFileRefuses, PlainNumberWhereAQuantityBelongs) {
  EXPECT_THAT(refusal(with("{ value = 0.682, u = 0.001, origin = \"cad\" }", "0.682")),
              HasSubstr("body.mass_kg = 0.682 is a number, expected a table"));
}

TEST(VehicleFileRefuses, UnknownOrigin) {
  EXPECT_THAT(refusal(with("u = 0.001, origin = \"cad\"", "u = 0.001, origin = \"scale\"")),
              AllOf(HasSubstr("origin = \"scale\" is not known"), HasSubstr("use one of: cad, stand, flight, guess")));
}

TEST(VehicleFileRefuses, NegativeUncertainty) {
  EXPECT_THAT(refusal(with("u = 0.001, origin", "u = -0.001, origin")), HasSubstr("body.mass_kg.u = -0.001 kg is outside 0 to 20 kg"));
}

TEST(VehicleFileRefuses, EffectOutsideTheCatalogue) {
  EXPECT_THAT(refusal(paper_text() + "\n[[effect]]\nid = \"warp\"\nparameter = { }\n"),
              AllOf(HasSubstr("effect \"warp\" is not in the catalogue"), HasSubstr("use one of: rotor_drag, rotor_inertia_reaction")));
}

TEST(VehicleFileRefuses, EffectParameterThatTheCatalogueDoesNotHaveOrOutOfItsRange) {
  const auto effect = [](const std::string& parameter) {
    return refusal(paper_text() + "\n[[effect]]\nid = \"rotor_inertia_reaction\"\nparameter = { " + parameter + " }\n");
  };
  EXPECT_THAT(effect("J_kg_m2 = { value = 9.4e-6, u = 0, origin = \"flight\" }"),
              AllOf(HasSubstr("effect \"rotor_inertia_reaction\" has no parameter \"J_kg_m2\""),
                    HasSubstr("its parameter is J_r_kg_m2, in kg m^2")));
  EXPECT_THAT(effect("J_r_kg_m2 = { value = 9.4e-3, u = 0, origin = \"flight\" }"),
              HasSubstr("value = 0.0094 kg m^2 is outside 0 to 0.0001 kg m^2"));
}

TEST(VehicleFileRefuses, SuctionOfACeilingWhoseHeightItDoesNotSay) {
  const std::string text =
      paper_text() + "\n[[effect]]\nid = \"ceiling_effect\"\nparameter.gain = { value = 1, u = 0.1, origin = \"flight\" }\n";
  std::string said;
  try {
    (void)parse_vehicle(text, "v.toml", builtin_effect_catalogue());
  } catch (const Error& e) {
    said = e.what();
  }
  EXPECT_THAT(said, AllOf(HasSubstr("without the height of the ceiling"), HasSubstr("add [room] with ceiling_z_m")));
  EXPECT_NO_THROW((void)parse_vehicle(text + "[room]\nceiling_z_m = 2.7\n", "v.toml", builtin_effect_catalogue()));
}

TEST(VehicleFileRefuses, RotorsInAnotherOrder) {
  EXPECT_THAT(refusal(with("position_m = [0.0885, -0.0885, 0.0]", "position_m = [0.0885, 0.0885, 0.0]")),
              AllOf(HasSubstr("rotor 1 is at x = 0.0871 m, y = 0.0883 m from the centre of mass, but rotor 1 is the front-right one"),
                    HasSubstr("y taken to the right")));
}

TEST(VehicleFileRefuses, SenseOfRotationGivenAsReaction) {
  EXPECT_THAT(refusal(with("reaction = -1", "reaction = 1")),
              AllOf(HasSubstr("rotor 1 (front-right) has reaction = 1, expected -1"), HasSubstr("the sense of rotation was given")));
}

TEST(VehicleFile, AllFourMotorsTurningTheOtherWayAreAVehicleAndThreeOfThemAreNot) {
  std::string reversed = with("reaction = -1", "reaction = 1");  // the first
  const auto flip = [&](const std::string& from, const std::string& to, std::size_t after) {
    const auto at = reversed.find(from, after);
    reversed.replace(at, from.size(), to);
    return at;
  };
  const std::size_t second = flip("reaction = -1", "reaction = 1", 0), third = flip("reaction = 1\n", "reaction = -1\n", second + 12);
  EXPECT_THAT(refusal(reversed), HasSubstr("reaction"));
  flip("reaction = 1\n", "reaction = -1\n", third + 12);
  const VehicleFile v = parse_vehicle(reversed, "v.toml", kEffects);
  EXPECT_EQ(v.rotors[0].reaction, 1);
  EXPECT_EQ(v.rotors[3].reaction, -1);
}

TEST(VehicleFileRefuses, ThreeRotors) {
  EXPECT_THAT(refusal(with("[[rotor]] # rear-right\nposition_m = [-0.0885, -0.0885, 0.0]\nreaction = 1\n", "")),
              HasSubstr("[[rotor]] occurs 3 times, expected 4"));
}

TEST(VehicleFileRefuses, InertiasOfNoRigidBody) {
  EXPECT_THAT(refusal(with("value = 5.22e-3", "value = 5.22e-2")),
              AllOf(HasSubstr("the largest exceeds the sum of the others"), HasSubstr("no rigid body")));
}

TEST(VehicleFileRefuses, QuaternionThatIsNone) {
  EXPECT_THAT(refusal(with("[0.9975, -0.0241, -0.0122, 0.0646]", "[0.9, -0.0241, -0.0122, 0.0646]")),
              HasSubstr("quaternion_wxyz has norm 0.903"));
}

TEST(VehicleFileRefuses, EmptySpeedWindow) {
  EXPECT_THAT(refusal(with("rpm_window = [5000, 15000]", "rpm_window = [15000, 5000]")),
              AllOf(HasSubstr("thrust_model.rpm_window = 15000 to 5000 RPM is empty"), HasSubstr("ends swapped")));
}

TEST(VehicleFileRefuses, UnknownKey) {
  EXPECT_THAT(refusal(with("radius_m = 0.0635", "radius_m = 0.0635\ndiameter_m = 0.127")),
              HasSubstr("unknown key \"thrust_model.diameter_m\""));
}

TEST(VehicleFileRefuses, FormatOfAnotherVersion) {
  EXPECT_THAT(refusal(with("format = 1", "format = 3")), HasSubstr("format = 3 is not known here; known: 1, 2"));
}

std::string covariance(const std::string& of, const std::string& matrix) {
  return refusal(paper_text() + "\n[[covariance]]\nof = [" + of + "]\nmatrix = [" + matrix + "]\n");
}

TEST(VehicleFileRefuses, CovarianceThatContradictsItself) {
  const std::string k1k2 = "\"thrust_model.k1\", \"thrust_model.k2\"";
  EXPECT_THAT(covariance(k1k2, "2.69e-14, -2.9e-12, 3.648e-10"), HasSubstr("covariance of 2 quantities has 3 numbers, expected 4"));
  EXPECT_THAT(covariance("\"k1\"", "2.69e-14"), AllOf(HasSubstr("covariance names \"k1\""), HasSubstr("thrust_model.k1")));
  EXPECT_THAT(covariance(k1k2, "1.64e-7, -2.9e-12, -2.9e-12, 1.91e-5"),
              AllOf(HasSubstr("gives thrust_model.k1 a standard uncertainty of 0.000405, but its u is 1.64e-07"),
                    HasSubstr("put u² on the diagonal")));
  EXPECT_THAT(covariance(k1k2, "2.69e-14, -2.9e-12, -2.0e-12, 3.648e-10"), HasSubstr("not symmetric"));
  EXPECT_THAT(covariance(k1k2, "2.69e-14, -4.0e-12, -4.0e-12, 3.648e-10"), HasSubstr("not positive semi-definite"));
}

TEST(EffectCatalogue, TakesTheIdsAndRefusesDuplicates) {
  const auto path = std::filesystem::path(testing::TempDir()) / "rotorloop_effects.toml";
  std::ofstream(path) << "[[effect]]\nid = \"a\"\nparameter = \"k_N\"\nunit = \"N\"\nrange = [0.0, 2.0]\n[[effect]]\nid = \"b\"\n";
  const EffectCatalogue two = read_effect_catalogue(path);
  ASSERT_EQ(two.effects.size(), 2u);
  ASSERT_NE(two.find("a"), nullptr);
  EXPECT_EQ(two.find("a")->parameter.max, 2.0);
  EXPECT_EQ(two.find("a")->model.size(), 1u) << "what a vehicle file holds is the one parameter where no model is given";
  EXPECT_TRUE(two.find("b")->model.empty());
  EXPECT_EQ(two.find("c"), nullptr);
  std::ofstream(path) << "[[effect]]\nid = \"a\"\n[[effect]]\nid = \"a\"\n";
  EXPECT_THROW(read_effect_catalogue(path), Error);
  std::filesystem::remove(path);
}

TEST(EffectCatalogue, ShippedCatalogueHoldsTheReactionOfTheRotors) {
  EXPECT_EQ(effect("rotor_inertia_reaction").parameter.name, "J_r_kg_m2");
  EXPECT_THROW((void)effect("phlogiston"), Error);
  EXPECT_EQ(&builtin_effect_catalogue(), &builtin_effect_catalogue()) << "parsed once";
}

}  // namespace
}  // namespace rotorloop::host
