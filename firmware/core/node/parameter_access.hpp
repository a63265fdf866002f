// How a table of parameters reads and writes the fields of Parameters by number.
#pragma once
#include <cstdint>
#include <type_traits>

#include "firmware/core/interface.hpp"

namespace rotorloop::firmware {

enum class ParameterKind : std::uint8_t { integer, real, boolean };

// When a value that the bus has set is in force.
enum class InForce : std::uint8_t {
  at_rest,   // as soon as the motor is off
  at_start,  // from the next restart on, when it was saved: the motor control takes its constants once
};

struct ParameterRange {
  const char* name;
  const char* unit;
  float min, max;
  float (*get)(const Parameters&);
  void (*set)(Parameters&, float);  // of a value inside the range
  ParameterKind kind;
  InForce in_force = InForce::at_rest;
};

template <auto kMember>
constexpr float get_parameter(const Parameters& p) {
  return static_cast<float>(p.*kMember);
}
template <auto kMember>
constexpr void set_parameter(Parameters& p, float v) {
  using T = std::remove_reference_t<decltype(p.*kMember)>;
  if constexpr (std::is_same_v<T, bool>) {
    p.*kMember = v != 0.0f;
  } else {
    p.*kMember = static_cast<T>(v);
  }
}

template <auto kMember>
constexpr ParameterRange parameter_row(const char* name, const char* unit, float min, float max, InForce in_force = InForce::at_rest) {
  using T = std::remove_cvref_t<decltype(Parameters{}.*kMember)>;
  const ParameterKind kind = std::is_same_v<T, bool>       ? ParameterKind::boolean
                             : std::is_floating_point_v<T> ? ParameterKind::real
                                                           : ParameterKind::integer;
  return {name, unit, min, max, get_parameter<kMember>, set_parameter<kMember>, kind, in_force};
}

// "None" is -1 for people and 255 inside.
constexpr float get_esc_index(const Parameters& p) { return p.esc_index == kNoEscIndex ? -1.0f : static_cast<float>(p.esc_index); }
constexpr void set_esc_index(Parameters& p, float v) { p.esc_index = v < 0.0f ? kNoEscIndex : static_cast<std::uint8_t>(v); }

}  // namespace rotorloop::firmware
