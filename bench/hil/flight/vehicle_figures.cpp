#include "bench/hil/flight/vehicle_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "bench/hil/flight/esc_parameters.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {

constexpr double kRad_s = std::numbers::pi / 30.0;  // per RPM
constexpr double kLowCell_V = 3.5;
// Phase amplitude over supply: 1/sqrt 3 of space vector modulation less 8 % for sampling windows and dead times.
constexpr double kModulation = 0.577 * 0.92;
constexpr double kLeastThrustToWeight = 1.3;

struct Point {
  double thrust_N = 0.0, torque_N_m = 0.0, phase_A = 0.0, phase_V = 0.0, power_W = 0.0;
};

// One rotor and its motor in still air, steady.
Point at_speed(const sim::PlantFile& plant, const sim::Rotor& rotor, double omega_rad_s) {
  sim::RotorCondition c;
  c.omega_rad_s = omega_rad_s;
  c.density_kg_m3 = plant.density_kg_m3;
  sim::RotorWarmStart warm;
  const sim::RotorLoads loads = sim::solve_rotor(rotor, c, warm);
  const sim::MotorFile& m = plant.rotors[0].motor;
  const double w_e = omega_rad_s * m.pole_pairs, r = m.resistance_ohm + plant.esc.stage->inverter.switch_resistance_ohm;
  Point p;
  p.thrust_N = loads.force_R_N.z();
  p.torque_N_m = loads.shaft_torque_N_m + m.static_friction_N_m;
  p.phase_A = p.torque_N_m / (1.5 * m.pole_pairs * m.flux_linkage_Wb);
  p.phase_V = std::hypot(w_e * m.flux_linkage_Wb + r * p.phase_A, w_e * m.inductance_q_H * p.phase_A);
  p.power_W = 1.5 * p.phase_A * (w_e * m.flux_linkage_Wb + r * p.phase_A);
  return p;
}

// From `hover` up: the current that the phase limit and the bridge leave, less what carries the rotor already, over all that turns.
double slew_rad_s2(const sim::PlantFile& plant, const sim::Rotor& rotor, const Point& hover, double omega_rad_s, double most_V) {
  const sim::MotorFile& m = plant.rotors[0].motor;
  const double w_e = omega_rad_s * m.pole_pairs, r = m.resistance_ohm + plant.esc.stage->inverter.switch_resistance_ohm;
  const double by_voltage_A = (most_V - w_e * m.flux_linkage_Wb) / r;
  const double torque_N_m = 1.5 * m.pole_pairs * m.flux_linkage_Wb * std::min(plant.esc.phase_current_limit_A, by_voltage_A);
  return (torque_N_m - hover.torque_N_m) / (m.inertia_kg_m2 + rotor.blade_inertia_kg_m2());
}

