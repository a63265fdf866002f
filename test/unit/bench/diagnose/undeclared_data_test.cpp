// Verdicts on simulated flights of another simulator, whose physics nobody declared: three of the five flights, half the usual rate.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/diagnose/diagnose.hpp"
#include "host/base/toml_file.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "test/unit/bench/identify/measured_flights.hpp"

namespace rotorloop::diagnose {
namespace {

const std::filesystem::path& vehicles() {
  static const std::filesystem::path folder = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/measured";
  return folder;
}

Diagnosis diagnosed(const std::vector<identify::FlightToFit>& logs, const host::VehicleFile& vehicle, int max_effects) {
  DiagnoseOptions o;
  o.identify.grid.rate_Hz = 50.0;
  o.identify.grid.longest_substep_s = 1e-2;
  o.identify.fit.noise = {.rounds = 16, .tolerance = 0.05, .per_flight = true};
  o.identify.fit.max_iterations = 80;
  o.identify.fit.tolerance = 0.02;
  o.identify.fit.threads = 2;
  o.max_effects = max_effects;
  o.placebos = 30;
  return diagnose(logs, vehicle, o).diagnosis;
}

Diagnosis diagnosed(const std::string& set, const std::vector<std::string>& flights, int max_effects) {
  std::vector<identify::FlightToFit> logs;
  for (const std::string& f : flights)
    logs.push_back({identify::testing::read_measured(identify::testing::measured_flights() / set / (f + ".csv")).record, identify::FlightRole::any, {}, {}});
  return diagnosed(logs, host::read_vehicle(vehicles() / (set + ".toml"), host::builtin_effect_catalogue()), max_effects);
}

// A set of flights/development, from its weighed mass and guessed inertia; the rest of the file is that of the same airframe, all guesses.
Diagnosis diagnosed_development(const std::string& set, int max_effects) {
  const std::filesystem::path folder = identify::testing::measured_flights() / "development" / set;
  host::VehicleFile vehicle = host::read_vehicle(vehicles() / "undeclared_a.toml", host::builtin_effect_catalogue());
  const log::LogMapping mapping = log::read_log_mapping(vehicles() / "undeclared_a.mapping.toml");
  const TomlFile known = TomlFile::read(folder / "known.toml");
  vehicle.mass_kg.value = known.root().table("body").number("mass_kg", {0.1, 10.0, "kg"});
  const TomlTable guess = known.root().table("inertia_guess");
  const std::array keys{"xx_kg_m2", "yy_kg_m2", "zz_kg_m2"};
  for (std::size_t i = 0; i < 3; ++i) vehicle.inertia_kg_m2[i].value = guess.number(keys[i], {0.0, 1.0, "kg m2"});
  std::vector<identify::FlightToFit> logs;
  for (const char* f : {"vertical", "horizontal", "rotation"})
    logs.push_back({log::read_flight(folder / (std::string(f) + ".csv"), &mapping), identify::FlightRole::any, {}, {}});
  return diagnosed(logs, vehicle, max_effects);
}

bool names(const AddedEffect& a, const std::string& id) {
  return a.id == id || std::any_of(a.twins.begin(), a.twins.end(), [&](const ClassMember& m) { return m.id == id; });
}

TEST(UndeclaredFlights, MomentThatGrowsWithSpeedIsFound) {
  if (identify::testing::measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  const Diagnosis d = diagnosed("undeclared_a", {"vertical", "horizontal", "rotation"}, 1);
  ASSERT_EQ(d.added.size(), 1u);
  EXPECT_TRUE(names(d.added.front(), "rotor_plane_height") || names(d.added.front(), "hub_moment")) << d.added.front().id;
  EXPECT_GT(d.added.front().evidence.wald, 10.0 * d.rounds.front().placebos.wald);
  EXPECT_LT(d.added.front().evidence.variation, 0.2) << "one size from second to second";
}

TEST(UndeclaredFlights, RotorInertiaIsFoundInBothOfItsActionsWithOneSize) {
  if (identify::testing::measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  const Diagnosis d = diagnosed("undeclared_d", {"horizontal", "rotation"}, 2);
  ASSERT_EQ(d.added.size(), 2u);
  double sum = 0.0;
  for (const AddedEffect& a : d.added) {
    EXPECT_TRUE(a.id == "gyroscopic" || a.id == "rotor_inertia_reaction") << a.id;
    sum += a.parameters.front().value;
  }
  EXPECT_NEAR(d.added[0].parameters.front().value, d.added[1].parameters.front().value, 0.05 * sum);
}

TEST(UndeclaredFlights, NothingIsAddedWhereNothingIsMissing) {
  if (identify::testing::measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  const Diagnosis d = diagnosed("undeclared_c", {"vertical", "horizontal", "rotation"}, 2);
  EXPECT_TRUE(d.added.empty()) << d.added.front().id;
  EXPECT_EQ(d.verdict, DiagnosisVerdict::clean);
  for (const CandidateEvidence& e : d.rounds.back().candidates) EXPECT_FALSE(e.ruled_out_by.empty()) << e.id;
}

// From guesses, as a user starts: one rotor that gives 5 % less thrust, and a rotor that leans by 30 mrad. The first was unexplained while
// each of four numbers had to stand for itself, the second while a constant torque was its own placebo.
TEST(DevelopmentFlights, ARotorThatGivesFivePerCentLessThrustIsNamedFirst) {
  if (identify::testing::measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  const Diagnosis d = diagnosed_development("d03", 1);
  ASSERT_EQ(d.added.size(), 1u);
  EXPECT_TRUE(names(d.added.front(), "weak_rotor") || names(d.added.front(), "rotor_speed_scale")) << d.added.front().id;
  EXPECT_LE(d.added.front().twins.size(), 2u);
}
TEST(DevelopmentFlights, ARotorThatLeansBy30MilliradiansIsNamedFirst) {
  if (identify::testing::measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  const Diagnosis d = diagnosed_development("d04", 1);
  ASSERT_EQ(d.added.size(), 1u);
  EXPECT_TRUE(names(d.added.front(), "rotor_tilt")) << d.added.front().id;
  EXPECT_LE(d.added.front().twins.size(), 2u);
}

}  // namespace
}  // namespace rotorloop::diagnose
