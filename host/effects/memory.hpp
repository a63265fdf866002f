// State of a dynamic term: a load on a string still swings after the vehicle stopped, thrust lags behind rotor speed. Such a term
// names its numbers (kMemory) and says how the motion of the body carries them on (advance). To the loads of a moment they are
// known numbers, so a dynamic term adds no state to the fit: the fit, the predictor and the controller each run `advance`.
#pragma once
#include <cstddef>

#include "host/effects/load_state.hpp"

namespace rotorloop::host {

inline constexpr std::size_t kMaxTermMemory = 6;        // numbers of one term
inline constexpr std::size_t kMaxMemory = 24;           // of all terms of a model
inline constexpr std::size_t kMaxMemoryParameters = 8;  // of a term that has memory

// A step of time, seen from both ends. The loads of both were taken with the memory of the beginning.
struct MemoryStep {
  const LoadState<double>&from, &to;
  Vec3<double> acceleration_W_m_s2;  // of the centre of mass, gravity included (0 in hover), mean over the step
  Vec3<double> angular_acceleration_B_rad_s2;
  double dt_s = 0.0;
};

// `c`: the term's parameters; `memory`: its numbers, at the beginning on entry, at the end on return.
using Advance = void (*)(const double* c, const MemoryStep& step, double* memory);

}  // namespace rotorloop::host
