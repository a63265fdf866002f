#include "bench/sysid/diagnose/report/diagnosis_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "bench/render/page.hpp"
#include "bench/sysid/diagnose/report/diagnosis_outcome.hpp"
#include "bench/sysid/diagnose/report/diagnosis_report.hpp"
#include "bench/sysid/diagnose/report/residual_sections.hpp"
#include "bench/sysid/identify/report/held_out_sections.hpp"
#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::diagnose {
namespace {

using Json = nlohmann::ordered_json;
using identify::text_of;
using identify::value_of;
using render::Cell;
using render::figure_text;
using render::left;
using render::Section;

constexpr std::size_t kShownCandidates = 14, kShownManoeuvres = 8;

// Named or a class, and not all of it.
bool more_remains(const Json& tree) { return !tree.at("added").empty() && !tree.at("remains").empty(); }

std::string named_value(const Json& v) {
  return text_of(v.at("name")) + " = " + render::value_text(value_of(v.at("value")), value_of(v.at("u")), text_of(v.at("unit")));
}
std::string named_values(const Json& all, const char* between) {
  std::vector<std::string> out;
  for (const Json& v : all) out.push_back(named_value(v));
  return fmt::format("{}", fmt::join(out, between));
}
Cell evidence_cell(const Json& of, const char* key, const char* format = "{:.1f}") { return figure_text(value_of(of.at(key)), format); }

render::List log_list(const Json& all) {
  render::List out;
  for (const Json& f : all)
    out.items.push_back(fmt::format("{} {}: {} ({:.2f} to {:.2f} s)", text_of(f.at("flight")), text_of(f.at("stream")),
                                    text_of(f.at("what")), value_of(f.at("from_s")), value_of(f.at("to_s"))));
  return out;
}

std::string remaining(const Json& r) {
  const std::string kind = text_of(r.at("kind")), axis = text_of(r.at("axis")), flight = text_of(r.at("flight")),
                    words = text_of(r.at("words")), unit = text_of(r.at("unit"));
  const double size = value_of(r.at("beyond_noise_rms")), limit = value_of(r.at("limit_rms")), share = 100.0 * value_of(r.at("share"));
  const std::string in = flight.empty() ? "" : "in " + flight + " ", more = words.empty() ? "" : ". " + words;
  if (kind == "noise")
    return fmt::format(
        "the noise that was fitted to {} ({:.2g} {} rms) is far above its residual ({:.2g}): what is missing would pass for it", axis, size,
        unit, limit);
  if (kind == "held_out") return fmt::format("held-out error of {} {:.3g} {}, {:.3g} where the model is right", axis, size, unit, limit);
  if (kind == "bursts")
    return fmt::format("{}{:.0f} % of the power of the residual {} comes in bursts; alone they make {:.2g} {} rms, {:.2g} matter{}", in,
                       share, axis, size, unit, limit, more);
  return fmt::format(
      "{}{:.0f} % of the power of the residual {} is predictable and no effect of the library explains it; {:.2g} {} rms beyond the noise, "
      "{:.2g} matter{}",
      in, share, axis, size, unit, limit, more);
}

// What is reported of an effect with its size.
void add_notes(const Json& effect, render::List& notes) {
  const std::string id = text_of(effect.at("id"));
  if (const std::string size = text_of(effect.at("in_words")); !size.empty()) notes.items.push_back(id + ": " + size);
  if (const std::string next = text_of(effect.at("next")); !next.empty()) notes.items.push_back(id + ": next: " + next);
  if (const std::string ratios = text_of(effect.at("determined")); !ratios.empty()) notes.items.push_back(id + ": determined: " + ratios);
  if (const std::string flight = text_of(effect.at("manoeuvre")); !flight.empty()) notes.items.push_back(id + ": fly: " + flight);
  std::vector<std::string> moved;
  for (const Json& s : effect.at("shifts"))
    moved.push_back(fmt::format("{} {:+.1f} %", text_of(s.at("parameter")), 100.0 * value_of(s.at("relative"))));
  if (!moved.empty()) notes.items.push_back(fmt::format("{}: moved {}", id, fmt::join(moved, ", ")));
}

Section effects_section(const Json& tree) {
  Section out{"Effects", "effects", {}};
  if (tree.at("added").empty()) out.blocks.push_back(render::Paragraph{"No effect was added to the model."});
  render::Table t{{left("effect"),
                   left("size"),
                   {"Wald F"},
                   {"Δ log-likelihood"},
                   {"cross-validated Δ log-likelihood"},
                   left("not distinguished from")}};
  render::List notes;
  for (const Json& a : tree.at("added")) {
    std::string aliases;
    for (const Json& m : a.at("twins"))
      aliases += fmt::format("{}{}: {} (correlation {:.2f}, {:.0f} % of the gain)", aliases.empty() ? "" : "\n", text_of(m.at("id")),
                             named_values(m.at("parameters"), ", "), value_of(m.at("correlation")), 100.0 * value_of(m.at("gain_share")));
    const Json& e = a.at("evidence");
    t.rows.push_back({{Cell(text_of(a.at("id")), "big"), named_values(a.at("parameters"), "\n"), evidence_cell(e, "wald"),
                       evidence_cell(e, "gain"), evidence_cell(e, "cross_validated"), aliases}});
    add_notes(a, notes);
  }
  if (!t.rows.empty()) out.blocks.push_back(t);
  for (const Json& r : tree.at("remains")) notes.items.push_back("remains: " + remaining(r));
  for (const Json& r : tree.at("remarks")) notes.items.push_back(text_of(r));
  out.blocks.push_back(notes);
  return out;
}

// The best candidates of a screening, and what speaks against each.
Section round_section(const Json& r, std::size_t number) {
  const PlaceboLimit placebos{value_of(r.at("placebo_wald")), value_of(r.at("placebo_level")), r.at("placebos")};
  Section out{fmt::format("Screening {}: {}", number, text_of(r.at("decision"))), "", {}};
  out.blocks.push_back(render::Paragraph{fmt::format("{} candidates; {}.", r.at("candidates").size(), words(placebos))});
  render::Table t{{left("effect"),
                   {"Wald F"},
                   {"p (Holm)"},
                   {"Δ log-likelihood"},
                   {"cross-validated Δ log-likelihood"},
                   left("estimate"),
                   left("what speaks against it")}};
  for (const Json& e : r.at("candidates")) {
    if (t.rows.size() == kShownCandidates) break;
    const std::string against = text_of(e.at("ruled_out_by"));
    t.rows.push_back({{text_of(e.at("id")), evidence_cell(e, "wald"), evidence_cell(e, "p_holm", "{:.1e}"), evidence_cell(e, "gain"),
                       evidence_cell(e, "cross_validated"), e.at("one_step").empty() ? "" : named_value(e.at("one_step").front()),
                       against.empty() ? Cell("nothing", "pass") : Cell(against)}});
  }
  out.blocks.push_back(t);
  return out;
}

// What each of the manoeuvres tried in simulation would say of a class.
Section advice_section(const Json& effect) {
  const Json& ranked = effect.at("manoeuvre_search").at("manoeuvres");
  Section out{fmt::format("What would distinguish {} from its aliases", text_of(effect.at("id"))), "", {}};
  out.blocks.push_back(render::Paragraph{
      fmt::format("Δ log-likelihood that {:.0f} s of each manoeuvre, flown in simulation by the fitted model, are expected to add to the "
                  "flights so far; 3 are odds of 20 to 1.",
                  value_of(effect.at("manoeuvre_search").at("seconds")))});
  render::Table t{{left("manoeuvre")}};
  for (const auto& alias : ranked.front().at("separation").items()) t.columns.push_back({alias.key()});
  for (const Json& m : ranked) {
    if (t.rows.size() == kShownManoeuvres) break;
    t.rows.push_back({{text_of(m.at("words"))}});
    for (const Json& s : m.at("separation")) t.rows.back().cells.push_back(figure_text(value_of(s), "{:.2g}"));
  }
  out.blocks.push_back(t);
  return out;
}

template <class Item>
void add_list(render::Sections& to, const char* title, const char* id, const Json& all, Item&& item) {
  render::List list;
  for (const Json& one : all) list.items.push_back(item(one));
  if (!list.items.empty()) to.push_back({title, id, {list}});
}

}  // namespace

