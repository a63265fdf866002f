#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/hil/closed_loop/loop_result.hpp"
#include "bench/hil/closed_loop/report_evidence.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::closed_loop {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ResidualSection, TakesTheWrenchSectionOfTheDiagnosisPageAndNoMore) {
  test::TempFolder folder;
  const auto page =
      folder.write("report.html", "<main><h2 id=\"evidence\">E</h2>one<h2 id=\"wrench\">W</h2>two<h2 id=\"faults\">F</h2>three</main>");
  const auto html = residual_section(page, "4-diagnose/report.html");
  EXPECT_THAT(html, HasSubstr("<h2 id=\"wrench\">W</h2>two"));
  EXPECT_THAT(html, Not(HasSubstr("one")));
  EXPECT_THAT(html, Not(HasSubstr("three")));
  EXPECT_THAT(html, HasSubstr("href=\"4-diagnose/report.html\""));
}

TEST(ResidualSection, OfAPageWithAScriptIsOnlyALinkAndOfNoPageNothing) {
  test::TempFolder folder;
  const auto page = folder.write("report.html", "<main><h2 id=\"wrench\">W</h2><script>x()</script></main>");
  EXPECT_THAT(residual_section(page, "p.html"), Not(HasSubstr("script")));
  EXPECT_THAT(residual_section(page, "p.html"), HasSubstr("href=\"p.html\""));
  EXPECT_EQ(residual_section(folder.path() / "none.html", "p.html"), "");
}

TEST(WhyNotFlyable, SaysWhatIsWrongWithAVehicleFileOfTheDiagnosis) {
  test::TempFolder folder;
  EXPECT_THAT(why_not_flyable(folder.path() / "none.toml"), HasSubstr("no vehicle file"));
  std::string text = test::read_text(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/calibrated.toml");
  EXPECT_EQ(why_not_flyable(folder.write("good.toml", text)), "");
  const auto at = text.find("value = ", text.find("c_dz_N_s2_m2")) + 8;
  text.insert(at, "-");
  EXPECT_THAT(why_not_flyable(folder.write("bad.toml", text)), HasSubstr("c_dz"));
}

TEST(EvidenceSection, NamesWhatSpeaksAgainstEachCandidateAndEscapesIt) {
  Findings f;
  f.rounds.push_back({{{"blockage_strut", "", 50.0, 0.2, 4.0, 0.001, {}}, {"tether", "pulls <down>", 9.0, 0.1, -1.0, 0.2, {}}},
                      6.0,
                      "added blockage_strut"});
  const auto html = evidence_section(f);
  EXPECT_THAT(html, HasSubstr("could be it"));
  EXPECT_THAT(html, HasSubstr("pulls &lt;down&gt;"));
  EXPECT_THAT(html, HasSubstr("99 % of placebos"));
}

}  // namespace
}  // namespace rotorloop::closed_loop
