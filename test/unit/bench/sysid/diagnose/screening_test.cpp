// The sweep of all candidates on a flight that obeys the paper's equations, fitted with a centre of mass held 1.5 mm from where it is.
#include "bench/sysid/diagnose/screening.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/base/constants.hpp"
#include "host/effects/rotor_groups.hpp"
#include "test/unit/bench/sysid/diagnose/paper_flights.hpp"

namespace rotorloop::diagnose {
namespace {

const Screening& screened() {
  static const Screening s = screen(testing_flights::beside_the_centre(), {"rotor_tilt"}, {}, 0.5, 2);
  return s;
}
const Candidate* candidate(const std::string& id) {
  const auto found =
      std::find_if(screened().candidates.begin(), screened().candidates.end(), [&](const Candidate& c) { return c.id == id; });
  return found == screened().candidates.end() ? nullptr : &*found;
}
GroupTest tested(const std::string& id) { return test_group(screened().table, base_columns(screened().table), candidate(id)->columns); }

TEST(Screening, EveryRowOfTheCatalogueThatAModelHoldsIsACandidateOnceButWhatIsLeftOutAndWhatTheFitFrees) {
  EXPECT_EQ(candidate("rotor_tilt"), nullptr);
  EXPECT_EQ(candidate("pose_delay"), nullptr) << "free in every fit";
  using Kind = host::EffectKind;
  for (const host::CatalogueEffect& e : host::builtin_effect_catalogue().effects) {
    const bool left_out =
        e.id == "rotor_tilt" || e.id == "ceiling_effect" || e.id == "pose_delay" || e.kind == Kind::variance || e.kind == Kind::none;
    EXPECT_EQ(candidate(e.id) == nullptr, left_out) << e.id << ": rotor_tilt was left out, and no ceiling is known of";
  }
  std::vector<Eigen::Index> columns;
  for (const Candidate& c : screened().candidates) columns.insert(columns.end(), c.columns.begin(), c.columns.end());
  for (std::size_t i = 0; i < columns.size(); ++i) EXPECT_EQ(columns[i], screened().table.base + static_cast<Eigen::Index>(i));
  EXPECT_EQ(screened().table.information.rows(), screened().table.base + static_cast<Eigen::Index>(columns.size()));
}

TEST(Screening, OneStepFindsACentreOfMassThatIsOffByOneAndAHalfMillimetresToATenth) {
  const GroupTest t = tested("com_offset");
  EXPECT_NEAR(t.estimate[0], 1.5e-3, 0.15e-3);
  EXPECT_NEAR(t.estimate[1], 0.0, 0.15e-3);
  EXPECT_LT(t.p, 1e-6);
}

// What all rotors have in common is in k_1 and c_q: of four numbers three are tested.
TEST(Screening, OfANumberForEachRotorTheSumIsNoPartOfTheTestNorOfTheEstimate) {
  for (const char* id : {"weak_rotor", "rotor_torque_scale", "rotor_speed_scale"}) {
    ASSERT_FALSE(host::common_part(id).empty());
    const GroupTest t = tested(id);
    EXPECT_EQ(t.degrees, 3) << id;
    EXPECT_NEAR(t.estimate.sum(), 0.0, 1e-9 * t.estimate.cwiseAbs().sum()) << id;
    EXPECT_LT(t.covariance.sum(), 1e-9 * t.covariance.trace()) << id;
  }
}

// Rotor speeds of the log that grow against the true ones, so that thrust falls by `falls_1_s` of what they say. The log counts its time
// from the start of a computer.
constexpr double kFlight_s = 8.0;
Screening screened_with_falling_thrust(double falls_1_s) {
  constexpr double kComputerRan_s = 500.0;
  identify::FlightToFit f = testing_flights::flight({}, {.manoeuvre = model_true::Manoeuvre::rotation, .duration_s = kFlight_s}, 6);
  auto& rotors = f.record.rotor_omega_rad_s;
  const double begun_s = rotors.t_s.front();
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    for (double& omega : rotors.value[i]) omega /= std::sqrt(1.0 - falls_1_s * (rotors.t_s[i] - begun_s));
    rotors.t_s[i] += kComputerRan_s;
  }
  for (double& t : f.record.pose.t_s) t += kComputerRan_s;
  return screen(identify::identify({f}, testing_flights::vehicle(), testing_flights::options_holding({})), {}, {}, 0.5, 2);
}
GroupTest drift(const Screening& s, const std::string& id) {
  const auto c = std::find_if(s.candidates.begin(), s.candidates.end(), [&](const Candidate& one) { return one.id == id; });
  return test_group(s.table, base_columns(s.table), c->columns);
}

TEST(Screening, ThrustThatFallsBy1PercentASecondIsFoundToATenthWhateverTheClockOfTheLogSays) {
  constexpr double kFalls_1_s = 1e-2;
  const Screening s = screened_with_falling_thrust(kFalls_1_s);
  for (const auto& [id, rate] : {std::pair{"thrust_drift", -kFalls_1_s}, std::pair{"mass_drift", kFalls_1_s}}) {
    EXPECT_NEAR(drift(s, id).estimate[0], rate, 0.1 * kFalls_1_s) << id;
    EXPECT_LT(drift(s, id).p, 1e-6) << id;
  }
}

// A size that matters is not found to a tenth in so short a flight. A force noise of n = 0.03 m/s²/√Hz alone gives a slope over T = 8 s an
// uncertainty of n / (g √(T³/12)) = 4.7e-4 1/s, a third of that size; a twentieth takes 27 s. What the screening says its uncertainty is
// must be that, and the error within two of it.
TEST(Screening, ThrustThatFallsByASizeThatMattersIsFoundWithinTheUncertaintyThatTheNoiseOfTheFlightGivesASlope) {
  constexpr double kFalls_1_s = 1.5e-3, kNoise_m_s2_rtHz = 0.03;
  const double u_1_s = kNoise_m_s2_rtHz / (kGravity_m_s2 * std::sqrt(kFlight_s * kFlight_s * kFlight_s / 12.0));
  const Screening s = screened_with_falling_thrust(kFalls_1_s);
  for (const auto& [id, rate] : {std::pair{"thrust_drift", -kFalls_1_s}, std::pair{"mass_drift", kFalls_1_s}}) {
    EXPECT_NEAR(std::sqrt(drift(s, id).covariance(0, 0)), u_1_s, 0.25 * u_1_s) << id;
    EXPECT_NEAR(drift(s, id).estimate[0], rate, 2.0 * u_1_s) << id;
  }
}

}  // namespace
}  // namespace rotorloop::diagnose
