#include "bench/hil/closed_loop/loop_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/hil/closed_loop/run_layout.hpp"
#include "bench/hil/flight/run_folder.hpp"
#include "bench/render/digits.hpp"
#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {
using Json = nlohmann::ordered_json;

Json measured(double v) { return std::isnan(v) ? Json(nullptr) : Json(v); }

Json to_json(const PairedReduction& r) {
  return {{"percent", measured(r.percent)}, {"low", measured(r.low)}, {"high", measured(r.high)}, {"pairs", r.pairs}};
}

Json to_json(const TrackedFlight& t) {
  Json j{{"flight", t.plan.flight.name},
         {"axis", hil::axis_name(t.plan.axis)},
         {"expect", t.plan.expect == Expectation::better ? "better" : "no_worse"},
         {"percent", t.plan.percent},
         {"seeds", t.seeds},
         {"before_cm", t.before},
         {"identified_cm", t.identified},
         {"after_cm", t.after},
         {"lost", t.lost}};
  j["reduction"] = to_json(t.reduction);
  j["reduction_identified"] = to_json(t.reduction_identified);
  j["pass"] = t.pass;
  j["reason"] = t.reason;
  return j;
}

std::string spread_text(const std::vector<double>& v) {
  const hil::Spread s = hil::spread_of(v);
  return s.n == 0 ? "-" : fmt::format("{:.2f} ± {:.2f}", s.mean, s.std);
}

}  // namespace

std::string why_not_flyable(const fs::path& vehicle) {
  if (!fs::is_regular_file(vehicle)) return "the diagnosis wrote no vehicle file";
  try {
    (void)host::read_vehicle(vehicle, host::builtin_effect_catalogue());
  } catch (const Error& e) {
    return e.text().what;
  }
  return "";
}

LoopResult assemble_loop(const fs::path& run) {
  const LoopLayout at{run};
  if (!fs::is_regular_file(at.run_toml()))
    throw Error({run.generic_string(), "is no folder of `rotorloop close`", "it holds no run.toml", "name the folder that it printed"});
  const auto file = TomlFile::read(at.run_toml());
  const auto root = file.root();
  if (root.text("command", "") != "close")
    throw Error({at.run_toml().generic_string(), "is a run of another command", "", "name a folder that `rotorloop close` wrote"});
  if (!fs::is_regular_file(at.diagnosis()))
    throw Error({run.generic_string(), "holds no diagnosis", "the run was stopped before its end", "run the same `rotorloop close` again"});
  LoopResult r;
  r.run = run;
  r.plan = read_loop_plan(run / root.text("plan"));
  r.command_line = root.text("command_line");
  r.version = root.text("version");
  r.isolation = read_isolation_record(at.diagnose() / "isolation.json");
  r.findings = read_findings(at.diagnosis());
  const hil::RunResult before = hil::read_result(at.before() / "judged");
  r.identified = fs::is_regular_file(at.identified() / "done.toml");
  r.after_is_before = !fs::is_regular_file(at.after() / "done.toml");
  if (r.after_is_before) r.why_not_flown = why_not_flyable(at.diagnosed_vehicle());
  const hil::RunResult after = r.after_is_before ? before : hil::read_result(at.after() / "judged");
  hil::RunResult identified;
  if (r.identified) identified = hil::read_result(at.identified() / "judged");
  r.tracking = compare_tracking(r.plan.judged, before, r.identified ? &identified : nullptr, after);
  // Nothing flown again is no success, even where nothing had to get better: unless nothing was to be changed.
  const bool closed = !r.after_is_before || r.findings.added.empty();
  r.pass = closed && std::all_of(r.tracking.begin(), r.tracking.end(), [](const TrackedFlight& t) { return t.pass; });
  if ((r.truth_compared = fs::is_regular_file(at.truth()))) r.truth = read_truth(at.truth());
  return r;
}

