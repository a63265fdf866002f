// Residuals of whole fits: flights that obey the model have none to report.
#include "bench/sysid/diagnose/residuals/residual_findings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bench/sysid/diagnose/report/residual_sections.hpp"
#include "bench/sysid/diagnose/report/residual_tree.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/unit/bench/markup.hpp"

namespace rotorloop::diagnose {
namespace {

using model_true::Manoeuvre;

const identify::Identification& clean_fit() {
  static const identify::Identification r = [] {
    std::vector<identify::FlightToFit> flights;
    for (const Manoeuvre m : {Manoeuvre::vertical, Manoeuvre::horizontal, Manoeuvre::rotation}) {
      model_true::FlightSettings s;
      s.manoeuvre = m;
      s.seed = 21 + static_cast<std::uint64_t>(m);
      s.duration_s = 10.0;
      flights.push_back({model_true::fly({}, s).record, identify::FlightRole::any, {}, {}});
    }
    identify::IdentifyOptions o;
    o.grid.rate_Hz = 100.0;
    o.noise.force_m_s2_rtHz.setConstant(0.03);
    o.noise.angular_rad_s2_rtHz.setConstant(0.3);
    return identify::identify(
        flights, host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue()), o);
  }();
  return r;
}

const ResidualFindings& clean() {
  static const ResidualFindings f = analyse_residuals(clean_fit());
  return f;
}

TEST(ResidualFindings, OfFlightsThatObeyTheModelAreNoiseOfTheFittedSizeWithoutLagStepOrChangeOfScatter) {
  const ResidualFindings& f = clean();
  for (std::size_t a = 0; a < kAxes; ++a) {
    EXPECT_EQ(f.unexplained.kind[a], ResidualKind::none) << kAxisNames[a];
    EXPECT_NEAR(f.unexplained.axis[a].rms / f.unexplained.axis[a].rms_expected, 1.0, 0.15) << kAxisNames[a];
  }
  EXPECT_TRUE(f.lag.findings.empty());
  EXPECT_TRUE(f.steps.events.empty());
  EXPECT_TRUE(f.steps.too_small.empty());
  for (const VarianceEffect& e : f.variance.effects) EXPECT_FALSE(e.found) << e.what;
  EXPECT_TRUE(f.words.empty()) << f.words.front();
}

TEST(ResidualFindings, RepeatBitByBit) { EXPECT_EQ(residual_tree(clean()), residual_tree(analyse_residuals(clean_fit()))); }

TEST(ResidualFindings, AreToldInTextMarkupAndJson) {
  const auto j = residual_tree(clean());
  const render::Sections sections = residual_sections(j, clean());
  EXPECT_THAT(render::terminal_text(sections), ::testing::HasSubstr("torque z"));
  EXPECT_EQ(test::unbalanced(render::page_html(sections)), "");
  EXPECT_EQ(j["axes"].size(), 6u);
  EXPECT_EQ(j["axes"][5]["unit"], "N m");
}

TEST(ResidualFindings, AStepThatPassesAndDoesNotMatterIsCountedInTheTextAndKeptInJsonWithItsMark) {
  ResidualFindings f = clean();
  f.steps.too_small = {{0}};
  f.steps.steps[0].matters = false;
  f.steps.matters = {0.04, 0.04, 0.04, 5e-4, 5e-4, 5e-4};
  const auto j = residual_tree(f);
  EXPECT_THAT(render::terminal_text(residual_sections(j, f)),
              ::testing::HasSubstr("; 1 passes and makes less than 0.04 N and 0.0005 N m rms."));
  ASSERT_EQ(j["steps_in_time"].size(), 1u);
  EXPECT_EQ(j["steps_in_time"][0][0]["matters"], false);
  f.steps.events = {{1}};
  f.steps.steps[1].matters = true;
  const auto both = residual_tree(f);
  EXPECT_EQ(both["steps_in_time"].size(), 2u);
  EXPECT_EQ(both["steps_in_time"][0][0]["matters"], true);
  EXPECT_THAT(render::terminal_text(residual_sections(both, f)), ::testing::HasSubstr("Too small to matter: 1 passes and makes less than"));
}

}  // namespace
}  // namespace rotorloop::diagnose