std::string verdict_name(const Json& tree) { return text_of(tree.at("verdict")) + (more_remains(tree) ? ", and something remains" : ""); }

render::Sections diagnosis_sections(const Json& tree) {
  render::Sections out{
      {"",
       "",
       {render::Paragraph{"Verdict: " + verdict_words(text_of(tree.at("verdict"))) + (more_remains(tree) ? "; and something remains" : ""),
                          render::On::terminal}}}};
  if (!tree.at("faults").empty()) out.push_back({"Faults of the logs", "faults", {log_list(tree.at("faults"))}});
  out.push_back(effects_section(tree));
  if (tree.contains("held_out")) {
    for (Section& s : identify::held_out_sections(tree.at("held_out"))) out.push_back(std::move(s));
  }
  for (const Json& a : tree.at("added")) {
    if (!a.at("manoeuvre_search").at("manoeuvres").empty()) out.push_back(advice_section(a));
  }
  if (!tree.at("rounds").empty()) out.push_back({"Evidence", "evidence", {}});
  for (std::size_t i = 0; i < tree.at("rounds").size(); ++i) out.push_back(round_section(tree.at("rounds")[i], i + 1));
  add_list(out, "Tried and taken out again", "rejected", tree.at("rejected"),
           [](const Json& e) { return text_of(e.at("id")) + ": " + text_of(e.at("ruled_out_by")); });
  add_list(out, "Below the detection limit of these flights", "hidden", tree.at("not_observable"), [](const Json& n) {
    const std::string needs = text_of(n.at("needs"));
    return text_of(n.at("id")) + ": " + text_of(n.at("why")) + (needs.empty() ? "" : "; " + needs);
  });
  if (!tree.at("left_out").empty())
    out.push_back({"Left out of the logs, as no fault of a sensor", "left-out", {log_list(tree.at("left_out"))}});
  return out;
}

