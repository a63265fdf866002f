// Names of the numbers that logs hold for limiters; written into the log header, so that a log explains itself.
#pragma once
#include <array>
#include <map>
#include <string>
#include <string_view>

#include "firmware/core/interface.hpp"

namespace rotorloop::hil {

constexpr std::string_view limiter_name(firmware::Limiter l) {
  using enum firmware::Limiter;
  switch (l) {
    case none:
      return "none";
    case phase_current:
      return "phase_current";
    case bus_current:
      return "bus_current";
    case regen_current:
      return "regen_current";
    case voltage:
      return "voltage";
    case speed_slew:
      return "speed_slew";
    case max_speed:
      return "max_speed";
    case min_speed:
      return "min_speed";
    case temperature:
      return "temperature";
    case undervoltage:
      return "undervoltage";
    case observer:
      return "observer";
    case sensor_range:
      return "sensor_range";
  }
  return "";
}

// Header value of "esc_limiter_codes": "0 none, 1 phase_current, …".
inline std::string esc_limiter_codes() {
  std::string out;
  for (int code = 0; code < 256; ++code) {
    const auto name = limiter_name(static_cast<firmware::Limiter>(code));
    if (name.empty()) break;
    out += (out.empty() ? "" : ", ") + std::to_string(code) + " " + std::string(name);
  }
  return out;
}

// The other way: "1 tilt, 2 thrust" -> {1: tilt, 2: thrust}; ignores what it cannot read.
std::map<int, std::string> numbered_names(std::string_view header_value);

}  // namespace rotorloop::hil
