// What effect tests need: one effect made by id, a rotor site, a body in motion, loads of round numbers.
#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/effects/effect_set.hpp"
#include "sim/effects/plant_setup.hpp"
#include "sim/rotor/bem.hpp"
#include "test/unit/sim/airframe/fixture.hpp"
#include "test/unit/sim/rotor/fixtures.hpp"

namespace rotorloop::sim::test {

// The effect `id` with its parameter, and options by name where given.
inline std::unique_ptr<Effect> make(std::string_view id, double value,
                                    const std::vector<std::pair<std::string_view, double>>& options = {}) {
  const EffectInfo* info = find_effect(id);
  if (!info) throw std::runtime_error("no effect " + std::string(id));
  EffectValues values = effect_values(*info, value);
  for (const auto& [key, v] : options) {
    bool found = false;
    for (std::size_t i = 0; i < info->options.size(); ++i)
      if (info->options[i].key == key) {
        values[i + 1] = v;
        found = true;
      }
    if (!found) throw std::runtime_error("no option " + std::string(key));
  }
  return info->make(values);
}

// The reference body as the plant sets it up.
inline PlantSetup reference_setup() {
  PlantSetup s;
  s.body = reference_body();
  s.body.ground_z_m = 0.0;
  return s;
}

// Forward and left, climbing, rolling and yawing, 30 degrees of heading; rotors at unequal speeds that change.
inline BodyMotion some_motion() {
  BodyMotion m;
  m.time_s = 12.5;
  m.p_W_m = {1.0, -2.0, 1.5};
  m.v_W_m_s = {4.0, 3.0, 1.0};
  m.R_WB = Eigen::AngleAxisd(0.5236, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  m.w_B_rad_s = {1.0, -0.5, 0.7};
  m.v_air_B_m_s = m.R_WB.transpose() * m.v_W_m_s;
  m.density_kg_m3 = 1.2;
  for (std::size_t i = 0; i < 4; ++i)
    m.rotors.add({Eigen::Vector3d::UnitZ(), reference_body().rotors[i].spin, 9.4e-6, i < 2 ? 980.0 : 900.0, i < 2 ? 4000.0 : -3000.0});
  return m;
}

// Rotor `index` of the reference body in `body`'s motion.
inline RotorSite site(std::size_t index, const BodyMotion& body, double omega_rad_s = 945.0) {
  const AirframeConfig c = reference_body();
  RotorSite s;
  s.index = index;
  s.rotor = &rotor();
  s.hub_B_m = c.rotors[index].hub_m;
  s.hub_W_m = body.p_W_m + body.R_WB * s.hub_B_m;
  s.body = &body;
  s.condition.v_R_m_s = body.v_air_B_m_s + body.w_B_rad_s.cross(s.hub_B_m);
  s.condition.w_R_rad_s = body.w_B_rad_s;
  s.condition.omega_rad_s = omega_rad_s;
  s.condition.spin = c.rotors[index].spin;
  s.condition.density_kg_m3 = body.density_kg_m3;
  s.omega_dot_rad_s2 = 1000.0;
  return s;
}

inline RotorLoads some_loads() {
  RotorLoads l;
  l.force_R_N = {-0.2, 0.05, 1.7};
  l.moment_R_N_m = {0.01, -0.02, -0.028};
  l.shaft_torque_N_m = 0.028;
  l.induced_m_s = 7.0;
  return l;
}
// What the rotor of `site` really does.
inline RotorLoads solved(const RotorSite& s) { return solve_cold(*s.rotor, s.condition); }

// What `effect` makes of the rotor: its condition, the solve, its loads, as a step of the plant does it.
inline RotorLoads loads_with(Effect& effect, RotorSite s) {
  RotorCondition c = s.condition;
  effect.rotor_condition(s, c);
  s.condition = c;
  RotorLoads l = s.bare = solved(s);
  effect.rotor_loads(s, l);
  return l;
}

inline Wrench wrench_of(const Effect& effect, const BodyMotion& motion) {
  Wrench w;
  effect.body_loads(motion, w);
  return w;
}

}  // namespace rotorloop::sim::test
