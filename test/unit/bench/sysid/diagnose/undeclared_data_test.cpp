// Verdicts on simulated flights of another simulator, whose physics nobody declared: three of the five flights, half the usual rate.
#include <gtest/gtest.h>

#include <cmath>

#include "test/unit/bench/sysid/diagnose/diagnosed_logs.hpp"

namespace rotorloop::diagnose {
namespace {

using testing::names;

Diagnosis diagnosed(const std::string& set, const std::vector<std::string>& flights, int max_effects) {
  std::vector<identify::FlightToFit> logs;
  for (const std::string& f : flights)
    logs.push_back({identify::testing::read_measured(identify::testing::measured_flights() / set / (f + ".csv")).record,
                    identify::FlightRole::any,
                    {},
                    {}});
  return testing::diagnosed(logs, host::read_vehicle(testing::vehicles() / (set + ".toml"), host::builtin_effect_catalogue()), max_effects);
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
  for (const CandidateEvidence& e : d.rounds.back().candidates) EXPECT_FALSE(e.ruled_out_by.none()) << e.id;
}

}  // namespace
}  // namespace rotorloop::diagnose
