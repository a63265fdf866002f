// The effects that one plant has switched on, and the explicit list of all that exist.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

// All effects of the catalogue that the plant knows, in the order in which they act.
std::span<const EffectInfo* const> builtin_effects();
// Also one of the foreign effects, which no list shows. Null when no effect has this id.
const EffectInfo* find_effect(std::string_view id);
// For messages about an unknown id: "did you mean "a"? use one of: a, b, c".
std::string use_known_effect(std::string_view id);
// The options' fallbacks with `value` as the parameter.
EffectValues effect_values(const EffectInfo& info, double value);

class EffectSet : public BodyLoads {
 public:
  // Switches an effect on. `values` as EffectInfo says; the parameter of an effect whose parameter comes from the drive is not
  // used. Throws Error: unknown id (the text lists the known ones), id given twice, value outside its range.
  void add(std::string_view id, const EffectValues& values);
  void add(std::string_view id, double value);  // options at their fallbacks
  bool has(std::string_view id) const;
  std::size_t size() const { return active_.size(); }

  // The hooks of all that is switched on, in the order of builtin_effects().
  void prepare(PlantSetup& setup);
  void air(const Eigen::Vector3d& p_W_m, double time_s, Air& air) const;
  void rotor_condition(const RotorSite& site, RotorCondition& condition) const;
  void rotor_loads(const RotorSite& site, RotorLoads& loads);
  void add_to(Wrench& wrench, const BodyMotion& motion) const override;
  void advance(const BodyMotion& motion, double dt_s);

 private:
  struct Active {
    const EffectInfo* info;
    std::unique_ptr<Effect> effect;
  };
  std::vector<Active> active_;  // in the order of builtin_effects(), whatever the order of the file
};

}  // namespace rotorloop::sim
