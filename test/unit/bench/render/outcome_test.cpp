// What banner and terminal say of the end of a command.
#include "bench/render/outcome.hpp"

#include <gmock/gmock.h>

namespace rotorloop::render {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Outcome, BannerHasVerdictErrorsAndNextStepEscaped) {
  const std::string html = banner_html({"refused", Standing::bad, "a < b", {"the fit & the log"}, "run it \"again\""});
  EXPECT_THAT(html, AllOf(HasSubstr("class=\"verdict fail\""), HasSubstr("<b>refused</b>"), HasSubstr("<p>a &lt; b</p>"),
                          HasSubstr("<li>the fit &amp; the log</li>"), HasSubstr("Next: run it")));
}
TEST(Outcome, BannerWithoutErrorsHasNoEmptyList) {
  EXPECT_THAT(banner_html({.verdict = "pass", .standing = Standing::good}),
              AllOf(HasSubstr("class=\"verdict pass\""), Not(HasSubstr("<ul>")), Not(HasSubstr("Next"))));
}
TEST(Outcome, TextHasALineForEachErrorWhateverItHolds) {
  EXPECT_EQ(outcome_text({"incomplete", Standing::open, "unused", {"one\ntwo", "three"}, "go on"}),
            "verdict: incomplete\nerror:   one two\nerror:   three\nnext:    go on\n");
}
TEST(Outcome, APageOfItsOwnIsAWholePage) {
  EXPECT_THAT(outcome_page_html("Nothing", "of f.csv", "identification", {"refused", Standing::bad, "", {"why"}, "do"}),
              AllOf(HasSubstr("<!doctype html>"), HasSubstr("<h1>Nothing</h1>"), HasSubstr("why"), HasSubstr("</html>")));
}

}  // namespace
}  // namespace rotorloop::render
