// The effects that one plant has switched on, and the explicit list of all that exist.
#pragma once
#include <array>
#include <span>
#include <string>
#include <string_view>

#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

// All effects that the plant knows, in the order in which they act.
std::span<const Effect* const> builtin_effects();
// Null when no effect has this id.
const Effect* find_effect(std::string_view id);
// "a, b, c": for messages.
std::string known_effect_ids();

class EffectSet {
 public:
  // Switches an effect on. `value` is its parameter; for an effect whose parameter comes from the drive it is not used.
  // Throws Error: unknown id (the text lists the known ones), id given twice, value outside the range.
  void add(std::string_view id, double value);
  bool has(std::string_view id) const;
  std::size_t size() const { return count_; }

  void apply(RotorLoads& loads) const;
  // Moment on the body, frame B.
  Eigen::Vector3d moment_B_N_m(const RotorMomentum& rotors, const Eigen::Vector3d& w_B_rad_s) const;

 private:
  struct Active {
    const Effect* effect = nullptr;
    double value = 0.0;
  };
  static constexpr std::size_t kCapacity = 32;
  std::array<Active, kCapacity> active_{};  // in the order of builtin_effects(), whatever the order of the file
  std::size_t count_ = 0;
};

}  // namespace rotorloop::sim
