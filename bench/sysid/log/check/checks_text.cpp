// Findings as a table for people and as JSON for programs.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bench/sysid/log/check/checks.hpp"

namespace rotorloop::log {
namespace {

const char* word(FindingAction a) {
  switch (a) {
    case FindingAction::note:
      return "note";
    case FindingAction::exclude:
      return "exclude";
    case FindingAction::refuse:
      return "refuse";
  }
  return "";
}

}  // namespace

std::string findings_table(const CheckedFlight& c) {
  std::string out = fmt::format("{}\n  {:<8} {:<17} {:>10} {:>10}  {}\n", c.flight.name, "action", "stream", "from [s]", "to [s]", "what");
  for (const LogFinding& f : c.findings)
    out += fmt::format("  {:<8} {:<17} {:>10.3f} {:>10.3f}  {}\n", word(f.action), f.stream, f.from_s, f.to_s, f.what);
  if (c.refusal) {
    out += fmt::format("  refused: {}\n    likely: {}\n    do:     {}\n", c.refusal->what, c.refusal->likely, c.refusal->remedy);
  } else {
    double kept_s = 0.0;
    for (const TimeRange& s : c.segments) kept_s += s.span_s();
    out += fmt::format("  kept {:.2f} s in {} part{}\n", kept_s, c.segments.size(), c.segments.size() == 1 ? "" : "s");
  }
  return out;
}

std::string findings_json(const CheckedFlight& c) {
  nlohmann::ordered_json j;
  j["flight"] = c.flight.name;
  j["segments"] = nlohmann::json::array();
  for (const TimeRange& s : c.segments) j["segments"].push_back({s.from_s, s.to_s});
  j["offsets"] = nlohmann::json::array();
  for (const StreamOffset& o : c.offsets.pairs)
    j["offsets"].push_back(
        {{"stream", o.stream}, {"against", o.against}, {"late_s", o.late_s}, {"u_s", o.u_s}, {"correlation", o.correlation}});
  j["findings"] = nlohmann::json::array();
  for (const LogFinding& f : c.findings)
    j["findings"].push_back(
        {{"stream", f.stream}, {"action", word(f.action)}, {"from_s", f.from_s}, {"to_s", f.to_s}, {"what", f.what}, {"fault", f.fault}});
  j["refusal"] = nullptr;
  if (c.refusal)
    j["refusal"] = {{"where", c.refusal->where}, {"what", c.refusal->what}, {"likely", c.refusal->likely}, {"do", c.refusal->remedy}};
  return j.dump(2);
}

}  // namespace rotorloop::log
