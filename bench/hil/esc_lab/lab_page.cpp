#include "bench/hil/esc_lab/lab_page.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/hil/esc_lab/lab_figures.hpp"
#include "bench/render/document.hpp"
#include "bench/render/outcome.hpp"
#include "bench/render/page.hpp"

namespace rotorloop::esc_lab {
namespace {

constexpr double kNever = 1e8;  // times beyond it stand for "never"

std::string with_unit(double value, const LabRow& r) {
  if (r.unit == "ms" && value > kNever) return "never";
  const std::string figure = value > kNever ? "–" : render::figure_text(value, r.unit == "ms" || r.unit == "Hz" ? "{:.0f}" : "{:.3g}");
  return r.unit.empty() ? figure : figure + " " + r.unit;
}
std::string limit_text(const LabRow& r) {
  return (r.at_least ? "≥ " : "≤ ") + render::figure_text(r.limit, "{:.3g}") +
         (r.unit.empty() || r.unit.starts_with("of") ? "" : " " + r.unit);
}

render::Table table(const LabResult& result) {
  render::Table t;
  t.columns = {render::left("battery"), render::left("figure"), {"measured"}, {"limit"}, render::left(""), render::left("note")};
  Battery last{};
  for (const LabRow& r : result.rows) {
    const bool first = t.rows.empty() || r.battery != last;
    last = r.battery;
    render::Row row;
    row.first = first;
    row.cells = {first ? std::string(kBatteryNames[static_cast<std::size_t>(r.battery)]) : std::string(),
                 r.what,
                 with_unit(r.value, r),
                 limit_text(r),
                 render::Cell(r.met() ? "met" : "missed", r.met() ? "pass" : "fail"),
                 render::true_minus(r.note)};
    t.rows.push_back(std::move(row));
  }
  return t;
}

render::Outcome outcome(const LabResult& r) {
  render::Outcome o;
  o.verdict = r.met() ? "pass" : "fail";
  o.standing = r.met() ? render::Standing::good : render::Standing::bad;
  const auto missed = std::count_if(r.rows.begin(), r.rows.end(), [](const LabRow& row) { return !row.met(); });
  o.sentence =
      missed == 0 ? fmt::format("All {} limits met.", r.rows.size()) : fmt::format("{} of {} limits missed.", missed, r.rows.size());
  for (const LabRow& row : r.rows)
    if (!row.met())
      o.errors.push_back(fmt::format("{}: {} is {}, limit {}{}", kBatteryNames[static_cast<std::size_t>(row.battery)], row.what,
                                     with_unit(row.value, row), limit_text(row),
                                     row.note.empty() ? "" : " (" + render::true_minus(row.note) + ")"));
  return o;
}

}  // namespace

std::string lab_text(const LabResult& r) {
  render::Section s{.title = "ESC laboratory: " + r.name};
  for (const auto& [key, value] : r.facts)
    if (key == "phase current limit") s.blocks.push_back(render::Paragraph{key + ": " + value});
  s.blocks.push_back(table(r));
  return render::terminal_text({s}) + "\n" + render::outcome_text(outcome(r));
}

std::string lab_html(const LabResult& r, const std::string& version) {
  std::string out = render::page_begin("ESC laboratory: " + r.name,
                                       "the firmware core of the ESC on simulated, drawn boards: nothing here was measured on hardware",
                                       "rotorloop esc-lab");
  out += render::banner_html(outcome(r));
  auto facts = r.facts;
  facts.emplace_back("draws", r.draws == 1 ? fmt::format("seed {}", r.seed) : fmt::format("seeds {} to {}", r.seed, r.seed + r.draws - 1));
  facts.emplace_back("made by", version);
  out += render::facts_html(facts);
  render::Section limits{.title = "Figures and limits", .id = "limits"};
  limits.blocks.push_back(table(r));
  render::Sections sections{limits};
  for (render::Section& s : figure_sections(r)) sections.push_back(std::move(s));
  return out + render::page_html(sections) + render::page_end();
}

std::string lab_json(const LabResult& r, const std::string& version) {
  nlohmann::ordered_json j;
  const render::Outcome o = outcome(r);
  j["format"] = 1;
  j["command"] = "esc-lab";
  j["version"] = version;
  j["verdict"] = o.verdict;
  j["errors"] = o.errors;
  j["name"] = r.name;
  for (const auto& [key, value] : r.facts) j["facts"][key] = value;
  j["seed"] = r.seed;
  j["draws"] = r.draws;
  j["schedules"] = r.schedules;
  j["rows"] = nlohmann::ordered_json::array();
  for (const LabRow& row : r.rows) {
    nlohmann::ordered_json one;
    one["battery"] = kBatteryNames[static_cast<std::size_t>(row.battery)];
    one["what"] = row.what;
    if (std::isfinite(row.value) && row.value < kNever)
      one["value"] = row.value;
    else
      one["value"] = nullptr;  // never, or no number
    one["unit"] = row.unit;
    one["limit"] = row.limit;
    one["at_least"] = row.at_least;
    one["met"] = row.met();
    one["note"] = row.note;
    j["rows"].push_back(std::move(one));
  }
  return j.dump(2) + "\n";
}

}  // namespace rotorloop::esc_lab
