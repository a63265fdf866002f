#include "sim/plant/flight_dynamics.hpp"

#include <algorithm>
#include <utility>

namespace rotorloop::sim {

FlightDynamics::FlightDynamics(const PlantSetup& setup, const Rotors& rotors, EffectSet effects, const AirframeState& initial,
                               std::int64_t release_ns)
    : airframe_(setup.body, initial, release_ns), rotors_(rotors), effects_(std::move(effects)) {}

Air FlightDynamics::air_at(const Eigen::Vector3d& p_W_m) const {
  Air air = airframe_.air();
  effects_.air(p_W_m, static_cast<double>(airframe_.state().time_ns) * 1e-9, air);
  return air;
}

void FlightDynamics::evaluate_rotors(std::span<const double, kAirframeRotors> omega_rad_s) {
  std::copy(omega_rad_s.begin(), omega_rad_s.end(), omega_rad_s_.begin());
  const BodyMotion body = airframe_.motion(air_at_body(), airframe_.momentum(omega_rad_s_, omega_dot_rad_s2_));
  std::array<RotorSite, kAirframeRotors> sites;
  for (std::size_t i = 0; i < kAirframeRotors; ++i) {
    RotorSite& s = sites[i];
    s.index = i;
    s.rotor = rotors_[i];
    s.hub_B_m = airframe_.hub_B_m(i);
    s.hub_W_m = airframe_.hub_W_m(i);
    s.R_BR = airframe_.R_BR(i);
    s.body = &body;
    s.omega_dot_rad_s2 = omega_dot_rad_s2_[i];
    s.condition = airframe_.rotor_condition(i, omega_rad_s_[i], air_at(s.hub_W_m));
    RotorCondition changed = s.condition;
    effects_.rotor_condition(s, changed);
    s.condition = changed;
  }
  std::array<RotorJob, kAirframeRotors> jobs;
  for (std::size_t i = 0; i < kAirframeRotors; ++i) jobs[i] = {rotors_[i], sites[i].condition, &warm_[i], {}};
  solve_rotors(jobs);
  for (std::size_t i = 0; i < kAirframeRotors; ++i) loads_[i] = sites[i].bare = jobs[i].loads;
  for (std::size_t i = 0; i < kAirframeRotors; ++i) effects_.rotor_loads(sites[i], loads_[i]);
}

AirframeStatus FlightDynamics::step(std::span<const double, kAirframeRotors> omega_dot_rad_s2) {
  std::copy(omega_dot_rad_s2.begin(), omega_dot_rad_s2.end(), omega_dot_rad_s2_.begin());
  const Air air = air_at_body();
  const AirframeStatus status = airframe_.step(loads_, omega_rad_s_, omega_dot_rad_s2_, air, &effects_);
  effects_.advance(airframe_.motion(air, airframe_.momentum(omega_rad_s_, omega_dot_rad_s2_)),
                   static_cast<double>(airframe_.config().step_ns) * 1e-9);
  return status;
}

}  // namespace rotorloop::sim
