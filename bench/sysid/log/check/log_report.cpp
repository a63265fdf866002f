// A few logs judged, as text and JSON; see log_report.hpp.
#include "bench/sysid/log/check/log_report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bench/sysid/log/check/checks.hpp"
#include "bench/sysid/log/log_summary.hpp"

namespace rotorloop::log {
namespace {

constexpr const char* kNeedsVehicle =
    "not checked without a vehicle file (--vehicle): the unit of the rotor speeds (mass, rotor radius), a rotor whose reading fails (arms)";

const char* word(Outlook o) { return o == Outlook::enough ? "enough" : o == Outlook::little ? "little" : "nothing"; }

std::string content_text(const FlightRecord& f, const FlightContent& c) {
  std::string out = "  streams  ";
  for (const StreamSummary& s : summarize(f)) out += fmt::format(" {} {:.0f} Hz,", s.name, s.rate_Hz);
  out.back() = '\n';
  if (c.turning_rad_s)
    out += fmt::format("  turning   roll {:.2f}, pitch {:.2f}, yaw {:.2f} rad/s rms in {:.0f} to {:.0f} Hz\n", (*c.turning_rad_s)[0],
                       (*c.turning_rad_s)[1], (*c.turning_rad_s)[2], kTurningLow_hz, kTurningHigh_hz);
  if (c.speed_rms_m_s)
    out += fmt::format("  speed     horizontal {:.2f} m/s rms, up to {:.2f}; climb {:.2f} to {:.2f} m/s, {:.2f} rms\n", *c.speed_rms_m_s,
                       *c.speed_most_m_s, c.climb_m_s->from_s, c.climb_m_s->to_s, *c.climb_rms_m_s);
  if (c.thrust_m_s2)
    out += fmt::format("  thrust    {:.1f} to {:.1f} m/s^2 along the thrust axis\n", c.thrust_m_s2->from_s, c.thrust_m_s2->to_s);
  return out;
}

nlohmann::ordered_json range(const std::optional<TimeRange>& r) {
  return r ? nlohmann::ordered_json{r->from_s, r->to_s} : nlohmann::ordered_json();
}
nlohmann::ordered_json number(const std::optional<double>& x) { return x ? nlohmann::ordered_json(*x) : nlohmann::ordered_json(); }

nlohmann::ordered_json content_json(const FlightRecord& f, const FlightContent& c) {
  nlohmann::ordered_json j;
  j["seconds"] = c.seconds;
  j["streams"] = nlohmann::ordered_json::array();
  for (const StreamSummary& s : summarize(f)) j["streams"].push_back({{"name", s.name}, {"unit", s.unit}, {"rate_Hz", s.rate_Hz}});
  j["turning_rms_rad_s"] = nullptr;
  if (c.turning_rad_s) j["turning_rms_rad_s"] = {(*c.turning_rad_s)[0], (*c.turning_rad_s)[1], (*c.turning_rad_s)[2]};
  j["turning_band_Hz"] = {kTurningLow_hz, kTurningHigh_hz};
  j["speed_rms_m_s"] = number(c.speed_rms_m_s);
  j["speed_most_m_s"] = number(c.speed_most_m_s);
  j["climb_m_s"] = range(c.climb_m_s);
  j["climb_rms_m_s"] = number(c.climb_rms_m_s);
  j["thrust_m_s2"] = range(c.thrust_m_s2);
  return j;
}

std::vector<ParameterOutlook> together(const std::vector<LogReport>& logs) {
  std::vector<std::vector<ParameterOutlook>> all;
  for (const LogReport& l : logs)
    if (!l.checked.refusal) all.push_back(l.parameters);
  return best_of(all);
}

}  // namespace

LogReport report_log(FlightRecord record, std::vector<LogFinding> notes, const host::VehicleModel* vehicle) {
  LogReport r;
  r.checked = vehicle ? check_flight(record, *vehicle) : check_flight(record);
  r.checked.findings.insert(r.checked.findings.begin(), notes.begin(), notes.end());
  r.record = std::move(record);
  if (r.checked.refusal) return r;
  r.content = flight_content(r.record, r.checked.segments);
  r.parameters = parameter_outlook(r.record, r.content);
  return r;
}

std::string log_report_text(const std::vector<LogReport>& logs, bool with_vehicle) {
  std::string out;
  for (const LogReport& l : logs) {
    out += findings_table(l.checked);
    if (!l.checked.refusal) out += content_text(l.record, l.content);
  }
  if (!with_vehicle) out += std::string(kNeedsVehicle) + "\n";
  const auto parameters = together(logs);
  if (parameters.empty()) return out;
  out += fmt::format("what {} can determine\n", logs.size() == 1 ? "this flight" : "these flights together");
  for (const ParameterOutlook& p : parameters) out += fmt::format("  {:<24} {:<8} {}\n", p.parameter, word(p.outlook), p.because);
  out += "  mass                     nothing  no flight tells it from the thrust: weigh the vehicle\n";
  return out;
}

std::string log_report_json(const std::vector<LogReport>& logs, bool with_vehicle) {
  nlohmann::ordered_json j;
  j["format"] = 1;
  j["with_vehicle"] = with_vehicle;
  j["flights"] = nlohmann::ordered_json::array();
  for (const LogReport& l : logs) {
    auto f = nlohmann::ordered_json::parse(findings_json(l.checked));
    f["content"] = l.checked.refusal ? nlohmann::ordered_json() : content_json(l.record, l.content);
    j["flights"].push_back(std::move(f));
  }
  j["parameters"] = nlohmann::ordered_json::array();
  for (const ParameterOutlook& p : together(logs))
    j["parameters"].push_back({{"parameter", p.parameter}, {"outlook", word(p.outlook)}, {"because", p.because}});
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace rotorloop::log
