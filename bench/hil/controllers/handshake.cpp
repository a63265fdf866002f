#include "bench/hil/controllers/handshake.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>

namespace rotorloop::hil {
namespace {
using Json = nlohmann::json;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostShown = 80;  // characters of a line that an error quotes

// Where a group of doubles lies in a structure, and what it is called on the line: structure and text cannot differ.
struct Numbers {
  const char* name;
  std::size_t offset, count;
};
#define ROTORLOOP_NUMBERS(type, member) \
  Numbers { #member, offsetof(type, member), sizeof(type::member) / sizeof(double) }
#define ROTORLOOP_IN(member) ROTORLOOP_NUMBERS(rotorloop_controller_input, member)
#define ROTORLOOP_OUT(member) ROTORLOOP_NUMBERS(rotorloop_controller_output, member)
constexpr std::array kInputNumbers{ROTORLOOP_IN(t_s),
                                   ROTORLOOP_IN(gyro_B_rad_s),
                                   ROTORLOOP_IN(accel_B_m_s2),
                                   ROTORLOOP_IN(pose_t_s),
                                   ROTORLOOP_IN(pose_p_W_m),
                                   ROTORLOOP_IN(pose_q_WS),
                                   ROTORLOOP_IN(pose_v_W_m_s),
                                   ROTORLOOP_IN(estimate_p_W_m),
                                   ROTORLOOP_IN(estimate_v_W_m_s),
                                   ROTORLOOP_IN(estimate_q_WB),
                                   ROTORLOOP_IN(estimate_w_B_rad_s),
                                   ROTORLOOP_IN(setpoint_p_W_m),
                                   ROTORLOOP_IN(setpoint_v_W_m_s),
                                   ROTORLOOP_IN(setpoint_a_W_m_s2),
                                   ROTORLOOP_IN(setpoint_j_W_m_s3),
                                   ROTORLOOP_IN(setpoint_yaw_rad),
                                   ROTORLOOP_IN(setpoint_yaw_rate_rad_s),
                                   ROTORLOOP_IN(omega_rad_s),
                                   ROTORLOOP_IN(bus_V)};
constexpr std::array kOutputNumbers{ROTORLOOP_OUT(p_W_m),          ROTORLOOP_OUT(v_W_m_s),
                                    ROTORLOOP_OUT(a_W_m_s2),       ROTORLOOP_OUT(j_W_m_s3),
                                    ROTORLOOP_OUT(yaw_rad),        ROTORLOOP_OUT(yaw_rate_rad_s),
                                    ROTORLOOP_OUT(q_WB),           ROTORLOOP_OUT(w_B_rad_s),
                                    ROTORLOOP_OUT(thrust_N),       ROTORLOOP_OUT(omega_rad_s),
                                    ROTORLOOP_OUT(estimate_p_W_m), ROTORLOOP_OUT(estimate_v_W_m_s),
                                    ROTORLOOP_OUT(estimate_q_WB),  ROTORLOOP_OUT(estimate_w_B_rad_s),
                                    ROTORLOOP_OUT(torque_B_N_m)};
#undef ROTORLOOP_OUT
#undef ROTORLOOP_IN
#undef ROTORLOOP_NUMBERS

constexpr std::array<const char*, 4> kPhases{"boot", "spin_up", "flying", "safe"};
constexpr std::array<const char*, 4> kLevels{"", "position", "attitude", "rotor_speed"};

template <class Structure>
std::span<double> values(Structure& s, const Numbers& n) {
  return {reinterpret_cast<double*>(reinterpret_cast<char*>(&s) + n.offset), n.count};
}
template <class Structure>
std::span<const double> values(const Structure& s, const Numbers& n) {
  return {reinterpret_cast<const double*>(reinterpret_cast<const char*>(&s) + n.offset), n.count};
}

// Shortest text that reads back to the same bits. JSON readers take "-0" for an integer, which has no sign.
void append(std::string& line, double v) {
  if (!std::isfinite(v))
    line += "null";
  else if (v == 0.0 && std::signbit(v))
    line += "-0.0";
  else
    fmt::format_to(std::back_inserter(line), "{}", v);
}

template <class Structure>
void append(std::string& line, const Structure& s, std::span<const Numbers> table) {
  for (const Numbers& n : table) {
    const auto v = values(s, n);
    line += fmt::format(",\"{}\":", n.name);
    if (n.count > 1) line += '[';
    for (std::size_t i = 0; i < n.count; ++i) {
      if (i > 0) line += ',';
      append(line, v[i]);
    }
    if (n.count > 1) line += ']';
  }
}

double number_of(const Json& j) { return j.is_number() ? j.get<double>() : kNoNumber; }

// Empty when there is none.
std::string text_of(const Json& j, const char* key) {
  const auto it = j.find(key);
  return it != j.end() && it->is_string() ? it->get<std::string>() : std::string();
}

template <class Structure>
std::string take(const Json& j, Structure& s, std::span<const Numbers> table) {
  for (const Numbers& n : table) {
    const auto it = j.find(n.name);
    if (it == j.end()) continue;
    const auto out = values(s, n);
    if (n.count == 1) {
      if (!it->is_number() && !it->is_null()) return fmt::format("{} is no number", n.name);
      out[0] = number_of(*it);
      continue;
    }
    if (it->is_null()) {
      for (double& v : out) v = kNoNumber;
      continue;
    }
    if (!it->is_array() || it->size() != n.count) return fmt::format("{} is no list of {} numbers", n.name, n.count);
    for (std::size_t i = 0; i < n.count; ++i) out[i] = number_of((*it)[i]);
  }
  return "";
}

std::string shown(std::string_view line) {
  return line.size() <= kMostShown ? std::string(line) : std::string(line.substr(0, kMostShown)) + "…";
}

// Python writes NaN and Infinity, which JSON has not: a number that is none either way.
std::string with_null(std::string_view line) {
  std::string out(line);
  for (const std::string_view word : {"-Infinity", "Infinity", "NaN"})
    for (auto at = out.find(word); at != std::string::npos; at = out.find(word, at)) out.replace(at, word.size(), "null");
  return out;
}

std::string parse_object(std::string_view line, Json& j) {
  j = Json::parse(with_null(line), nullptr, false);
  return j.is_object() ? "" : fmt::format("no JSON object: \"{}\"", shown(line));
}

std::string parse_version(const Json& j) {
  const auto it = j.find("rotorloop_controller");
  if (it == j.end() || !it->is_number_integer()) return "the first line has no \"rotorloop_controller\", the version of the handshake";
  const auto version = it->get<std::int64_t>();
  return version == kHandshakeVersion ? "" : fmt::format("handshake version {}, here version {}", version, kHandshakeVersion);
}

template <class T>
std::string take_integer(const Json& j, const char* key, std::int64_t least, std::int64_t most, T& out) {
  const auto it = j.find(key);
  if (it == j.end()) return "";
  if (!it->is_number_integer() || it->get<std::int64_t>() < least || it->get<std::int64_t>() > most)
    return fmt::format("{} = {}, allowed {} to {}", key, it->dump(), least, most);
  out = static_cast<T>(it->get<std::int64_t>());
  return "";
}

}  // namespace

rotorloop_controller_output empty_output() {
  rotorloop_controller_output out{};
  out.size = sizeof out;
  for (const Numbers& n : kOutputNumbers) {
    const std::string_view name = n.name;
    const bool zero = name == "v_W_m_s" || name == "a_W_m_s2" || name == "j_W_m_s3" || name == "yaw_rate_rad_s" || name == "w_B_rad_s";
    for (double& v : values(out, n)) v = zero ? 0.0 : kNoNumber;
  }
  return out;
}

std::string setup_line(const HandshakeSetup& s) {
  const Json j{{"rotorloop_controller", kHandshakeVersion},
               {"period_s", s.period_s},
               {"mass_kg", s.mass_kg},
               {"hover_omega_rad_s", s.hover_omega_rad_s},
               {"omega_min_rad_s", s.omega_min_rad_s},
               {"omega_max_rad_s", s.omega_max_rad_s},
               {"vehicle_file", s.vehicle_file},
               {"gains_file", s.gains_file},
               {"flight", s.flight},
               {"log_folder", s.log_folder}};
  return j.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string hello_line(const HandshakeHello& h) {
  const Json j{{"rotorloop_controller", kHandshakeVersion},
               {"level", kLevels[h.level]},
               {"every", h.every},
               {"own_estimate", h.own_estimate},
               {"start_s", h.start_s}};
  return j.dump() + "\n";
}

std::string input_line(const rotorloop_controller_input& in) {
  std::string line = fmt::format("{{\"step\":{},\"phase\":\"{}\",\"pose_new\":{},\"estimate_valid\":{}", in.step, kPhases[in.phase],
                                 in.pose_new ? "true" : "false", in.estimate_valid ? "true" : "false");
  append(line, in, kInputNumbers);
  return line + "}\n";
}

std::string output_line(std::uint64_t step, const rotorloop_controller_output& out) {
  std::string line = fmt::format("{{\"step\":{},\"limiters\":{}", step, out.limiters);
  append(line, out, kOutputNumbers);
  return line + "}\n";
}

std::string parse_setup(std::string_view line, HandshakeSetup& s) {
  Json j;
  if (auto why = parse_object(line, j); !why.empty()) return why;
  if (auto why = parse_version(j); !why.empty()) return why;
  const auto number = [&](const char* key, double& out) {
    if (j.contains(key)) out = number_of(j[key]);
  };
  number("period_s", s.period_s);
  number("mass_kg", s.mass_kg);
  number("hover_omega_rad_s", s.hover_omega_rad_s);
  number("omega_min_rad_s", s.omega_min_rad_s);
  number("omega_max_rad_s", s.omega_max_rad_s);
  s.vehicle_file = text_of(j, "vehicle_file");
  s.gains_file = text_of(j, "gains_file");
  s.flight = text_of(j, "flight");
  s.log_folder = text_of(j, "log_folder");
  return "";
}

std::string parse_hello(std::string_view line, HandshakeHello& h) {
  Json j;
  if (auto why = parse_object(line, j); !why.empty()) return why;
  if (const std::string refusal = text_of(j, "error"); !refusal.empty()) return refusal;
  if (auto why = parse_version(j); !why.empty()) return why;
  const std::string level = text_of(j, "level");
  for (std::uint32_t l = 1; l < kLevels.size(); ++l)
    if (level == kLevels[l]) h.level = l;
  if (h.level == 0) return fmt::format("level \"{}\" is not known; use position, attitude or rotor_speed", shown(level));
  if (auto why = take_integer(j, "every", 1, 100, h.every); !why.empty()) return why;
  if (j.contains("own_estimate")) {
    if (!j["own_estimate"].is_boolean()) return "own_estimate is neither true nor false";
    h.own_estimate = j["own_estimate"].get<bool>();
  }
  if (j.contains("start_s")) {
    h.start_s = number_of(j["start_s"]);
    if (!(h.start_s >= 0.0 && h.start_s <= 120.0)) return fmt::format("start_s = {}, allowed 0 to 120 s", j["start_s"].dump());
  }
  return "";
}

std::string parse_input(std::string_view line, rotorloop_controller_input& in) {
  Json j;
  if (auto why = parse_object(line, j); !why.empty()) return why;
  in = {};
  in.size = sizeof in;
  if (auto why = take_integer(j, "step", 0, std::numeric_limits<std::int64_t>::max(), in.step); !why.empty()) return why;
  const std::string phase = text_of(j, "phase");
  for (std::uint32_t p = 0; p < kPhases.size(); ++p)
    if (phase == kPhases[p]) in.phase = p;
  in.pose_new = j.value("pose_new", Json(false)) == Json(true);
  in.estimate_valid = j.value("estimate_valid", Json(false)) == Json(true);
  return take(j, in, kInputNumbers);
}

std::string parse_output(std::string_view line, std::uint64_t step, rotorloop_controller_output& out) {
  Json j;
  if (auto why = parse_object(line, j); !why.empty()) return why;
  const auto it = j.find("step");
  if (it == j.end() || !it->is_number_unsigned()) return fmt::format("an answer without the number of its step: \"{}\"", shown(line));
  if (it->get<std::uint64_t>() != step) return fmt::format("answered step {} where step {} was asked", it->get<std::uint64_t>(), step);
  out = empty_output();
  if (auto why = take_integer(j, "limiters", 0, 63, out.limiters); !why.empty()) return why;
  return take(j, out, kOutputNumbers);
}

}  // namespace rotorloop::hil
