// One tree, two printers: the same figures on terminal and page, each in its own typography.
#include "bench/render/document.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace rotorloop::render {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Sections thrust() {
  Table t{{left("rotor"), {"T, N"}, left("note")}};
  t.rows = {{{"1", figure_text(-1.5), "late\nand weak"}}, {{"2 & 3", Cell(figure_text(NAN), "fail"), ""}, true}};
  return {{"Thrust",
           "thrust",
           {Paragraph{"By −3 ms, of course."}, Paragraph{"For the page.", On::page}, t, Markup{"<svg/>"}, List{{"a < b"}}}}};
}

TEST(Document, AlignsTheColumnsOfATerminalByCharactersAndLetsACellOfTwoLinesGoOnBelow) {
  EXPECT_EQ(terminal_text(thrust()),
            "Thrust\nBy -3 ms, of course.\n"
            "  rotor  T, N  note\n"
            "  1      -1.5  late\n"
            "               and weak\n"
            "  2 & 3     –\n"
            "  - a < b\n");
}

TEST(Document, EscapesThePageAndKeepsWhatIsForItAlone) {
  const std::string page = page_html(thrust());
  EXPECT_THAT(page, HasSubstr("<h2 id=\"thrust\">Thrust</h2>"));
  EXPECT_THAT(page, HasSubstr("<td class=\"l\">1</td><td>−1.5</td><td class=\"l\">late<br>and weak</td>"));
  EXPECT_THAT(page, HasSubstr("<tr class=\"first\"><td class=\"l\">2 &amp; 3</td><td class=\"fail\">–</td>"));
  EXPECT_THAT(page, HasSubstr("<p>For the page.</p>"));
  EXPECT_THAT(page, HasSubstr("<svg/>"));
  EXPECT_THAT(page, HasSubstr("<li>a &lt; b</li>"));
  EXPECT_THAT(terminal_text(thrust()), Not(HasSubstr("svg")));
}

TEST(Document, PrintsASectionWithoutAnchorAsAHeadOfTheThirdOrderAndAnEmptyOneNotAtAllOnATerminal) {
  EXPECT_EQ(page_html({{"What follows", "", {}}}), "<h3>What follows</h3>\n");
  EXPECT_EQ(terminal_text({{"What follows", "", {}}}), "");
}

TEST(Document, SpansAColumnHeadOverSeveral) {
  const Table t{{left("a"), {"b"}, {"c"}}, {{{"x", "1", "2"}}}, {left(""), left("both", 2)}};
  EXPECT_THAT(page_html({{"", "", {t}}}), HasSubstr("<th class=\"l\" colspan=\"2\">both</th>"));
  EXPECT_EQ(terminal_text({{"", "", {t}}}), "     both\n  a  b  c\n  x  1  2\n");
}

TEST(Figures, AreWrittenAsPrintHasThem) {
  EXPECT_EQ(figure_text(-3.1e-8), "−3.1e−08");
  EXPECT_EQ(figure_text(INFINITY), "∞");
  EXPECT_EQ(uncertainty_text(0.0), "");
  EXPECT_EQ(value_text(5.128, 0.21, "kg m2"), "5.13 ± 0.21 kg m²");
  EXPECT_EQ(value_text(5.0, 0.0, "1"), "5");
  EXPECT_EQ(true_minus("by -3 (-4), not well-known"), "by −3 (−4), not well-known");
}

}  // namespace
}  // namespace rotorloop::render
