// What a blade or polar file may say, and what its author reads when it is wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "host/base/error.hpp"
#include "test/unit/sim/rotor/fixtures.hpp"

namespace rotorloop::sim {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

const char* const kBladePath = ROTORLOOP_SOURCE_DIR "/vehicles/blades/mine.toml";  // beside the shipped polars

std::string message(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    return e.what();
  }
  return "(no error)";
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
const std::string kBlade = R"(format = 1
blades = 3
radius_m = 0.06
hub_radius_m = 0.006
blade_inertia_kg_m2 = 4e-6
station = [
  { r_m = 0.01, chord_m = 0.010, twist_deg = 30.0, polar = "naca4412" },
  { r_m = 0.02, chord_m = 0.012, twist_deg = 28.0, polar = "naca4412" },
  { r_m = 0.03, chord_m = 0.012, twist_deg = 24.0, polar = "naca4412" },
  { r_m = 0.05, chord_m = 0.010, twist_deg = 18.0, polar = "naca4412" },
  { r_m = 0.06, chord_m = 0.005, twist_deg = 14.0, polar = "naca4412" },
]
)";
std::string blade_message(const std::string& from, const std::string& to) {
  return message([&] { parse_blade(replaced(kBlade, from, to), kBladePath); });
}

TEST(BladeFile, ShippedTriBladeIsReadWithThreeBladesAnd127MillimetreDiameter) {
  const Blade& b = test::triblade();
  EXPECT_EQ(b.blades, 3);
  EXPECT_DOUBLE_EQ(2 * b.radius_m, 0.127);
  EXPECT_DOUBLE_EQ(b.stall_delay, kSnelFactor);
  EXPECT_GE(b.stations.size(), kMinStations);
  EXPECT_EQ(b.polars.size(), 1u);
}
TEST(BladeFile, LiftScalePitchOffsetAndDragOfDelayedStallAreNeutralUnlessGiven) {
  const Blade plain = parse_blade(kBlade, kBladePath);
  EXPECT_EQ(plain.lift_scale, 1.0);
  EXPECT_EQ(plain.pitch_offset_deg, 0.0);
  EXPECT_EQ(plain.stall_drag, 0.0);
  const Blade given = parse_blade("lift_scale = 0.9\npitch_offset_deg = -1.5\nstall_drag = 1.0\n" + kBlade, kBladePath);
  EXPECT_EQ(given.lift_scale, 0.9);
  EXPECT_EQ(given.pitch_offset_deg, -1.5);
  EXPECT_EQ(given.stall_drag, 1.0);
}
TEST(BladeFile, LiftScalePitchOffsetAndDragOfDelayedStallHaveRanges) {
  EXPECT_THAT(blade_message("blades = 3", "blades = 3\nlift_scale = 9"), HasSubstr("lift_scale = 9 is outside 0.5 to 1.5"));
  EXPECT_THAT(blade_message("blades = 3", "blades = 3\npitch_offset_deg = 25"),
              HasSubstr("pitch_offset_deg = 25 deg is outside -10 to 10 deg"));
  EXPECT_THAT(blade_message("blades = 3", "blades = 3\nstall_drag = 2"), HasSubstr("stall_drag = 2 is outside 0 to 1"));
}
TEST(Blade, PitchOffsetTurnsEveryStationLikeAnotherTwist) {
  Blade offset = parse_blade(kBlade, kBladePath), turned = offset;
  offset.pitch_offset_deg = 2.0;
  for (BladeStation& s : turned.stations) s.twist_deg += 2.0;
  const RotorCondition c = test::at(0, 0, 2.0, 900.0);
  const RotorLoads a = test::solve_cold(Rotor(offset), c), b = test::solve_cold(Rotor(turned), c);
  EXPECT_NEAR(a.force_R_N.z(), b.force_R_N.z(), 1e-9);
  EXPECT_NEAR(a.shaft_torque_N_m, b.shaft_torque_N_m, 1e-11);
}
TEST(BladeFile, StallDelayCanBeSwitchedOffAndDragScaled) {
  EXPECT_EQ(parse_blade("drag_scale = 1.4\n" + kBlade, kBladePath).drag_scale, 1.4);
  EXPECT_EQ(parse_blade("stall_delay = 0.0\n" + kBlade, kBladePath).stall_delay, 0.0);
}
TEST(BladeFile, RadiusInInchesIsRefusedWithItsRange) {
  EXPECT_THAT(blade_message("radius_m = 0.06\n", "radius_m = 2.5\n"),
              AllOf(HasSubstr("mine.toml:3"), HasSubstr("radius_m = 2.5 m is outside 0.01 to 2 m")));
}
TEST(BladeFile, StationsOutOfOrderNameBothRadii) {
  EXPECT_THAT(blade_message("r_m = 0.03", "r_m = 0.02"),
              AllOf(HasSubstr("mine.toml:9"), HasSubstr("r_m = 0.02 m does not exceed that of the station before, 0.02 m"),
                    HasSubstr("order the stations")));
}
TEST(BladeFile, StationBeyondTheTipSuspectsAMixOfDiameterAndRadius) {
  EXPECT_THAT(blade_message("r_m = 0.06,", "r_m = 0.12,"),
              AllOf(HasSubstr("r_m = 0.12 m lies outside radius_m = 0.06 m"), HasSubstr("diameter and radius mixed up")));
}
TEST(BladeFile, StationsThatStopShortOfTheTipAreRefused) {
  EXPECT_THAT(blade_message("r_m = 0.06,", "r_m = 0.055,"),
              AllOf(HasSubstr("the last station is at 0.055 m, expected at least 0.95"), HasSubstr("add a station at the tip")));
}
TEST(BladeFile, StationsThatStartFarOutAreRefused) {
  EXPECT_THAT(blade_message("r_m = 0.01,", "r_m = 0.019,"), HasSubstr("the first station is at 0.019 m, expected at most 0.3 of radius_m"));
}
TEST(BladeFile, FourStationsAreTooFew) {
  EXPECT_THAT(blade_message("  { r_m = 0.03, chord_m = 0.012, twist_deg = 24.0, polar = \"naca4412\" },\n", ""),
              HasSubstr("occurs 4 times, expected 5 to 200"));
}
TEST(BladeFile, ChordPerRadiusIsRecognised) {
  EXPECT_THAT(blade_message("chord_m = 0.010, twist_deg = 30.0", "chord_m = 0.17, twist_deg = 30.0"),
              AllOf(HasSubstr("chord_m = 0.17 m"), HasSubstr("chord given per radius")));
}
TEST(BladeFile, HubLargerThanHalfTheRadiusIsRefused) {
  EXPECT_THAT(blade_message("hub_radius_m = 0.006", "hub_radius_m = 0.04"),
              HasSubstr("hub_radius_m = 0.04 m is not below half of radius_m"));
}
TEST(BladeFile, NotANumberIsRefused) {
  EXPECT_THAT(blade_message("twist_deg = 30.0", "twist_deg = nan"), HasSubstr("twist_deg = nan deg is outside -30 to 80 deg"));
}
TEST(BladeFile, UnknownKeyIsRefused) {
  EXPECT_THAT(blade_message("blades = 3", "blades = 3\npitch_in = 4.3"), HasSubstr("unknown key \"pitch_in\""));
}
TEST(BladeFile, MissingPolarNamesTheFileItLookedFor) {
  EXPECT_THAT(blade_message("\"naca4412\" },\n]", "\"nasa4412\" },\n]"),
              AllOf(HasSubstr("mine.toml:11"), HasSubstr("polar \"nasa4412\" not found: no file"),
                    HasSubstr("vehicles/polars/nasa4412.toml"), HasSubstr("misspelt")));
}
TEST(BladeFile, PolarGivenAsAPathIsRefused) {
  EXPECT_THAT(blade_message("\"naca4412\" },\n]", "\"../polars/naca4412.toml\" },\n]"), HasSubstr("is not a plain name"));
}

