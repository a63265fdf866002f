// Ground and ceiling: thrust at the same rotor speed grows when the wake cannot leave. The ground is at 0; the
// height of the ceiling comes with the vehicle file, without which it does nothing (LoadGeometry).
// Cheeseman, Bennett 1955 for one rotor (image of a source); Sanchez-Cuevas, Heredia, Ollero 2017 for four with the fountain.
#pragma once
#include <cmath>

#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// Distance to a surface, at least half a radius: below, the law has no meaning.
template <class S>
S at_least_half_a_radius(const S& distance, double radius) {
  return value_of(distance) > 0.5 * radius ? distance : S(0.5 * radius);
}
template <class S>
S hub_height_m(const LoadState<S>& s, std::size_t i) {
  const Vec3<S>& arm = s.rotor[i].arm_B_m;
  const S above = s.in.p_W_m.z + dot(arm, s.in.world_B[2]) - s.geometry.ground_z_m;
  return at_least_half_a_radius(above, s.geometry.radius_m);
}
template <class S>
void confine(const S& gain, RotorLoad<S>& r, const S& image) {
  r.thrust_N = r.thrust_N / (1.0 - gain * image * wake_below(r));
}

struct GroundEffectRotor {
  static constexpr std::string_view kId = "ground_effect_rotor";
  static constexpr TermParameter kParameters[] = {{"gain", "1", 0.0, 5.0, 1.0, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    confine(c[0], s.rotor[i], squared(s.geometry.radius_m * 0.25 / hub_height_m(s, i)));
  }
};

struct GroundEffectVehicle {
  static constexpr std::string_view kId = "ground_effect_vehicle";
  static constexpr TermParameter kParameters[] = {{"gain", "1", 0.0, 2.0, 1.0, 0.0}};
  static constexpr double kFountain = 2.0;  // measured on a quadrotor, Sanchez-Cuevas 2017

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const double R2 = s.geometry.radius_m * s.geometry.radius_m;
    const auto& rotors = s.geometry.rotors;
    const S z = hub_height_m(s, i);
    const auto image_of = [&](double distance2) {  // z / (d² + 4z²)^1.5
      const S a = 4.0 * z * z + distance2;
      return z / (a * square_root(a));
    };
    S image = squared(s.geometry.radius_m * 0.25 / z);
    double longest2 = 0.0;
    for (std::size_t j = 0; j < kRotors; ++j) {
      if (j == i) continue;
      const double d2 = (rotors[j].position_m - rotors[i].position_m).squaredNorm();
      longest2 = d2 > longest2 ? d2 : longest2;
      image += 0.5 * R2 * image_of(d2);
    }
    image += 2.0 * kFountain * R2 * image_of(longest2);
    confine(c[0], s.rotor[i], image);
  }
};

struct CeilingEffect {
  static constexpr std::string_view kId = "ceiling_effect";
  static constexpr TermParameter kParameters[] = {{"gain", "1", 0.0, 2.0, 1.0, 0.0}};
  static constexpr TermTraits kTraits{.can_act = [](const LoadGeometry& g) { return std::isfinite(g.ceiling_z_m); },
                                      .unknown = "the vehicle file names no ceiling",
                                      .needs = "[room] ceiling_z_m in the vehicle file, m"};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const S gap = s.geometry.ceiling_z_m - s.in.p_W_m.z - dot(s.rotor[i].arm_B_m, s.in.world_B[2]);
    if (value_of(gap) < 0.0) return;  // flies above it: a roof, and free air
    confine(c[0], s.rotor[i], squared(s.geometry.radius_m * 0.25 / at_least_half_a_radius(gap, s.geometry.radius_m)));
  }
};

}  // namespace rotorloop::host
