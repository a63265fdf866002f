// The flying vehicle of a plant without its ESCs: airframe, four rotors and the effects that the plant has switched on, advanced
// together. Shaft speeds come in, shaft torques go out.
//
//   dynamics.evaluate_rotors(omega);          // loads at the present state
//   … the drives turn the shafts over one step against loads()[i].shaft_torque_N_m …
//   dynamics.step(mean angular accelerations);
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "sim/airframe/airframe.hpp"
#include "sim/effects/effect_set.hpp"
#include "sim/effects/plant_setup.hpp"
#include "sim/plant/assemble.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::sim {

class FlightDynamics {
 public:
  // `setup` as effects.prepare() left it. `rotors` must outlive this. Launch stand and errors as Airframe's constructor.
  FlightDynamics(const PlantSetup& setup, const Rotors& rotors, EffectSet effects, const AirframeState& initial,
                 std::int64_t release_ns = 0);

  // Solves all four rotors at the present state and lets the effects act on their loads. Call once per step.
  void evaluate_rotors(std::span<const double, kAirframeRotors> omega_rad_s);
  // As evaluate_rotors left them, effects included; frame R of each rotor. Zero before the first evaluation: propellers off.
  const std::array<RotorLoads, kAirframeRotors>& loads() const { return loads_; }

  // Advances by one airframe step with the loads of the last evaluation. omega_dot: mean over the step.
  AirframeStatus step(std::span<const double, kAirframeRotors> omega_dot_rad_s2);

  const Airframe& airframe() const { return airframe_; }
  const EffectSet& effects() const { return effects_; }
  // Air at the centre of mass.
  Air air_at_body() const { return air_at(airframe_.state().p_W_m); }

 private:
  Air air_at(const Eigen::Vector3d& p_W_m) const;

  Airframe airframe_;
  Rotors rotors_;
  EffectSet effects_;
  std::array<RotorWarmStart, kAirframeRotors> warm_{};
  std::array<RotorLoads, kAirframeRotors> loads_{};
  std::array<double, kAirframeRotors> omega_rad_s_{}, omega_dot_rad_s2_{};
};

}  // namespace rotorloop::sim
