// What a switchable physical effect of the plant is. One effect is one file in a folder below; lists.hpp names them all.
//
// An EffectInfo describes the effect (id and parameters as in effects/catalogue.toml) and makes an Effect, which lives for one flight
// and overrides the hooks where its physics acts. A step of the plant (sim/plant/flight_dynamics.hpp) calls them in this order:
//   prepare          once, before the flight: what is fixed about the vehicle, its sensors, ESCs and battery
//   air              wind and density at a place: at each hub and at the centre of mass
//   rotor_condition  what a rotor meets, before the blade-element model
//   rotor_loads      what it then does to its hub and shaft; once per rotor and step, so a state per rotor may live here
//   body_loads       force and moment on the body, at every stage of the integrator (const: see sim/airframe/body_loads.hpp)
//   advance          after the step: the effect's own states
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "sim/airframe/body_loads.hpp"
#include "sim/rotor/rotor_loads.hpp"

namespace rotorloop::sim {

class Rotor;
struct PlantSetup;  // plant_setup.hpp

// One rotor at one instant. Frame R as in sim/rotor/rotor_loads.hpp.
struct RotorSite {
  std::size_t index = 0;                              // from 0: front-right, rear-left, front-left, rear-right
  const Rotor* rotor = nullptr;                       // geometry (radius_m() …) and solver, for effects that ask "what if"
  Eigen::Vector3d hub_B_m = Eigen::Vector3d::Zero();  // from the centre of mass
  Eigen::Vector3d hub_W_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_BR = Eigen::Matrix3d::Identity();
  const BodyMotion* body = nullptr;
  RotorCondition condition;       // as it stands: before the change in rotor_condition, as solved in rotor_loads
  double omega_dot_rad_s2 = 0.0;  // mean over the last step
  RotorLoads bare;                // in rotor_loads: what the blade-element model gave, before any effect on the loads
};

class Effect {
 public:
  virtual ~Effect() = default;
  virtual void prepare(PlantSetup&) {}
  virtual void air(const Eigen::Vector3d& /*p_W_m*/, double /*time_s*/, Air&) const {}
  virtual void rotor_condition(const RotorSite&, RotorCondition&) const {}
  virtual void rotor_loads(const RotorSite&, RotorLoads&) {}
  virtual void body_loads(const BodyMotion&, Wrench&) const {}
  virtual void advance(const BodyMotion&, double /*dt_s*/) {}
};

enum class ParameterOrigin : std::uint8_t {
  effect_entry,  // given with the [[effect]] entry of the plant file
  drive,         // follows from the motor and blade files; giving it again would be a second truth
};

// The number that says how large the effect is.
struct EffectParameter {
  std::string_view key;   // name in files, with unit suffix
  std::string_view unit;  // "1" when dimensionless
  double min;
  double max;
  double neutral;  // the value at which the effect vanishes
  ParameterOrigin origin = ParameterOrigin::effect_entry;
};

// A further number of an effect, which may be left out of the file.
struct EffectOption {
  std::string_view key;
  std::string_view unit;
  double min;
  double max;
  double fallback;       // when the file does not give it
  bool integer = false;  // a count or a rotor number (1 to 4)
};

// Values of one entry: the parameter first, then the options in the order of the EffectInfo.
inline constexpr std::size_t kMaxEffectValues = 8;
using EffectValues = std::array<double, kMaxEffectValues>;

struct EffectInfo {
  std::string_view id;
  EffectParameter parameter;
  std::span<const EffectOption> options;
  std::unique_ptr<Effect> (*make)(const EffectValues& values);
};

// For EffectInfo::make, when an effect is constructed from the values alone.
template <class E>
std::unique_ptr<Effect> make_effect(const EffectValues& values) {
  return std::make_unique<E>(values);
}

}  // namespace rotorloop::sim
