// Electrical angle and the trigonometry of the interrupt: no libm, the same bits on host and target.
#pragma once
#include <cstdint>

namespace rotorloop::firmware {

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

constexpr Rotation rotation(Angle a) {
  const std::uint32_t quadrant = (a.raw + 0x2000'0000u) >> 30;
  const Rotation r = small_rotation(Angle{a.raw - (quadrant << 30)}.rad());
  switch (quadrant & 3u) {
    case 0:
      return r;
    case 1:
      return {-r.sin, r.cos};
    case 2:
      return {-r.cos, -r.sin};
    default:
      return {r.sin, -r.cos};
  }
}

constexpr float clamp(float x, float low, float high) { return x < low ? low : x > high ? high : x; }
constexpr float magnitude(float x) { return x < 0.0f ? -x : x; }
constexpr float sign_of(float x) { return x < 0.0f ? -1.0f : 1.0f; }

}  // namespace rotorloop::firmware