std::string diagnosis_text(const DiagnosisRun& run) {
  Json tree = diagnosis_tree(run, {});
  tree.erase("held_out");
  return render::terminal_text(diagnosis_sections(tree));
}

std::string diagnosis_json(const DiagnosisRun& run, const identify::IdentifyProvenance& from) {
  return diagnosis_tree(run, from).dump(1) + "\n";
}

std::string diagnosis_report_html(const DiagnosisRun& run, const std::string& vehicle_name, const identify::IdentifyProvenance& from) {
  const Json tree = diagnosis_tree(run, from);
  return render::page_begin("What the model of " + vehicle_name + " lacks",
                            fmt::format("diagnosed from {}", fmt::join(tree.at("flights").get<std::vector<std::string>>(), ", ")),
                            "diagnosis") +
         render::banner_html(diagnosis_outcome(run.diagnosis, from)) +
         render::facts_html({{"verdict", verdict_name(tree)},
                             {"effects added", std::to_string(tree.at("added").size())},
                             {"innovations", tree.at("white").get<bool>() ? "white" : "not white"}}) +
         render::page_html(diagnosis_sections(tree)) +
         (run.residuals && !run.residuals->words.empty() ? render::page_html(residual_sections(tree.at("residuals"), *run.residuals))
                                                         : "") +
         render::page_end();
}

}  // namespace rotorloop::diagnose
