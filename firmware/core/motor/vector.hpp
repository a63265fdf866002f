// Two-axis vectors: Stator (alpha along phase U, beta 90 electrical degrees ahead) and Rotor (d along the magnet, q ahead).
// Amplitude-invariant: a phase peak of 1 A is a vector of length 1 A, hence the 3/2 in power and torque.
#pragma once
#include <array>
#include <cmath>

#include "firmware/core/motor/angle.hpp"

namespace rotorloop::firmware {

struct Stator {
  float a = 0.0f, b = 0.0f;
  friend constexpr Stator operator+(Stator x, Stator y) { return {x.a + y.a, x.b + y.b}; }
  friend constexpr Stator operator-(Stator x, Stator y) { return {x.a - y.a, x.b - y.b}; }
  friend constexpr Stator operator*(float k, Stator x) { return {k * x.a, k * x.b}; }
};
struct Rotor {
  float d = 0.0f, q = 0.0f;
  friend constexpr Rotor operator+(Rotor x, Rotor y) { return {x.d + y.d, x.q + y.q}; }
  friend constexpr Rotor operator-(Rotor x, Rotor y) { return {x.d - y.d, x.q - y.q}; }
  friend constexpr Rotor operator*(float k, Rotor x) { return {k * x.d, k * x.q}; }
  friend constexpr Rotor operator*(Rotation r, Rotor x) { return {r.cos * x.d - r.sin * x.q, r.sin * x.d + r.cos * x.q}; }
};

constexpr Rotor park(Stator x, Rotation at) { return {at.cos * x.a + at.sin * x.b, at.cos * x.b - at.sin * x.a}; }
constexpr Stator inverse_park(Rotor x, Rotation at) { return {at.cos * x.d - at.sin * x.q, at.sin * x.d + at.cos * x.q}; }

constexpr Stator turned(Rotation by, Stator x) { return {by.cos * x.a - by.sin * x.b, by.sin * x.a + by.cos * x.b}; }

using Phases = std::array<float, 3>;
constexpr float kRoot3 = 1.73205080757f;

constexpr Stator clarke(const Phases& x) { return {(2.0f * x[0] - x[1] - x[2]) * (1.0f / 3.0f), (x[1] - x[2]) * (1.0f / kRoot3)}; }
constexpr Phases inverse_clarke(Stator x) { return {x.a, -0.5f * x.a + 0.5f * kRoot3 * x.b, -0.5f * x.a - 0.5f * kRoot3 * x.b}; }

inline float length(Rotor x) { return std::sqrt(x.d * x.d + x.q * x.q); }
inline float length(Stator x) { return std::sqrt(x.a * x.a + x.b * x.b); }

}  // namespace rotorloop::firmware
