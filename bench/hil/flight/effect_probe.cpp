#include "bench/hil/flight/effect_probe.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/hil/flight/effect_study.hpp"
#include "host/base/constants.hpp"
#include "sim/plant/flight_dynamics.hpp"

namespace rotorloop::hil {
namespace {

constexpr int kSettle = 400;  // evaluations until warm starts and lags of the rotors' loads are at rest

struct Vehicle {
  sim::PlantSetup setup;
  sim::FlightDynamics dynamics;
  std::array<double, 4> omega_rad_s{};
};

Vehicle vehicle(const Inputs& inputs, const std::vector<sim::PlantEffect>& active, const ProbePoint& point) {
  sim::PlantFile plant = inputs.plant;
  plant.effects = active;
  sim::PlantSetup setup = sim::plant_setup(plant, sim::pointers(inputs.rotors), 500'000, 1);
  sim::EffectSet effects = sim::effect_set(plant);
  effects.prepare(setup);
  sim::AirframeState state;
  const double disk_above_com_m = setup.body.rotors[0].hub_m.z() - setup.body.com_offset_m.z();
  state.p_W_m.z() = setup.body.ground_z_m + point.disk_z_m - disk_above_com_m;
  state.v_W_m_s = point.v_B_m_s;
  state.w_B_rad_s = point.w_B_rad_s;
  const std::int64_t release_ns = point.speed_step == 0.0 ? 0 : std::numeric_limits<std::int64_t>::max();
  return {setup, sim::FlightDynamics(setup, sim::pointers(inputs.rotors), std::move(effects), state, release_ns), {}};
}

double thrust_N(const std::array<sim::RotorLoads, 4>& loads) {
  double sum = 0.0;
  for (const auto& l : loads) sum += l.force_R_N.z();
  return sum;
}

// Rotor speed at which the thrust of all rotors is the weight, by the secant method: thrust is nearly quadratic in it.
double hover_omega_rad_s(const Inputs& inputs, const std::vector<sim::PlantEffect>& active, const ProbePoint& point) {
  Vehicle v = vehicle(inputs, active, point);
  const double weight_N = v.setup.body.mass_kg * v.setup.body.gravity_m_s2;
  double omega = 900.0;
  for (int i = 0; i < 12; ++i) {
    v.dynamics.evaluate_rotors(std::array{omega, omega, omega, omega});
    omega *= std::sqrt(weight_N / thrust_N(v.dynamics.loads()));
  }
  return omega;
}

double percent_thrust(const ProbeLoads& with, const ProbeLoads& without) {
  return 100.0 * (thrust_N(with.rotor) / thrust_N(without.rotor) - 1.0);
}
double percent_torque(const ProbeLoads& with, const ProbeLoads& without) {
  return 100.0 * (with.rotor[0].shaft_torque_N_m / without.rotor[0].shaft_torque_N_m - 1.0);
}
double force_x_N(const ProbeLoads& with, const ProbeLoads& without) { return with.force_B_N.x() - without.force_B_N.x(); }
double force_z_N(const ProbeLoads& with, const ProbeLoads& without) { return with.force_B_N.z() - without.force_B_N.z(); }
template <int axis>
double moment_mN_m(const ProbeLoads& with, const ProbeLoads& without) {
  return 1e3 * (with.moment_B_N_m[axis] - without.moment_B_N_m[axis]);
}
double moment_size_mN_m(const ProbeLoads& with, const ProbeLoads& without) {
  return 1e3 * (with.moment_B_N_m - without.moment_B_N_m).norm();
}
double hub_moment_mN_m(const ProbeLoads& with, const ProbeLoads& without) {
  return 1e3 * (with.rotor[0].moment_R_N_m - without.rotor[0].moment_R_N_m).head<2>().norm();
}
double lateral_force_N(const ProbeLoads& with, const ProbeLoads& without) { return (with.force_B_N - without.force_B_N).head<2>().norm(); }
double lean_back_deg(const ProbeLoads& with, const ProbeLoads& without) {
  return kDeg_per_rad * (without.rotor[0].force_R_N.x() - with.rotor[0].force_R_N.x()) / without.rotor[0].force_R_N.z();
}

// Time constant with which the difference in thrust dies away after a jump of speed, from two points 1 ms apart.
double decay_ms(const ProbeLoads& with, const ProbeLoads& without) {
  const double early_N = with.thrust_after_step_N[1] - without.thrust_after_step_N[1];
  const double late_N = with.thrust_after_step_N[3] - without.thrust_after_step_N[3];
  return early_N == 0.0 ? 0.0 : 1.0 / std::log(early_N / late_N);
}

ProbePoint level(double speed_m_s) { return {.v_B_m_s = {speed_m_s, 0.0, 0.0}}; }
ProbePoint vertical(double climb_m_s) { return {.v_B_m_s = {0.0, 0.0, climb_m_s}, .omega_rad_s = 945.0}; }
ProbePoint at_height_in_radii(double z) { return {.disk_z_m = z * 0.0635}; }
ProbePoint rolling(double rate_rad_s) { return {.w_B_rad_s = {rate_rad_s, 0.0, 0.0}}; }

}  // namespace

const std::vector<Probe>& probes() {
  constexpr double k45 = 0.7071067811865476;
  // clang-format off
  static const std::vector<Probe> all{
      {"axial_inflow", "E1", "thrust, climb at 3.1 m/s", "%", -11, -11, vertical(3.1), percent_thrust},
      {"axial_inflow", "E1", "thrust, descent at 3.1 m/s", "%", 9, 9, vertical(-3.1), percent_thrust, {},
       "the reference is momentum theory alone; the solve follows the measured curve of the ring state, which begins at 0.2 v_h"},
      {"translational_lift", "E2", "thrust, 4 m/s level", "%", 3.3, 3.3, level(4), percent_thrust},
      {"translational_lift", "E2", "thrust, 8.5 m/s level", "%", 12.5, 12.5, level(8.5), percent_thrust},
      {"translational_lift", "E2", "thrust, 10.5 m/s level", "%", 17, 17, level(10.5), percent_thrust},
      {"translational_lift", "E2", "thrust, 12 m/s level", "%", 20, 20, level(12), percent_thrust},
      {"rotor_drag", "E3, E5", "force along x, 8.5 m/s level, body interference included", "N", -1.08, -1.01, level(8.5), force_x_N},
      {"parasitic_drag", "E4", "force along x, 8.5 m/s level", "N", -0.40, -0.40, level(8.5), force_x_N},
      {"parasitic_drag", "E4", "force along x, 12 m/s level", "N", -0.79, -0.79, level(12), force_x_N},
      {"parasitic_drag", "E4", "force along z, climb at 3.1 m/s", "N", -0.18, -0.18, vertical(3.1), force_z_N},
      {"soft_flapping", "E7", "thrust leans back, 4 m/s level, articulated", "deg", 1, 3, level(4), lean_back_deg, 1.0},
      {"rotor_rolling_moment", "E8", "hub moment of one rotor, 8.5 m/s level", "mN m", 8, 8, level(8.5), hub_moment_mN_m},
      {"rate_damping", "E9", "moment, roll at 1 rad/s", "mN m", -3.9, -3.9, rolling(1), moment_mN_m<0>},
      {"rate_damping", "E9", "moment, roll at 6.5 rad/s", "mN m", -25, -25, rolling(6.5), moment_mN_m<0>},
      {"rotor_wake_interference", "E10", "moment about y, 8.5 m/s level", "mN m", -57, -19, level(8.5), moment_mN_m<1>},
      {"rotor_wake_thrust_loss", "E10", "moment about y, 8.5 m/s level", "mN m", -57, -19, level(8.5), moment_mN_m<1>},
      {"body_pitch_moment", "E10", "moment about y, 8.5 m/s level", "mN m", -57, -19, level(8.5), moment_mN_m<1>},
      {"sideslip_yaw_moment", "E11", "moment about z, 8.5 m/s, 45 deg of sideslip", "mN m", 20, 40,
       {.v_B_m_s = {8.5 * k45, 8.5 * k45, 0.0}}, moment_mN_m<2>},
      {"hover_interference", "E12", "thrust, hover (survey: few %)", "%", -5, -2, {}, percent_thrust},
      {"blockage_strut", "E13", "thrust, hover", "%", -8, -8, {}, percent_thrust},
      {"ground_effect_rotor", "E14", "thrust, disk 1 R above ground", "%", 6.7, 6.7, at_height_in_radii(1), percent_thrust},
      {"ground_effect_rotor", "E14", "thrust, disk 2 R above ground", "%", 1.6, 1.6, at_height_in_radii(2), percent_thrust},
      {"ground_effect_rotor", "E14", "thrust, disk 3 R above ground", "%", 0.7, 0.7, at_height_in_radii(3), percent_thrust},
      {"ground_effect_vehicle", "E15", "thrust, disks 1 R above ground", "%", 16, 16, at_height_in_radii(1), percent_thrust},
      {"ground_effect_vehicle", "E15", "thrust, disks 2 R above ground", "%", 9, 9, at_height_in_radii(2), percent_thrust},
      {"ground_effect_vehicle", "E15", "thrust, disks 3 R above ground", "%", 6, 6, at_height_in_radii(3), percent_thrust},
      {"ground_effect_vehicle", "E15", "thrust, disks 5 R above ground", "%", 2.6, 2.6, at_height_in_radii(5), percent_thrust},
      {"ceiling_effect", "E16", "thrust, disks 1 R below the ceiling (survey: several %)", "%", 3, 10,
       {.disk_z_m = 3.0 - 0.0635}, percent_thrust},
      {"dynamic_inflow", "E18", "time constant of the thrust after a step of speed, hover", "ms", 1.8, 1.8, {.speed_step = 0.02}, decay_ms},
      {"thrust_speed_exponent", "E22", "thrust over that without, 147 rad/s", "%", -9, -9, {.omega_rad_s = 147.0}, percent_thrust},
      {"rotor_inertia_reaction", "E23", "moment about z, rotor 1 (counter-clockwise) speeds up with 1e4 rad/s2", "mN m", -94, -94,
       {.omega_dot_1_rad_s2 = 1e4}, moment_mN_m<2>},
      {"gyroscopic", "E24", "moment, roll at 6.5 rad/s, pairs at 1.1 and 0.9 of hover speed", "mN m", 23, 23,
       {.w_B_rad_s = {6.5, 0, 0}, .omega_rad_s = 945.0, .speed_ratio = {1.1, 1.1, 0.9, 0.9}}, moment_mN_m<1>},
      {"air_density", "E25", "thrust, 3 K warmer: ratio 0.99", "%", -1, -1, {}, percent_thrust, 0.99},
      {"com_offset", "E26", "moment about y, hover", "mN m", 9.5, 9.5, {}, moment_mN_m<1>},
      {"rotor_tilt", "E26", "horizontal force, hover", "N", 0.03, 0.03, {}, lateral_force_N},
      {"torque_advance", "E27", "torque at 8.5 m/s: 9 % of the profile part, which is near half in hover", "%", 4, 5, level(8.5),
       percent_torque},
      {"rotor_local_inflow", "L1", "moment, roll at 1 rad/s", "mN m", -1.7, -1.7, rolling(1), moment_mN_m<0>},
      {"rotor_plane_height", "L14", "moment, 8.5 m/s level: 20 mm times the force of E3", "mN m", 20, 22, level(8.5), moment_size_mN_m},
  };
  // clang-format on
  return all;
}

ProbeLoads loads_at(const Inputs& inputs, const std::vector<sim::PlantEffect>& active, const ProbePoint& point) {
  Vehicle v = vehicle(inputs, active, point);
  for (std::size_t i = 0; i < 4; ++i) v.omega_rad_s[i] = point.omega_rad_s * point.speed_ratio[i];
  const std::array<double, 4> no_acceleration{};
  for (int k = 0; k < kSettle; ++k) {
    v.dynamics.evaluate_rotors(v.omega_rad_s);
    if (point.speed_step != 0.0) v.dynamics.step(no_acceleration);
  }
  std::array<double, 4> after_N{};
  if (point.speed_step != 0.0) {
    for (double& omega : v.omega_rad_s) omega *= 1.0 + point.speed_step;
    for (double& N : after_N) {
      v.dynamics.evaluate_rotors(v.omega_rad_s);
      v.dynamics.step(no_acceleration);
      N = thrust_N(v.dynamics.loads());
    }
  }
  v.dynamics.step(std::array{point.omega_dot_1_rad_s2, 0.0, 0.0, 0.0});
  const sim::AirframeWrench& w = v.dynamics.airframe().wrench();  // of the start of that step
  return {w.rotor_force_B_N + w.drag_force_B_N + w.further.force_B_N, w.rotor_moment_B_N_m + w.further.moment_B_N_m, v.dynamics.loads(),
          after_N};
}

std::vector<ProbeResult> probe_effects(const Inputs& inputs, const std::vector<const sim::EffectInfo*>& effects) {
  std::vector<ProbeResult> out;
  for (const Probe& p : probes()) {
    const auto it = std::find_if(effects.begin(), effects.end(), [&](const auto* e) { return e->id == p.effect; });
    if (it == effects.end()) continue;
    const sim::EffectInfo& info = **it;
    const double typical = typical_value(info);
    const auto changed = switched(inputs.plant, info, p.value.value_or(typical)).effects;
    const bool in_plant = has_effect(inputs.plant, info, typical);
    const auto& with = in_plant ? inputs.plant.effects : changed;
    const auto& without = in_plant ? changed : inputs.plant.effects;
    ProbePoint point = p.point;
    if (point.omega_rad_s == 0.0) point.omega_rad_s = hover_omega_rad_s(inputs, inputs.plant.effects, point);
    ProbeResult r{std::string(p.effect),
                  std::string(p.source),
                  std::string(p.where),
                  std::string(p.unit),
                  p.value.value_or(is_intrinsic(info, typical) ? info.parameter.neutral : typical),
                  p.low,
                  p.high,
                  0.0,
                  1.0,
                  false,
                  std::string(p.deviation)};
    r.measured = p.size(loads_at(inputs, with, point), loads_at(inputs, without, point));
    const double size = p.low < 0.0 ? -r.measured : r.measured;  // along the sign of the reference
    const double least = std::min(std::abs(p.low), std::abs(p.high)), most = std::max(std::abs(p.low), std::abs(p.high));
    r.ratio = size < least ? size / least : size > most ? size / most : 1.0;
    r.within = r.ratio >= 1.0 / kProbeFactor && r.ratio <= kProbeFactor;
    out.push_back(std::move(r));
  }
  return out;
}

}  // namespace rotorloop::hil
