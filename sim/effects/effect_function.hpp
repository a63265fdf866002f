// An effect without a state of its own is a function of its values and of what a hook of Effect is given:
//   void rotor_drag(const EffectValues& v, const RotorSite&, RotorLoads& loads);    acts in rotor_loads, by its parameters' types
#pragma once
#include <type_traits>

#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

template <auto Act>
class FunctionEffect final : public Effect {
 public:
  explicit FunctionEffect(const EffectValues& v) : values_(v) {}
  void prepare(PlantSetup& setup) override { act(setup); }
  void air(const Eigen::Vector3d& p_W_m, double time_s, Air& air) const override { act(p_W_m, time_s, air); }
  void rotor_condition(const RotorSite& site, RotorCondition& condition) const override { act(site, condition); }
  void rotor_loads(const RotorSite& site, RotorLoads& loads) override { act(site, loads); }
  void body_loads(const BodyMotion& motion, Wrench& wrench) const override { act(motion, wrench); }

 private:
  template <class... Given>
  void act(Given&... given) const {
    if constexpr (std::is_invocable_v<decltype(Act), const EffectValues&, Given&...>) Act(values_, given...);
  }
  EffectValues values_;
};

// For EffectInfo::make.
template <auto Act>
constexpr auto effect_of = make_effect<FunctionEffect<Act>>;

}  // namespace rotorloop::sim
