#include "bench/hil/closed_loop/report_evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "bench/render/digits.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::closed_loop {
namespace {

constexpr std::size_t kShown = 12;     // candidates of a round
constexpr std::size_t kFewValues = 2;  // parameters of a candidate that is not chosen yet: a table row has no room for more
constexpr int kOut = 0, kIn = 2;       // colours: ruled out, could be it

std::string values_text(const std::vector<FoundValue>& values) {
  std::string out;
  for (const auto& v : values)
    out +=
        fmt::format("{}{} = {}{}", out.empty() ? "" : ", ", v.name, render::measured_text(v.value, v.u), v.unit == "1" ? "" : " " + v.unit);
  return out;
}

std::string few_values_text(std::vector<FoundValue> values) {
  const bool more = values.size() > kFewValues;
  if (more) values.resize(kFewValues);
  return values_text(values) + (more ? ", …" : "");
}

std::string round_html(const FoundRound& round, std::size_t number) {
  if (round.candidates.empty()) return "";
  render::BarChart chart;
  chart.title = fmt::format("statistic of each candidate, sweep {}", number);
  chart.x_label = "block-robust statistic (F)";
  if (round.placebo_wald > 0) {
    chart.limit = round.placebo_wald;
    chart.limit_label = fmt::format("{:.0f} % of placebos", 100.0 * round.placebo_level);
  }
  std::string rows;
  for (std::size_t i = 0; i < std::min(kShown, round.candidates.size()); ++i) {
    const auto& c = round.candidates[i];
    render::Bar bar;
    bar.label = c.id;
    bar.value = c.wald;
    bar.colour = c.ruled_out_by.empty() ? kIn : kOut;
    chart.bars.push_back(bar);
    rows += fmt::format(
        "<tr><td class=\"l\">{}</td><td class=\"l\">{}</td><td>{:.3g}</td><td>{:.1f} %</td><td>{:.3g}</td><td class=\"l\">{}</td></tr>\n",
        render::xml_escaped(c.id), render::xml_escaped(few_values_text(c.one_step)), c.wald, 100.0 * c.gain_relative, c.cross_validated,
        c.ruled_out_by.empty() ? "<b>could be it</b>" : render::xml_escaped(c.ruled_out_by));
  }
  return fmt::format("<h3>Sweep {}: {}</h3>\n", number, render::xml_escaped(round.decision)) +
         render::figure_html("", render::bar_chart_svg(chart)) +
         "<div class=\"scroll\"><table><tr><th class=\"l\">candidate</th><th class=\"l\">estimate without a refit</th><th>F</th><th>of the "
         "misfit</th>"
         "<th>cross-validated gain</th><th class=\"l\">against it</th></tr>\n" +
         rows + "</table></div>\n" +
         (round.candidates.size() > kShown
              ? fmt::format("<p class=\"cap\">{} more candidates, all weaker.</p>\n", round.candidates.size() - kShown)
              : "");
}

}  // namespace

std::string evidence_section(const Findings& f) {
  if (f.rounds.empty()) return "";
  std::string out =
      "<h2>What the residual says: evidence for and against</h2>\n<p>Every effect of the library against what the model leaves "
      "unexplained, in one sweep; after an effect is "
      "added, all others again. An effect counts when it passes every criterion: above the placebos, inside its physical range, better on "
      "blocks "
      "that did not estimate it.</p>\n";
  for (std::size_t i = 0; i < f.rounds.size(); ++i) out += round_html(f.rounds[i], i + 1);
  return out;
}

std::string added_section(const Findings& f) {
  std::string out = "<h2>What was added</h2>\n";
  if (f.added.empty()) return out + fmt::format("<p>Nothing: the verdict is “{}”.</p>\n", render::xml_escaped(f.verdict));
  out +=
      "<div class=\"scroll\"><table><tr><th class=\"l\">effect</th><th class=\"l\">parameters after the refit</th><th class=\"l\">cannot "
      "be distinguished from</th></tr>\n";
  std::string notes;
  for (const auto& e : f.added) {
    out += fmt::format("<tr><td class=\"l\">{}</td><td class=\"l\">{}</td><td class=\"l\">{}</td></tr>\n", render::xml_escaped(e.id),
                       render::xml_escaped(values_text(e.parameters)), e.aliases.empty() ? "nothing" : render::xml_escaped(alias_names(e)));
    if (!e.determined.empty()) notes += "<p>" + render::xml_escaped(e.id + ": determined is " + e.determined) + "</p>\n";
    if (!e.manoeuvre.empty() && !e.aliases.empty()) notes += "<p>" + render::xml_escaped("To distinguish them: " + e.manoeuvre) + "</p>\n";
  }
  out += "</table></div>\n" + notes;
  for (const auto& r : f.remarks) out += "<p>" + render::xml_escaped(r) + "</p>\n";
  return out;
}

std::string held_out_section(const Findings& f) {
  if (f.held_out.empty()) return "";
  render::BarChart chart;
  chart.title = "error of open-loop predictions on flights held out, after over before";
  chart.x_label = "error with the diagnosis over error before (95 % by blocks)";
  chart.limit = 1.0;
  chart.limit_label = "no change";
  std::string rows;
  for (const auto& h : f.held_out) {
    render::Bar bar;
    bar.label = fmt::format("{}, {:g} s", h.quantity, h.horizon_s);
    bar.value = h.ratio;
    bar.spread = 0.5 * (h.high - h.low);
    bar.colour = h.high < 1.0 ? kIn : kOut;
    chart.bars.push_back(bar);
    rows += fmt::format("<tr><td class=\"l\">{}</td><td>{:g}</td><td>{:.4g}</td><td>{:.4g}</td><td>{:.3f} ({:.3f} to {:.3f})</td></tr>\n",
                        render::xml_escaped(h.quantity), h.horizon_s, h.before, h.after, h.ratio, h.low, h.high);
  }
  return "<h2>On flights held out</h2>\n<p>Open-loop predictions on flights that no fit has seen, with the model as it was and with what "
         "was added.</p>\n" +
         render::figure_html("", render::bar_chart_svg(chart)) +
         "<div class=\"scroll\"><table><tr><th class=\"l\">quantity</th><th>horizon, s</th><th>before</th><th>after</th><th>ratio (95 "
         "%)</th></tr>\n" +
         rows + "</table></div>\n";
}

std::string residual_section(const std::filesystem::path& page, const std::string& link) {
  std::ifstream in(page, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (text.empty()) return "";
  const std::string own = fmt::format("<p><a href=\"{}\">The diagnosis's own page</a> has all of it.</p>\n", link);
  const auto begin = text.find("<h2 id=\"wrench\">");
  if (begin == std::string::npos || text.find("<script") != std::string::npos) return own;
  const auto end = std::min(text.find("<h2", begin + 1), text.find("</main>", begin));
  return text.substr(begin, end - begin) + "<p class=\"cap\">Of the model with what was added: this is the residual after.</p>\n" + own;
}

}  // namespace rotorloop::closed_loop
