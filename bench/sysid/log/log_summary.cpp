#include "bench/sysid/log/log_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/base/statistics.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::log {
namespace {

std::vector<double> numbers(double v) { return {v}; }
std::vector<double> numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
std::vector<double> numbers(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }
std::vector<double> numbers(const RotorValues& v) { return {v.begin(), v.end()}; }
std::vector<double> numbers(const PoseReading& r) {
  return {r.p_W_m.x(), r.p_W_m.y(), r.p_W_m.z(), r.q_WS.w(), r.q_WS.x(), r.q_WS.y(), r.q_WS.z()};
}

template <class Value>
void add(std::vector<StreamSummary>& out, std::string name, std::string unit, const Stream<Value>& stream) {
  if (stream.empty()) return;
  StreamSummary s{
      std::move(name), std::move(unit), stream.size(), stream.t_s.front(), stream.t_s.back(), 0.0, 0.0, numbers(stream.value.front())};
  for (std::size_t i = 1; i < stream.size(); ++i) s.longest_gap_s = std::max(s.longest_gap_s, stream.t_s[i] - stream.t_s[i - 1]);
  if (const double step_s = median_step(stream.t_s); step_s > 0.0) s.rate_Hz = 1.0 / step_s;
  out.push_back(std::move(s));
}

std::string short_number(double v) { return std::isnan(v) ? "-" : fmt::format("{:.5g}", v); }

}  // namespace

std::vector<StreamSummary> summarize(const FlightRecord& f) {
  std::vector<StreamSummary> out;
  add(out, "pose p_W, q_WS", "m, 1", f.pose);
  add(out, "position_W", "m", f.position_W_m);
  add(out, "attitude q_WS", "1", f.attitude_WS);
  add(out, "velocity_W", "m/s", f.velocity_W_m_s);
  add(out, "gyro_B", "rad/s", f.gyro_B_rad_s);
  add(out, "accel_B", "m/s2", f.accel_B_m_s2);
  add(out, "rotor_omega", "rad/s", f.rotor_omega_rad_s);
  add(out, "motor_command", "1", f.motor_command);
  add(out, "battery", "V", f.battery_V);
  for (const auto& [name, stream] : f.extra) {
    const auto open = name.rfind('[');
    add(out, name.substr(0, open), open == std::string::npos ? "" : name.substr(open + 1, name.size() - open - 2), stream);
  }
  return out;
}

std::string summary_text(const FlightRecord& f, std::span<const LogFinding> notes) {
  std::string text = fmt::format("flight {}\nsource {}\n", f.name, f.source);
  text += fmt::format("{:<18} {:>6} {:>8} {:>11} {:>11} {:>8} {:>9}  {}\n", "stream", "unit", "samples", "from [s]", "to [s]", "rate[Hz]",
                      "gap [ms]", "first value");
  for (const auto& s : summarize(f)) {
    std::string first;
    for (const double v : s.first) first += (first.empty() ? "" : " ") + short_number(v);
    text += fmt::format("{:<18} {:>6} {:>8} {:>11.3f} {:>11.3f} {:>8.1f} {:>9.1f}  {}\n", s.name, s.unit, s.samples, s.from_s, s.to_s,
                        s.rate_Hz, 1e3 * s.longest_gap_s, first);
  }
  for (const auto& n : notes) text += fmt::format("note: {}: {}\n", n.stream, n.what);
  return text;
}

std::string summary_json(const FlightRecord& f, std::span<const LogFinding> notes) {
  nlohmann::ordered_json j;
  j["format"] = 1;
  j["flight"] = f.name;
  j["source"] = f.source;
  j["streams"] = nlohmann::ordered_json::array();
  for (const auto& s : summarize(f)) {
    nlohmann::ordered_json first = nlohmann::ordered_json::array();
    for (const double v : s.first) first.push_back(std::isfinite(v) ? nlohmann::ordered_json(v) : nlohmann::ordered_json());
    j["streams"].push_back({{"name", s.name},
                            {"unit", s.unit},
                            {"samples", s.samples},
                            {"from_s", s.from_s},
                            {"to_s", s.to_s},
                            {"rate_Hz", s.rate_Hz},
                            {"longest_gap_s", s.longest_gap_s},
                            {"first", std::move(first)}});
  }
  j["notes"] = nlohmann::ordered_json::array();
  for (const auto& n : notes) j["notes"].push_back({{"stream", n.stream}, {"what", n.what}});
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace rotorloop::log
