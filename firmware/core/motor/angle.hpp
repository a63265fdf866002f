// Electrical angle and the trigonometry of the interrupt: no libm, the same bits on host and target.
#pragma once
#include <bit>
#include <cstdint>

namespace rotorloop::firmware {

// On the target the interrupt lies in a memory of 10 KB: what it needs in several places stands there once. A host has room, and is
// faster with copies.
#ifdef __arm__
#define ROTORLOOP_ONE_COPY [[gnu::noinline]]
#else
#define ROTORLOOP_ONE_COPY
#endif

constexpr float kPi = 3.14159265358979f;

struct Rotation {
  float cos = 1.0f, sin = 0.0f;
};
constexpr Rotation operator*(Rotation a, Rotation b) { return {a.cos * b.cos - a.sin * b.sin, a.sin * b.cos + a.cos * b.sin}; }
constexpr Rotation conjugate(Rotation r) { return {r.cos, -r.sin}; }

// Sine and cosine for |x| <= pi/4; errors below 4e-7.
constexpr Rotation small_rotation(float x) {
  const float z = x * x;
  return {1.0f - z * (0.5f - z * (1.0f / 24 - z * (1.0f / 720 - z * (1.0f / 40320)))),
          x * (1.0f - z * (1.0f / 6 - z * (1.0f / 120 - z * (1.0f / 5040))))};
}

// An angle as a 32-bit fraction of a turn: it wraps by itself and never loses precision as it runs.
struct Angle {
  std::uint32_t raw = 0;

  static constexpr float kRaw_per_rad = 4294967296.0f / (2.0f * kPi);
  // |x| < pi
  static constexpr Angle from_rad(float x) { return {static_cast<std::uint32_t>(static_cast<std::int32_t>(x * kRaw_per_rad))}; }
  constexpr float rad() const { return static_cast<float>(static_cast<std::int32_t>(raw)) * (1.0f / kRaw_per_rad); }  // -pi..pi
  friend constexpr Angle operator+(Angle a, Angle b) { return {a.raw + b.raw}; }
  friend constexpr Angle operator-(Angle a, Angle b) { return {a.raw - b.raw}; }
  friend constexpr bool operator==(Angle, Angle) = default;
};

// Quarter turns swap sine and cosine and change signs. By bits and without a branch: which quarter comes next is what no branch
// prediction knows.
ROTORLOOP_ONE_COPY constexpr Rotation rotation(Angle a) {
  const std::uint32_t quadrant = (a.raw + 0x2000'0000u) >> 30;
  const Rotation r = small_rotation(Angle{a.raw - (quadrant << 30)}.rad());
  const std::uint32_t cos = std::bit_cast<std::uint32_t>(r.cos), sin = std::bit_cast<std::uint32_t>(r.sin);
  const std::uint32_t swapped = (cos ^ sin) & (0u - (quadrant & 1u));  // what changes when they are exchanged
  const std::uint32_t minus_cos = ((quadrant + 1u) & 2u) << 30, minus_sin = (quadrant & 2u) << 30;
  return {std::bit_cast<float>(cos ^ swapped ^ minus_cos), std::bit_cast<float>(sin ^ swapped ^ minus_sin)};
}

// Two selects in a row, which a compiler can turn into minimum and maximum. low <= high.
constexpr float clamp(float x, float low, float high) {
  const float raised = x < low ? low : x;
  return raised > high ? high : raised;
}
constexpr float magnitude(float x) { return __builtin_fabsf(x); }
constexpr float sign_of(float x) { return x < 0.0f ? -1.0f : 1.0f; }

}  // namespace rotorloop::firmware
