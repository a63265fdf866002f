// Every parameter as the bus sees it: name (at most 16 characters), unit, range, default, and the checks that name the offending one.
// Freestanding: a result is an index into kParameterRanges with the limits, from which a host or a log makes a sentence. Values
// cross as float, which holds every integer here exactly.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "firmware/core/interface.hpp"
#include "firmware/core/node/parameter_access.hpp"

namespace rotorloop::firmware {

// Where a limit comes from is said beside it; limits without a word are the edges of what has been tested. `auto` keeps it in flash: as
// `std::array` with its arguments deduced the compiler takes it for data that is written.
inline constexpr auto kParameterRanges = std::array{
    parameter_row<&Parameters::node_id>("node_id", "", 0, 125, InForce::at_start),                  // 126, 127: tools
    ParameterRange{"esc_index", "", -1, 15, get_esc_index, set_esc_index, ParameterKind::integer},  // four groups of four; -1: none
    parameter_row<&Parameters::command_timeout_ms>("cmd_timeout_ms", "ms", 20, 1000),
    parameter_row<&Parameters::fast_timeout_ms>("fast_timeout_ms", "ms", 2, 100),  // two periods of 1 kHz
    parameter_row<&Parameters::require_arming>("require_arming", "", 0, 1),
    parameter_row<&Parameters::fast_channel>("fast_channel", "", 0, 1),
    parameter_row<&Parameters::fast_feedback_Hz>("fast_feedback_Hz", "Hz", 0, 1000),  // 0, 250, 500, 1000
    parameter_row<&Parameters::status_Hz>("status_Hz", "Hz", 2, 200),                 // autopilots call 1.2 s offline
    parameter_row<&Parameters::pole_pairs>("pole_pairs", "", 1, 32, InForce::at_start),
    parameter_row<&Parameters::resistance_ohm>("resistance", "ohm", 1e-3f, 10, InForce::at_start),
    parameter_row<&Parameters::inductance_H>("inductance", "H", 1e-7f, 1e-2f, InForce::at_start),
    parameter_row<&Parameters::flux_linkage_Wb>("flux_linkage", "Wb", 1e-5f, 0.1f, InForce::at_start),
    parameter_row<&Parameters::inertia_kg_m2>("inertia", "kg m2", 1e-8f, 0.1f, InForce::at_start),
    parameter_row<&Parameters::load_N_m_s2>("load", "N m s2", 0, 1e-3f, InForce::at_start),
    parameter_row<&Parameters::inductance_ratio>("inductance_ratio", "", 0, 3, InForce::at_start),  // 0: not known
    // Ends of the largest board; what this board cannot serve is refused by the motor control (ParameterProblem).
    parameter_row<&Parameters::phase_current_limit_A>("phase_limit", "A", 0.1f, 150, InForce::at_start),
    parameter_row<&Parameters::bus_current_limit_A>("bus_limit", "A", 0.1f, 150, InForce::at_start),
    parameter_row<&Parameters::regen_current_limit_A>("regen_limit", "A", 0, 150, InForce::at_start),
    parameter_row<&Parameters::speed_slew_rad_s2>("speed_slew", "rad/s2", 0, 1e6f, InForce::at_start),
    parameter_row<&Parameters::max_speed_rad_s>("max_speed", "rad/s", 10, 3430,
                                                InForce::at_start),  // range of the fast channel: 32 766 RPM
    parameter_row<&Parameters::min_speed_rad_s>("min_speed", "rad/s", 1, 1000, InForce::at_start),
    parameter_row<&Parameters::undervoltage_V>("undervoltage", "V", 2, 60, InForce::at_start),
    parameter_row<&Parameters::overvoltage_V>("overvoltage", "V", 4, 80, InForce::at_start),
    parameter_row<&Parameters::temperature_limit_K>("temp_limit", "K", 300, 398, InForce::at_start),
    parameter_row<&Parameters::cells>("cells", "", 0, 20, InForce::at_start),
    parameter_row<&Parameters::weaken_most_A>("weaken_most", "A", 0, 75, InForce::at_start),
    parameter_row<&Parameters::stop_mode>("stop_mode", "", 0, 2, InForce::at_start),
    parameter_row<&Parameters::stop_strength>("stop_strength", "", 0, 1, InForce::at_start),
    parameter_row<&Parameters::self_test>("self_test", "", 0, 1, InForce::at_start),
    parameter_row<&Parameters::status_idle_Hz>("status_idle_Hz", "Hz", 2, 10),
    parameter_row<&Parameters::extended_Hz>("extended_Hz", "Hz", 0, 50),
    parameter_row<&Parameters::rpm_Hz>("rpm_Hz", "Hz", 0, 200),
    parameter_row<&Parameters::node_status_ms>("node_status_ms", "ms", 100, 1000),  // DroneCAN: at most 1000
    parameter_row<&Parameters::status_priority>("status_priority", "", 8, 31),      // not before the commands
    parameter_row<&Parameters::log_level>("log_level", "", 0, 4),
    parameter_row<&Parameters::preferred_id>("preferred_id", "", 0, 125, InForce::at_start),
    parameter_row<&Parameters::feedback_voltage>("feedback_voltage", "", 0, 1),
    parameter_row<&Parameters::raw_mode>("raw_mode", "", 0, 2),
    parameter_row<&Parameters::raw_deadband>("raw_deadband", "", 0, 0.2f),
    parameter_row<&Parameters::dir_reversed>("dir_reversed", "", 0, 1),
    parameter_row<&Parameters::bidirectional>("bidirectional", "", 0, 1),
    parameter_row<&Parameters::zero_first>("zero_first", "", 0, 1),
    parameter_row<&Parameters::temperature_warn_K>("temp_warn", "K", 273, 398),
    parameter_row<&Parameters::voltage_warn_V>("voltage_warn", "V", 0, 80),
    parameter_row<&Parameters::trip_warn_s>("trip_warn_s", "s", 0, 3600),
};

// By name; kParameterRanges.size() when there is none. At compile time for what the checks below speak of.
constexpr std::size_t find_parameter(const char* name) {
  for (std::size_t i = 0; i < kParameterRanges.size(); ++i) {
    const char *a = kParameterRanges[i].name, *b = name;
    while (*a != '\0' && *a == *b) {
      ++a;
      ++b;
    }
    if (*a == *b) return i;
  }
  return kParameterRanges.size();
}

// FNV-1a, 32 bit: what a store keeps of a name, and what a name that is asked for is looked up by.
inline constexpr std::uint32_t kHashStart = 2166136261u;
constexpr std::uint32_t hash_step(std::uint32_t hash, std::uint8_t c) { return (hash ^ c) * 16777619u; }
constexpr std::uint32_t parameter_hash(const char* name) {
  std::uint32_t hash = kHashStart;
  for (; *name != '\0'; ++name) hash = hash_step(hash, static_cast<std::uint8_t>(*name));
  return hash;
}

// Largest electrical speed the observer is verified to: 200 000 electrical RPM.
inline constexpr float kMaxElectricalSpeed_rad_s = 20944.0f;

struct ParameterError {
  std::size_t index = 0;  // into kParameterRanges
  float value = 0.0f;
  float min = 0.0f, max = 0.0f;  // what would be allowed; narrower than the table's when another parameter bounds it
};

// The first parameter that is out of range (NaN is), or that contradicts another one.
constexpr std::optional<ParameterError> check(const Parameters& p) {
  constexpr std::size_t kFeedback = find_parameter("fast_feedback_Hz"), kMaxSpeed = find_parameter("max_speed"),
                        kMinSpeed = find_parameter("min_speed"), kUndervoltage = find_parameter("undervoltage");
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

// Into its range, integers rounded; NaN becomes the default. For what was read from a store or came over the bus.
constexpr float clamp_parameter(const ParameterRange& r, float v) {
  if (!(v == v)) return r.get(Parameters{});
  if (r.kind != ParameterKind::real)
    v = static_cast<float>(static_cast<std::int32_t>(v < -1e6f ? -1e6f : v > 1e6f ? 1e6f : v < 0.0f ? v - 0.5f : v + 0.5f));
  return v < r.min ? r.min : v > r.max ? r.max : v;
}

}  // namespace rotorloop::firmware
