// The range of every field of Parameters, and the check that names the offending one. Freestanding: the result is an index
// into kParameterRanges with the limits, from which a host or a log makes a sentence.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/core/interface.hpp"

namespace rotorloop::firmware {

struct ParameterRange {
  const char* name;
  const char* unit;
  float min, max;
  float (*get)(const Parameters&);
};

// Where a limit comes from is said beside it; limits without a word are the edges of what has been tested.
inline constexpr std::array<ParameterRange, 23> kParameterRanges{{
    {"node_id", "", 1, 125, [](const Parameters& p) { return static_cast<float>(p.node_id); }},     // 126, 127: tools
    {"esc_index", "", 0, 15, [](const Parameters& p) { return static_cast<float>(p.esc_index); }},  // four groups of four
    {"command_timeout_ms", "ms", 20, 1000, [](const Parameters& p) { return static_cast<float>(p.command_timeout_ms); }},
    {"fast_timeout_ms", "ms", 2, 100, [](const Parameters& p) { return static_cast<float>(p.fast_timeout_ms); }},  // two periods of 1 kHz
    {"require_arming", "", 0, 1, [](const Parameters& p) { return p.require_arming ? 1.0f : 0.0f; }},
    {"fast_channel", "", 0, 1, [](const Parameters& p) { return p.fast_channel ? 1.0f : 0.0f; }},
    {"fast_feedback_Hz", "Hz", 0, 1000, [](const Parameters& p) { return static_cast<float>(p.fast_feedback_Hz); }},  // 0, 250, 500, 1000
    {"status_Hz", "Hz", 2, 200, [](const Parameters& p) { return static_cast<float>(p.status_Hz); }},  // autopilots call 1.2 s offline
    {"pole_pairs", "", 1, 32, [](const Parameters& p) { return static_cast<float>(p.pole_pairs); }},
    {"resistance", "ohm", 1e-3f, 10, [](const Parameters& p) { return p.resistance_ohm; }},
    {"inductance", "H", 1e-7f, 1e-2f, [](const Parameters& p) { return p.inductance_H; }},
    {"flux_linkage", "Wb", 1e-5f, 0.1f, [](const Parameters& p) { return p.flux_linkage_Wb; }},
    {"inertia", "kg m2", 1e-8f, 0.1f, [](const Parameters& p) { return p.inertia_kg_m2; }},
    {"load", "N m s2", 0, 1e-3f, [](const Parameters& p) { return p.load_N_m_s2; }},
    {"phase_current_limit", "A", 0.1f, 120, [](const Parameters& p) { return p.phase_current_limit_A; }},  // shunts of the largest board
    {"bus_current_limit", "A", 0.1f, 120, [](const Parameters& p) { return p.bus_current_limit_A; }},
    {"regen_current_limit", "A", 0, 120, [](const Parameters& p) { return p.regen_current_limit_A; }},
    {"speed_slew", "rad/s2", 0, 1e6f, [](const Parameters& p) { return p.speed_slew_rad_s2; }},
    {"max_speed", "rad/s", 10, 3430, [](const Parameters& p) { return p.max_speed_rad_s; }},  // range of the fast channel: 32 766 RPM
    {"min_speed", "rad/s", 1, 1000, [](const Parameters& p) { return p.min_speed_rad_s; }},
    {"undervoltage", "V", 2.5f, 60, [](const Parameters& p) { return p.undervoltage_V; }},  // one cell to fourteen
    {"overvoltage", "V", 4, 76, [](const Parameters& p) { return p.overvoltage_V; }},  // below the widest bus divider, 80 V
    {"temperature_limit", "K", 300, 398, [](const Parameters& p) { return p.temperature_limit_K; }},
}};

// Largest electrical speed the observer is verified to: 200 000 electrical RPM.
inline constexpr float kMaxElectricalSpeed_rad_s = 20944.0f;

struct ParameterError {
  std::size_t index = 0;  // into kParameterRanges
  float value = 0.0f;
  float min = 0.0f, max = 0.0f;  // what would be allowed; narrower than the table's when another parameter bounds it
};

// The first parameter that is out of range (NaN is), or that contradicts another one.
constexpr std::optional<ParameterError> check(const Parameters& p) {
  constexpr std::size_t kFeedback = 6, kMaxSpeed = 18, kMinSpeed = 19, kUndervoltage = 20;
  for (std::size_t i = 0; i < kParameterRanges.size(); ++i) {
    const ParameterRange& r = kParameterRanges[i];
    const float v = r.get(p);
    if (!(v >= r.min && v <= r.max)) return ParameterError{i, v, r.min, r.max};
  }
  // Divides the 16 sequence numbers of the set-point: all ESCs answer on the same edge.
  if (p.fast_feedback_Hz != 0 && p.fast_feedback_Hz != 250 && p.fast_feedback_Hz != 500 && p.fast_feedback_Hz != 1000) {
    const float v = static_cast<float>(p.fast_feedback_Hz);
    const float below = v < 250.0f ? 0.0f : v < 500.0f ? 250.0f : 500.0f;
    return ParameterError{kFeedback, v, below, below == 0.0f ? 250.0f : 2.0f * below};  // the neighbours that are allowed
  }
  const float fastest = kMaxElectricalSpeed_rad_s / static_cast<float>(p.pole_pairs);
  if (p.max_speed_rad_s > fastest) return ParameterError{kMaxSpeed, p.max_speed_rad_s, kParameterRanges[kMaxSpeed].min, fastest};
  if (p.min_speed_rad_s > p.max_speed_rad_s)
    return ParameterError{kMinSpeed, p.min_speed_rad_s, kParameterRanges[kMinSpeed].min, p.max_speed_rad_s};
  if (p.undervoltage_V >= p.overvoltage_V)
    return ParameterError{kUndervoltage, p.undervoltage_V, kParameterRanges[kUndervoltage].min, p.overvoltage_V};
  return std::nullopt;
}

}  // namespace rotorloop::firmware
