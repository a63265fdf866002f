// Residuals of whole fits: a flight that obeys the model has none to report; measured yaw leads its torque.
#include "bench/diagnose/residual_findings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "test/support/model_true_flight.hpp"
#include "test/unit/bench/identify/measured_fit.hpp"
#include "test/unit/bench/markup.hpp"

namespace rotorloop::bench {
namespace {

using model_true::Manoeuvre;

const Identification& clean_fit() {
  static const Identification r = [] {
    std::vector<FlightToFit> flights;
    for (const Manoeuvre m : {Manoeuvre::vertical, Manoeuvre::horizontal, Manoeuvre::rotation}) {
      model_true::FlightSettings s;
      s.manoeuvre = m;
      s.seed = 21 + static_cast<std::uint64_t>(m);
      s.duration_s = 10.0;
      flights.push_back({model_true::fly({}, s).record, FlightRole::any, {}, {}});
    }
    IdentifyOptions o;
    o.grid.rate_Hz = 100.0;
    o.noise.force_m_s2_rtHz.setConstant(0.03);
    o.noise.angular_rad_s2_rtHz.setConstant(0.3);
    return identify(flights,
                    host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue()), o);
  }();
  return r;
}

const ResidualFindings& clean() {
  static const ResidualFindings f = analyse_residuals(clean_fit());
  return f;
}

TEST(ResidualFindings, of_flights_that_obey_the_model_are_noise_of_the_fitted_size_without_lag_step_or_change_of_scatter) {
  const ResidualFindings& f = clean();
  for (std::size_t a = 0; a < kAxes; ++a) {
    EXPECT_EQ(f.unexplained.kind[a], ResidualKind::none) << kAxisNames[a];
    EXPECT_NEAR(f.unexplained.axis[a].rms / f.unexplained.axis[a].rms_expected, 1.0, 0.15) << kAxisNames[a];
  }
  EXPECT_TRUE(f.lag.findings.empty());
  EXPECT_TRUE(f.steps.events.empty());
  for (const VarianceEffect& e : f.variance.effects) EXPECT_FALSE(e.found) << e.what;
  EXPECT_TRUE(f.words.empty()) << f.words.front();
}

TEST(ResidualFindings, repeat_bit_by_bit) { EXPECT_EQ(residual_json(clean()), residual_json(analyse_residuals(clean_fit()))); }

TEST(ResidualFindings, are_told_in_text_markup_and_json) {
  EXPECT_THAT(residual_table(clean()), ::testing::HasSubstr("torque z"));
  EXPECT_EQ(unbalanced(residual_sections_html(clean())), "");
  const auto j = nlohmann::json::parse(residual_json(clean()));
  EXPECT_EQ(j["axes"].size(), 6u);
  EXPECT_EQ(j["axes"][5]["unit"], "N m");
}

TEST(ResidualFindings, measured_yaw_of_a_nano_drone_leads_the_drag_of_its_rotors_and_stops_to_lead_when_the_model_has_their_inertia) {
  if (!MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: the lead of measured yaw is not tested";
  const MeasuredSet set{"idsia_nanodrone_cf21bl"};
  const auto yaw_with = [&](const char* term) {
    IdentifyOptions o;
    o.grid.rate_Hz = 100.0;
    o.grid.use_gyro = true;
    o.grid.from_s = 10.0, o.grid.to_s = 30.0;
    o.fit.noise.rounds = 3;
    if (term) o.terms.add(*host::find_term(term));
    return analyse_residuals(identify(without_roles(set.flights({"random1_20251017_run1"})), set.vehicle(), o)).lag;
  };
  const LagResult before = yaw_with(nullptr), after = yaw_with("rotor_inertia_reaction");
  EXPECT_TRUE(before.axis[5].known);
  EXPECT_LT(before.axis[5].high_s, -0.020);
  EXPECT_GT(before.axis[5].low_s, -0.060);
  EXPECT_TRUE(std::any_of(before.findings.begin(), before.findings.end(), [](const LagFinding& f) {
    return f.verdict == LagVerdict::leads && std::find(f.effects.begin(), f.effects.end(), "rotor_inertia_reaction") != f.effects.end();
  }));
  EXPECT_GT(after.axis[5].lag_s, -0.010);
  EXPECT_GT(after.axis[5].share, before.axis[5].share_at_zero + 0.3);
}

}  // namespace
}  // namespace rotorloop::bench
