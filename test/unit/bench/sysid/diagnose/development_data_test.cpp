// Verdicts on development sets of another simulator, from guesses, as a user starts: three of the five flights, half the usual rate.
#include <gtest/gtest.h>

#include <array>

#include "host/base/toml_file.hpp"
#include "test/unit/bench/sysid/diagnose/diagnosed_logs.hpp"

namespace rotorloop::diagnose {
namespace {

using testing::names;

// A set of flights/development, from its weighed mass and guessed inertia; the rest of the file is that of the same airframe, all guesses.
Diagnosis diagnosed_development(const std::string& set, int max_effects) {
  const std::filesystem::path folder = identify::testing::measured_flights() / "development" / set;
  host::VehicleFile vehicle = host::read_vehicle(testing::vehicles() / "undeclared_a.toml", host::builtin_effect_catalogue());
  const log::LogMapping mapping = log::read_log_mapping(testing::vehicles() / "undeclared_a.mapping.toml");
  const TomlFile known = TomlFile::read(folder / "known.toml");
  vehicle.mass_kg.value = known.root().table("body").number("mass_kg", {0.1, 10.0, "kg"});
  const TomlTable guess = known.root().table("inertia_guess");
  const std::array keys{"xx_kg_m2", "yy_kg_m2", "zz_kg_m2"};
  for (std::size_t i = 0; i < 3; ++i) vehicle.inertia_kg_m2[i].value = guess.number(keys[i], {0.0, 1.0, "kg m2"});
  std::vector<identify::FlightToFit> logs;
  for (const char* f : {"vertical", "horizontal", "rotation"})
    logs.push_back({log::read_flight(folder / (std::string(f) + ".csv"), &mapping), identify::FlightRole::any, {}, {}});
  return testing::diagnosed(logs, vehicle, max_effects);
}

// One rotor that gives 5 % less thrust, and a rotor that leans by 30 mrad. The first was unexplained while
// each of four numbers had to stand for itself, the second while a constant torque was its own placebo.
TEST(DevelopmentFlights, ARotorThatGivesFivePerCentLessThrustIsNamedFirst) {
  if (identify::testing::measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  const Diagnosis d = diagnosed_development("d03", 1);
  ASSERT_EQ(d.added.size(), 1u);
  EXPECT_TRUE(names(d.added.front(), "weak_rotor") || names(d.added.front(), "rotor_speed_scale")) << d.added.front().id;
  EXPECT_LE(d.added.front().aliases.size(), 2u);
}
TEST(DevelopmentFlights, ARotorThatLeansBy30MilliradiansIsNamedFirst) {
  if (identify::testing::measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  const Diagnosis d = diagnosed_development("d04", 1);
  ASSERT_EQ(d.added.size(), 1u);
  EXPECT_TRUE(names(d.added.front(), "rotor_tilt")) << d.added.front().id;
  EXPECT_LE(d.added.front().aliases.size(), 2u);
}

}  // namespace
}  // namespace rotorloop::diagnose