// Highest speed that `holds`, which holds below it.
template <class Holds>
double highest(double most_rad_s, const Holds& holds) {
  if (holds(most_rad_s)) return most_rad_s;
  double low = 0.0, high = most_rad_s;
  for (int k = 0; k < 40; ++k) (holds(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

// Of the ESC that holds the least; named where the four differ.
sim::ServableLimit least_servable(const sim::PlantFile& plant, double bus_V) {
  std::array<sim::ServableLimit, sim::kAirframeRotors> of;
  for (std::size_t i = 0; i < of.size(); ++i) {
    of[i] = sim::servable_limit(*plant.esc.stage, nominal_inductance_H(plant, i), bus_V);
    of[i].rotor = static_cast<int>(i) + 1;
  }
  const auto [least, most] = std::minmax_element(of.begin(), of.end(), [](const auto& a, const auto& b) { return a.limit_A < b.limit_A; });
  sim::ServableLimit found = *least;
  if (least->limit_A == most->limit_A) found.rotor = 0;
  return found;
}

[[noreturn]] void cannot(const Scenario& s, const std::string& what, const char* likely, const std::string& remedy) {
  throw Error({s.plant.generic_string(), what, likely, remedy});
}

}  // namespace

VehicleFigures vehicle_figures(const sim::PlantFile& plant, const sim::SharedRotors& rotors) {
  const sim::Rotor& rotor = *rotors[0];
  const double weight_N = plant.body.mass_kg * kGravity_m_s2, low_V = kLowCell_V * plant.battery.cells;
  VehicleFigures f;
  f.kv_rpm_V = sim::speed_constant_rpm_V(plant.rotors[0].motor);
  f.phase_limit_A = plant.esc.phase_current_limit_A;
  f.empty_V = kEmptyCell_V * plant.battery.cells;
  f.full_V = kFullCell_V * plant.battery.cells;
  f.stage_V = plant.esc.stage->most_bus_V;
  f.servable = least_servable(plant, f.full_V);
  const double esc_rad_s = highest_esc_speed_rad_s(plant.rotors[0].motor, plant.battery.cells);
  f.esc_max_rpm = esc_rad_s / kRad_s;
  const double hover_rad_s = highest(esc_rad_s, [&](double w) { return at_speed(plant, rotor, w).thrust_N <= 0.25 * weight_N; });
  const Point hover = at_speed(plant, rotor, hover_rad_s);
  f.hover_rpm = hover_rad_s / kRad_s;
  f.hover_phase_A = hover.phase_A;
  f.hover_bus_A = 4.0 * hover.power_W / low_V;
  f.hover_voltage_share = hover.phase_V / (kModulation * low_V);
  f.hover_slew_rad_s2 = slew_rad_s2(plant, rotor, hover, hover_rad_s, kModulation * low_V);
  const double top_rad_s = highest(esc_rad_s, [&](double w) {
    const Point p = at_speed(plant, rotor, w);
    return p.phase_A <= f.phase_limit_A && p.phase_V <= kModulation * low_V && p.power_W <= f.phase_limit_A * low_V;
  });
  f.top_rpm = top_rad_s / kRad_s;
  f.thrust_to_weight = 4.0 * at_speed(plant, rotor, top_rad_s).thrust_N / weight_N;
  return f;
}

std::string figures_text(const VehicleFigures& f) {
  return fmt::format(
      "  motor    {:.0f} rpm/V; hover {:.0f} RPM at {:.1f} A per motor, {:.1f} A from the battery, {:.0f} % of the voltage at 3.5 V per "
      "cell\n"
      "           top {:.0f} RPM, thrust-to-weight {:.2f}, both at 3.5 V per cell\n"
      "  ESC      {:.1f} A phase current limit (it holds up to {}), speed up to {:.0f} RPM; battery {:.1f} to {:.1f} V, stage up to {:.1f} "
      "V\n",
      f.kv_rpm_V, f.hover_rpm, f.hover_phase_A, f.hover_bus_A, 100.0 * f.hover_voltage_share, f.top_rpm, f.thrust_to_weight,
      f.phase_limit_A, sim::servable_text(f.servable), f.esc_max_rpm, f.empty_V, f.full_V, f.stage_V);
}

void check_figures(const Scenario& s, const Inputs& inputs, const VehicleFigures& f) {
  if (inputs.plant.esc.given) sim::check_servable(f.servable, f.phase_limit_A, s.plant.generic_string(), "esc.phase_current_limit_A");
  if (f.thrust_to_weight < kLeastThrustToWeight)
    cannot(s,
           fmt::format("thrust-to-weight {:.2f} at 3.5 V per cell ({:.0f} RPM within {:.1f} A), needed is {}", f.thrust_to_weight,
                       f.top_rpm, f.phase_limit_A, kLeastThrustToWeight),
           "too small a propeller, too few cells, or a motor of another speed constant", "change blade, motor, cells or mass");
  // The sixth above hover keeps attitude authority; a motor that hovers in its limit has none.
  if (f.hover_phase_A > 0.85 * f.phase_limit_A)
    cannot(s,
           fmt::format("hover needs {:.1f} A of the phase current limit of {:.1f} A, at most 85 % leaves room to steer", f.hover_phase_A,
                       f.phase_limit_A),
           "", "raise esc.phase_current_limit_A within the stage, or take a motor of a lower speed constant");
  if (!inputs.plant.esc.given) return;  // the reference's speed limit is that of its gains
  if (inputs.gains.omega_max_rad_s > f.esc_max_rpm * kRad_s)
    throw Error({s.gains.generic_string(),
                 fmt::format("limits.omega_max_rad_s = {:.0f} rad/s is beyond what the ESCs follow, {:.0f} rad/s (200 000 electrical RPM, "
                             "and Kv times the full battery)",
                             inputs.gains.omega_max_rad_s, f.esc_max_rpm * kRad_s),
                 "", "lower it, or take a motor of fewer pole pairs or a higher speed constant"});
  if (inputs.gains.omega_min_rad_s > 0.8 * f.hover_rpm * kRad_s)
    throw Error(
        {s.gains.generic_string(),
         fmt::format("limits.omega_min_rad_s = {:.0f} rad/s is above 80 % of hover speed, {:.0f} rad/s: the vehicle could not descend",
                     inputs.gains.omega_min_rad_s, f.hover_rpm * kRad_s),
         "gains of a smaller vehicle", "give about a third of hover speed"});
}

std::string checked_vehicle_text(const Scenario& scenario) {
  const Inputs inputs = read_inputs(scenario);
  const VehicleFigures figures = vehicle_figures(inputs.plant, inputs.rotors);
  check_figures(scenario, inputs, figures);
  return figures_text(figures);
}

}  // namespace rotorloop::hil
