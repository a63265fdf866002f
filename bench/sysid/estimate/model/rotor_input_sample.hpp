// What drives the model at one moment: rotor speeds with their derivatives, battery voltage, the memory of terms.
#pragma once
#include <array>
#include <cstddef>

#include "bench/sysid/estimate/model/parameters.hpp"
#include "host/effects/memory.hpp"

namespace rotorloop::estimate {

class DynamicTermInput;

using MemoryNumbers = std::array<double, host::kMaxMemory>;

inline constexpr std::array<int, 5> kRotorInputParameters{kRotorDelay, kCommandGain, kCommandOffset, kVoltageExponent, kCommandLag};

struct RotorInputSample {
  std::array<double, 4> omega_rad_s{}, omega_dot_rad_s2{};
  // By the parameters in the order of kRotorInputParameters.
  std::array<std::array<double, 4>, 5> omega_by{}, omega_dot_by{};
  double battery_V = 0.0;
  MemoryNumbers memory{};
  // Where the derivatives of the memory stand; nullptr: it has none.
  const DynamicTermInput* dynamic_term_input = nullptr;
  std::size_t memory_row = 0;
  double memory_share = 0.0;
};

}  // namespace rotorloop::estimate