render::Outcome loop_outcome(const LoopResult& r) {
  render::Outcome out{.verdict = r.pass ? "pass" : "fail", .standing = r.pass ? render::Standing::good : render::Standing::bad};
  const auto passed = std::count_if(r.tracking.begin(), r.tracking.end(), [](const TrackedFlight& t) { return t.pass; });
  out.sentence = fmt::format("{} of {} judged flights as expected. Diagnosis: {}.", passed, r.tracking.size(), r.findings.verdict);
  for (const TrackedFlight& t : r.tracking)
    if (!t.pass) out.errors.push_back(t.plan.flight.name + ": " + t.reason);
  if (r.after_is_before && !r.findings.added.empty()) out.errors.push_back("nothing was flown again: " + r.why_not_flown);
  if (r.truth_compared)
    out.next = "the truth is told below; another plan or other seeds (--learn-seeds) show whether it holds";
  else
    out.next = fmt::format("rotorloop close truth {}: was the diagnosis right?", r.run.filename().generic_string());
  return out;
}

std::string loop_result_json(const LoopResult& r) {
  Json j{{"format", 1}, {"command", "close"}, {"version", r.version}, {"name", r.plan.name}, {"verdict", r.pass ? "pass" : "fail"}};
  const render::Outcome outcome = loop_outcome(r);
  j["errors"] = outcome.errors;
  j["next"] = outcome.next;
  j["isolation"] = {{"layers", r.isolation.layers},       {"enforced_by", r.isolation.enforced_by}, {"holds", r.isolation.holds},
                    {"ways_tried", r.isolation.attempts}, {"opened", r.isolation.opened},           {"gave_up", r.isolation.gave_up}};
  j["diagnosis"] = {{"verdict", r.findings.verdict}, {"added", Json::array()}};
  for (const auto& e : r.findings.added) {
    Json parameters = Json::array(), alias_ids = Json::array();
    for (const auto& t : e.aliases) alias_ids.push_back(t.id);
    for (const auto& p : e.parameters) parameters.push_back({{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"u", p.u}});
    j["diagnosis"]["added"].push_back({{"id", e.id}, {"parameters", parameters}, {"twins", alias_ids}});
  }
  j["flown_again"] = !r.after_is_before;
  if (r.after_is_before) j["why_not_flown"] = r.why_not_flown;
  j["tracking"] = Json::array();
  for (const auto& t : r.tracking) j["tracking"].push_back(to_json(t));
  if (r.truth_compared) j["truth"] = Json::parse(truth_json(r.truth));
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string loop_result_text(const LoopResult& r) {
  std::string out = fmt::format("{}\nsandbox   {}{}\n", r.plan.name, r.isolation.layers,
                                r.isolation.holds ? fmt::format(", {} ways to the truth tried, none opened", r.isolation.attempts) : "");
  out += fmt::format("diagnosis {}\n", r.findings.verdict);
  for (const auto& e : r.findings.added) {
    out += fmt::format("  added   {}", e.id);
    for (const auto& p : e.parameters)
      out += fmt::format("  {} = {} {}", p.name, render::measured_text(p.value, p.u), p.unit == "1" ? "" : p.unit);
    if (!e.aliases.empty()) out += fmt::format("\n          or {}; {}", alias_names(e), e.manoeuvre);
    out += "\n";
  }
  for (const auto& f : r.findings.faults) out += "  fault   " + f + "\n";
  out += fmt::format("\n{:<22}{:>18}{:>18}{:>18}   {}\n", "tracking error, cm", "nominal model", "identified", "with the effects",
                     "less error");
  for (const auto& t : r.tracking)
    out += fmt::format("{:<22}{:>19}{:>19}{:>19}   {}: {}\n", t.plan.flight.name + (t.plan.axis == hil::ErrorAxis::z ? " (|z|)" : " (3-D)"),
                       spread_text(t.before), spread_text(t.identified), spread_text(t.after), t.pass ? "pass" : "MISSED", t.reason);
  if (r.after_is_before) out += "nothing was flown again: " + r.why_not_flown + "\n";
  out += fmt::format("\n{}run:     {}\nreport:  {}\n", render::outcome_text(loop_outcome(r)), r.run.generic_string(),
                     LoopLayout{r.run}.report().generic_string());
  return out;
}

}  // namespace rotorloop::closed_loop
