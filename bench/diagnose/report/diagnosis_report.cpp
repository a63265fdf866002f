#include "bench/diagnose/report/diagnosis_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/diagnose/report/diagnosis_text.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_pieces.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr std::size_t kShownCandidates = 14;  // of a screening, in the page
constexpr std::size_t kShownManoeuvres = 8;   // of a class, in the page

std::string figure(const NamedValue& v) {
  return fmt::format("{} = {:.4g} ± {:.2g} {}", render::xml_escaped(v.name), v.value, v.u, v.unit == "1" ? "" : render::xml_escaped(v.unit));
}

std::string effects_html(const Diagnosis& d) {
  if (d.added.empty()) return "<p>No effect was added to the model.</p>\n";
  std::string out =
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">effect</th><th class=\"l\">size</th><th>W</th><th>gain</th><th>on other "
      "blocks</th><th class=\"l\">not told from</th></tr></thead><tbody>\n";
  for (const AddedEffect& a : d.added) {
    std::string sizes, twins;
    for (const NamedValue& v : a.parameters) sizes += (sizes.empty() ? "" : "<br>") + figure(v);
    for (const ClassMember& m : a.twins) {
      twins += fmt::format("{}{} ({:.0f} % of the gain)", twins.empty() ? "" : "<br>", render::xml_escaped(m.id), 100.0 * m.gain_share);
    }
    if (!a.manoeuvre.empty()) twins += "<br>fly: " + render::xml_escaped(a.manoeuvre);
    out += fmt::format(
        "<tr><td class=\"l big\">{}</td><td class=\"l\">{}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.1f}</td><td class=\"l\">{}</td></tr>\n",
        render::xml_escaped(a.id), sizes, a.evidence.wald, a.evidence.gain, a.evidence.cross_validated, twins);
  }
  return out + "</tbody></table></div>\n";
}

std::string log_html(const char* heading, const std::vector<LogFault>& all) {
  if (all.empty()) return "";
  std::string out = std::string(heading) + "<ul>\n";
  for (const LogFault& f : all)
    out += fmt::format("<li>{} {}: {} ({:.2f} to {:.2f} s)</li>\n", render::xml_escaped(f.flight), render::xml_escaped(f.stream), render::xml_escaped(f.what),
                       f.from_s, f.to_s);
  return out + "</ul>\n";
}

// The best candidates of a screening, and what speaks against each.
std::string round_html(const DiagnosisRound& r, std::size_t number) {
  std::string out = fmt::format("<h3>Screening {}: {}</h3>\n<p>{} candidates; {}.</p>\n", number, render::xml_escaped(r.decision),
                                r.candidates.size(), words(r.placebos));
  out +=
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">effect</th><th>W</th><th>p (Holm)</th><th>gain</th><th>held</th><th "
      "class=\"l\">estimate</th><th class=\"l\">what speaks against it</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < std::min(kShownCandidates, r.candidates.size()); ++i) {
    const CandidateEvidence& e = r.candidates[i];
    out += fmt::format(
        "<tr><td class=\"l\">{}</td><td>{:.1f}</td><td>{:.1e}</td><td>{:.1f}</td><td>{:.1f}</td><td class=\"l\">{}</td><td class=\"l "
        "{}\">{}</td></tr>\n",
        render::xml_escaped(e.id), e.wald, e.p_holm, e.gain, e.cross_validated, e.one_step.empty() ? "" : figure(e.one_step.front()),
        e.ruled_out_by.empty() ? "pass" : "", e.ruled_out_by.empty() ? "nothing" : render::xml_escaped(e.ruled_out_by));
  }
  return out + "</tbody></table></div>\n";
}

// What each of the manoeuvres tried in simulation would tell of a class.
std::string advice_html(const AddedEffect& effect) {
  const ManoeuvreAdvice& a = effect.advice;
  if (a.ranked.empty()) return {};
  std::string out = fmt::format(
      "<h3>What would tell {} from its twins</h3>\n<p>Log likelihood that {:.0f} s of each manoeuvre, flown in simulation by the fitted "
      "model, are expected to bring beside the flights so far; 3 are odds of 20 to 1.</p>\n<div class=\"scroll\"><table><thead><tr><th "
      "class=\"l\">manoeuvre</th>",
      render::xml_escaped(effect.id), a.seconds);
  for (const std::string& twin : a.twins) out += "<th>" + render::xml_escaped(twin) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (std::size_t i = 0; i < std::min(kShownManoeuvres, a.ranked.size()); ++i) {
    out += "<tr><td class=\"l\">" + render::xml_escaped(a.ranked[i].words) + "</td>";
    for (const double s : a.ranked[i].separation) out += fmt::format("<td>{:.2g}</td>", s);
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

}  // namespace

std::string diagnosis_report_html(const DiagnosisRun& run, const std::string& vehicle_name) {
  const Diagnosis& d = run.diagnosis;
  std::string flights;
  for (const estimate::GridFlight& g : run.after.flights) flights += (flights.empty() ? "" : ", ") + g.name;
  std::string out = render::page_begin("What the model of " + vehicle_name + " lacks", "diagnosed from " + flights, "diagnosis");
  out += render::facts_html({{"verdict", verdict_name(d)},
                     {"effects added", std::to_string(d.added.size())},
                     {"innovations", d.white ? "white" : "not white"}});
  out += "<h2 id=\"effects\">Effects</h2>\n" + effects_html(d);
  for (const RemainingResidual& r : d.remains) out += "<p><b>Remains</b>: " + render::xml_escaped(remaining_text(r)) + "</p>\n";
  for (const std::string& remark : d.remarks) out += "<p>" + render::xml_escaped(remark) + "</p>\n";
  if (run.held_out) out += identify::held_out_html(*run.held_out);
  for (const AddedEffect& a : d.added) out += advice_html(a);
  out += "<h2 id=\"evidence\">Evidence</h2>\n";
  for (std::size_t i = 0; i < d.rounds.size(); ++i) out += round_html(d.rounds[i], i + 1);
  out += log_html("<h2 id=\"faults\">Faults of the logs</h2>\n", d.faults);
  if (!d.not_observable.empty()) {
    out += "<h2 id=\"hidden\">What these flights could not have shown</h2>\n<ul>\n";
    for (const NotObservable& n : d.not_observable)
      out += fmt::format("<li><b>{}</b>: {}{}</li>\n", render::xml_escaped(n.id), render::xml_escaped(n.why),
                         n.needs.empty() ? "" : "; " + render::xml_escaped(n.needs));
    out += "</ul>\n";
  }
  out += log_html("<h2 id=\"left-out\">Left out of the logs, as no fault of a sensor</h2>\n", d.left_out);
  if (run.residuals && !run.residuals->words.empty()) out += residual_sections_html(*run.residuals);
  return out + render::page_end();
}

}  // namespace rotorloop::diagnose