// A polar of a flat plate, cl = sin 2a, on a 10 degree grid.
std::string polar_text(const std::string& first = "-180.0", const std::string& reynolds_2 = "60000", const std::string& cl_last = "0.0") {
  std::string alpha = "alpha_deg = [" + first, cl = "cl = [0.0", cd = "cd = [0.1";
  for (int a = -170; a <= 180; a += 10) {
    alpha += ", " + std::to_string(a) + ".0";
    cl += a == 180 ? ", " + cl_last : ", " + std::to_string(std::sin(2 * a * std::numbers::pi / 180));
    cd += ", 0.1";
  }
  const std::string table = cl + "]\n" + cd + "]\n";
  return "format = 1\nsource = \"plate\"\n" + alpha + "]\n[[table]]\nreynolds = 30000\n" + table + "[[table]]\nreynolds = " + reynolds_2 +
         "\n" + table;
}
TEST(PolarFile, FullCircleAtTwoReynoldsNumbersIsRead) {
  const Polar p = parse_polar(polar_text(), "plate.toml");
  EXPECT_EQ(p.alpha_deg.size(), 37u);
  EXPECT_EQ(p.tables.size(), 2u);
}
TEST(PolarFile, AttachedBranchAloneIsRefusedAndPointsToTheExtension) {
  EXPECT_THAT(message([] { parse_polar(polar_text("-175.0"), "plate.toml"); }),
              AllOf(HasSubstr("plate.toml:3"), HasSubstr("alpha_deg runs from -175 to 180 deg, expected -180 to 180 deg"),
                    HasSubstr("rotorloop rotor polar")));
}
TEST(PolarFile, UnsortedAnglesAreRefused) {
  EXPECT_THAT(message([] { parse_polar(replaced(polar_text(), "-170.0", "-155.0"), "plate.toml"); }),
              HasSubstr("alpha_deg[3] = -160 deg does not exceed its predecessor -155 deg"));
}
TEST(PolarFile, ReynoldsNumbersMustRise) {
  EXPECT_THAT(message([] { parse_polar(polar_text("-180.0", "30000"), "plate.toml"); }),
              HasSubstr("reynolds = 30000 does not exceed that of the table before, 30000"));
}
TEST(PolarFile, TheTwoEndsOfTheCircleMustAgree) {
  EXPECT_THAT(message([] { parse_polar(polar_text("-180.0", "60000", "0.4"), "plate.toml"); }),
              HasSubstr("cl is 0 at -180 deg and 0.4 at 180 deg"));
}
TEST(PolarFile, ColumnOfOtherLengthIsRefused) {
  EXPECT_THAT(message([] { parse_polar(replaced(polar_text(), "cd = [0.1, 0.1", "cd = [0.1"), "plate.toml"); }),
              HasSubstr("cd has 36 values, expected 37"));
}
TEST(PolarFile, NegativeDragIsRefused) {
  EXPECT_THAT(message([] { parse_polar(replaced(polar_text(), "cd = [0.1", "cd = [-0.1"), "plate.toml"); }),
              HasSubstr("is outside 0 to 4"));
}
TEST(PolarFile, TooFewAnglesAreRefused) {
  EXPECT_THAT(message([] { parse_polar("format = 1\nsource = \"x\"\nalpha_deg = [-180.0, 0.0, 180.0]\n", "plate.toml"); }),
              HasSubstr("alpha_deg has 3 angles, at least 37 are needed"));
}

TEST(RotorResolution, OutOfRangeIsRefusedWithARemedy) {
  EXPECT_THAT(message([] {
                Rotor(test::triblade(), {12, 18});
              }),
              AllOf(HasSubstr("azimuth = 18"), HasSubstr("multiple of 4"), HasSubstr("use 16")));
  EXPECT_THAT(message([] { Rotor(test::triblade(), {2, 16}); }), HasSubstr("radial = 2 is outside 4 to 64 nodes"));
  EXPECT_THAT(message([] { Rotor(test::triblade(), {12, 16, 0}); }), HasSubstr("max_iterations = 0 is below 1"));
}

}  // namespace
}  // namespace rotorloop::sim
