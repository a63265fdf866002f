// What a column of the derivatives belongs to.
#pragma once
#include "bench/sysid/estimate/model/parameters.hpp"
#include "bench/sysid/estimate/model/rotor_input_sample.hpp"

namespace rotorloop::estimate {

inline bool is_dynamics(int parameter) { return parameter <= kTiltY; }

// Place among the parameters of the rotors' input; -1: it is none of them.
inline int input_place(int parameter) {
  for (std::size_t j = 0; j < kRotorInputParameters.size(); ++j) {
    if (kRotorInputParameters[j] == parameter) return static_cast<int>(j);
  }
  return -1;
}

}  // namespace rotorloop::estimate
