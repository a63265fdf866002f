#include "bench/hil/calibrate/vehicle_sketch.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "host/base/error.hpp"
#include "sim/drive/boards.hpp"

namespace rotorloop::calibrate {
namespace {

constexpr double kPi = std::numbers::pi, kInch_m = 0.0254, kDensity_kg_m3 = kSketchDensity_kg_m3;

// Similarity. Radii of gyration over the distance of a motor from the middle, squared: of the reference quadrotor.
constexpr std::array<double, 3> kGyration{0.225, 0.320, 0.488};
constexpr double kDragXy = 0.0071, kDragZ = 0.0239;  // N s²/m² per kg^(2/3): frontal area goes with mass^(2/3)
constexpr double kBladeInertia_kg_m2 = 1.5e-5;  // two blades of 7 inch; with diameter to the fourth: area times thickness times radius²
constexpr double kBladeInertiaAt_m = 0.1778;
constexpr double kHubHeightShare = 0.22;           // propeller above the middle, over half the wheelbase along one axis
constexpr double kInductancePerFlux_H_Wb = 0.028;  // both go with the turns; 0.012 to 0.044 among the shipped motors
constexpr double kInductanceRatio = 1.15;          // across the magnet over along it
constexpr double kBellOverBlade = 0.6;             // inertia; 0.3 to 1.1 among the shipped vehicles
constexpr double kNoLoad_A = 0.5, kCoggingOverFriction = 0.65;
constexpr double kCapacity_Ah_kg = 2.0, kCellResistance_ohm = 0.006;
constexpr double kStaticThrust = 0.0175;  // c_t over ρ π R⁴; from 0.014 (low pitch) to 0.021
constexpr double kFigureOfMerit = 0.5;
constexpr double kFlowLoss = 3.0;  // of thrust per inflow over tip speed

[[noreturn]] void refuse(const char* option, double value, const char* unit, const char* range, const char* remedy) {
  throw Error({"", fmt::format("{} is {:.4g} {}, allowed is {}", option, value, unit, range), "", remedy});
}

void within(const char* option, double value, double low, double high, const char* unit, const char* remedy) {
  if (!(value >= low && value <= high)) refuse(option, value, unit, fmt::format("{} to {} {}", low, high, unit).c_str(), remedy);
}

// The board for the battery.
const sim::BoardStage& stage(const VehicleSketch& s) {
  for (const char* name : {"small_2s_15a", "b_g431b_esc1"})
    if (const sim::BoardStage& one = *sim::find_board_stage(name); s.cells <= one.most_cells) return one;
  return *sim::find_board_stage("high_voltage_14s_120a");
}

void check(const VehicleSketch& s) {
  within("--mass-kg", s.mass_kg, 0.02, 20.0, "kg", "weigh the vehicle ready to fly");
  within("--wheelbase-mm", 1e3 * s.wheelbase_m, 40.0, 2000.0, "mm", "measure from motor shaft to motor shaft, diagonally");
  within("--propeller (diameter)", s.diameter_m / kInch_m, 1.0, 40.0, "in",
         "give diameter x pitch in inches, as printed on the blade: 6x4.5");
  if (!s.own_blade)
    within("--propeller (pitch)", s.pitch_m / s.diameter_m, 0.3, 1.5, "diameters", "give diameter x pitch in inches: 6x4.5");
  if (s.diameter_m > s.wheelbase_m / std::numbers::sqrt2)
    refuse("--propeller (diameter)", s.diameter_m / kInch_m, "in",
           fmt::format("at most {:.3g} in on this wheelbase, where blades touch", s.wheelbase_m / std::numbers::sqrt2 / kInch_m).c_str(),
           "check wheelbase (diagonal) and diameter");
  within("--kv", s.kv_rpm_V, 50.0, 20000.0, "rpm/V", "give the data sheet's no-load speed per volt");
  within("--resistance-mohm", 1e3 * s.line_resistance_ohm, 2.0, 20000.0, "mΩ", "give the resistance between two leads");
  within("--cells", s.cells, 1, 14, "cells", "give the cells in series");
  if (s.no_load_A != 0.0) within("--no-load-A", s.no_load_A, 0.01, 20.0, "A", "give the data sheet's no-load current");
  within("--current-limit-A", s.current_limit_A, 0.5, stage(s).most_phase_A, "A",
         "give the phase current that the ESC may reach; its power stage shows no more");
  if (s.capacity_Ah != 0.0) within("--capacity-Ah", s.capacity_Ah, 0.05, 100.0, "Ah", "give the battery's capacity");
}

double flux_Wb(const VehicleSketch& s) { return 60.0 / (std::numbers::sqrt3 * 2.0 * kPi * s.kv_rpm_V * s.pole_pairs); }
double blade_inertia(const VehicleSketch& s) {
  if (s.own_blade) return s.blade_inertia_kg_m2;
  return kBladeInertia_kg_m2 * std::pow(s.diameter_m / kBladeInertiaAt_m, 4.0) * s.blades / 2.0;
}
double friction_N_m(const VehicleSketch& s) { return (s.no_load_A > 0.0 ? s.no_load_A : kNoLoad_A) * 60.0 / (2.0 * kPi * s.kv_rpm_V); }

std::string blade_text(const VehicleSketch& s) {
  const double radius = 0.5 * s.diameter_m;
  return fmt::format(
      "# {0:.3g} x {1:.3g} inch, {2} blades, by diameter, pitch and a typical plan form: no measurement of this propeller is in here.\n"
      "# Guesses: chord (15 %), plan form, section, drag scale (1.1 to 1.7), inertia (factor 1.5). `rotorloop rotor fit` makes a blade "
      "from its\n"
      "# geometry and tables, `rotorloop rotor plot` shows this one.\n"
      "format = 1\nblades = {2}\nradius_m = {3:.5g}\nhub_radius_m = {4:.4g}\nblade_inertia_kg_m2 = {5:.3g}\ndrag_scale = 1.3\n"
      "planform = {{ pitch_m = {6:.5g}, chord_m = {7:.4g}, widest = 0.5, root = 0.6, tip = 0.3, most_twist_deg = 34, section = "
      "\"naca4410\" }}\n",
      s.diameter_m / kInch_m, s.pitch_m / kInch_m, s.blades, radius, 0.09 * radius, blade_inertia(s), s.pitch_m, 0.2 * radius);
}

double inductance_d_H(const VehicleSketch& s) { return kInductancePerFlux_H_Wb * flux_Wb(s); }

std::string motor_text(const VehicleSketch& s) {
  const double flux = flux_Wb(s), l = inductance_d_H(s);
  return fmt::format(
      "# A motor of {:.0f} rpm/V by its data sheet. Measure what is marked as a guess, or let the ESC measure it.\n"
      "format = 1\n"
      "resistance_ohm = {:.4g}      # one phase: half of {:.4g} mΩ between leads\n"
      "inductance_H = {{ d = {:.3g}, q = {:.3g} }} # guess from the flux, factor 1.6\n"
      "flux_linkage_Wb = {:.4g} # 60/(sqrt(3)*2*pi*Kv*p)\n"
      "pole_pairs = {}\n"
      "inertia_kg_m2 = {:.3g} # rotor and bell: guess, factor 2\n"
      "static_friction_N_m = {:.3g} # {}\n"
      "cogging_N_m = {:.3g} # amplitude: guess, factor 2\n",
      s.kv_rpm_V, 0.5 * s.line_resistance_ohm, 1e3 * s.line_resistance_ohm, l, kInductanceRatio * l, flux, s.pole_pairs,
      kBellOverBlade * blade_inertia(s), friction_N_m(s),
      s.no_load_A > 0.0 ? fmt::format("{} A without load", s.no_load_A) : fmt::format("guess: {} A without load, factor 2", kNoLoad_A),
      kCoggingOverFriction * friction_N_m(s));
}

struct Corner {
  const char* name;
  int x, y, spin;
};
constexpr std::array<Corner, 4> kCorners{
    {{"front-right", 1, -1, 1}, {"rear-left", -1, 1, 1}, {"front-left", 1, 1, -1}, {"rear-right", -1, -1, -1}}};

struct Body {
  double arm_m, axis_m, height_m;  // from the middle to a motor, along one axis, and the propeller above it
  std::array<double, 3> inertia_kg_m2;
  double drag_xy, drag_z;
};

Body body(const VehicleSketch& s) {
  Body b;
  b.arm_m = 0.5 * s.wheelbase_m;
  b.axis_m = b.arm_m / std::numbers::sqrt2;
  b.height_m = kHubHeightShare * b.axis_m;
  for (std::size_t k = 0; k < 3; ++k) b.inertia_kg_m2[k] = kGyration[k] * s.mass_kg * b.arm_m * b.arm_m;
  b.drag_xy = kDragXy * std::pow(s.mass_kg, 2.0 / 3.0);
  b.drag_z = kDragZ * std::pow(s.mass_kg, 2.0 / 3.0);
  return b;
}

std::string plant_text(const VehicleSketch& s) {
  const Body b = body(s);
  std::string text = fmt::format(
      "# What a simulation takes for true of {}: mass and geometry as measured, inertia (30 %) and drag (30 %) guessed by size.\n"
      "format = 1\nname = \"{} plant\"\n\n[body]\nmass_kg = {}\ninertia_kg_m2 = [{:.3g}, {:.3g}, {:.3g}, 0.0, 0.0, 0.0] # xx yy zz xy xz "
      "yz\n"
      "com_offset_m = [0.0, 0.0, 0.0]\ndrag_area = {{ xy_N_s2_m2 = {:.3g}, z_N_s2_m2 = {:.3g} }}\n",
      s.name, s.name, s.mass_kg, b.inertia_kg_m2[0], b.inertia_kg_m2[1], b.inertia_kg_m2[2], b.drag_xy, b.drag_z);
  for (const Corner& c : kCorners)
    text += fmt::format(
        "\n[[rotor]] # {}\nposition_m = [{:.4g}, {:.4g}, {:.3g}]\nspin = {}\ntilt_deg = [0.0, 0.0]\nblade = "
        "\"blades/propeller.toml\"\nmotor = \"motor.toml\"\n",
        c.name, c.x * b.axis_m, c.y * b.axis_m, b.height_m, c.spin);
  text += fmt::format(
      "\n[battery]\ncells = {}\ncapacity_Ah = {:.3g}\nstate_of_charge = 0.9\nresistance_ohm = {:.3g} # pack and wiring: guess\n"
      "\n[esc]\nstage = \"{}\"\nboard = \"typical\" # a drawn board and motor behind every ESC, one supply for all\nclock = \"own\"\n"
      "parameters = \"data_sheet\"\nphase_current_limit_A = {}\n\n[air]\ndensity_kg_m3 = {}\n",
      s.cells, s.capacity_Ah > 0.0 ? s.capacity_Ah : kCapacity_Ah_kg * s.mass_kg, kCellResistance_ohm * s.cells, stage(s).name,
      s.current_limit_A, kDensity_kg_m3);
  text +=
      "\n[sensors] # as on the reference quadrotor: 200 Hz poses, late, with drift; 1 kHz gyro and accelerometer\n"
      "pose = { rate_Hz = 200, latency_s = 0.015, jitter_s = 0.003, noise_m = 0.002, noise_rad = 0.002, velocity_noise_m_s = 0.05, drift_m "
      "= 0.005, drift_tau_s = "
      "15, offset_m = [0.0, 0.0, 0.0], quaternion_wxyz = [1, 0, 0, 0] }\n"
      "imu = { rate_Hz = 1000, gyro_noise_rad_s = 0.01, accel_noise_m_s2 = 0.15, gyro_bias_rad_s = 0.005, accel_bias_m_s2 = 0.05, "
      "vibration = 1.0 }\n"
      "\n[[effect]]\nid = \"rotor_inertia_reaction\"\n\n[[effect]]\nid = \"gyroscopic\"\n\n[[effect]]\nid = "
      "\"rotor_body_interference\"\nk_H = 1.56 # as on the reference quadrotor\n";
  return text;
}

// The start file knows less than the plant: what flights and calibration are there to find.
std::string vehicle_text(const VehicleSketch& s) {
  const Body b = body(s);
  const double radius = 0.5 * s.diameter_m, c_t = s.own_blade ? s.c_t_N_s2 : kStaticThrust * kDensity_kg_m3 * kPi * std::pow(radius, 4.0);
  const double c_q =
      s.own_blade ? s.c_q_N_m_s2 : std::pow(c_t, 1.5) / (kFigureOfMerit * std::sqrt(2.0 * kDensity_kg_m3 * kPi * radius * radius));
  const double hover_rpm = std::sqrt(s.mass_kg * 9.81 / 4.0 / c_t) * 30.0 / kPi;
  const double inertia = (1.0 + kBellOverBlade) * blade_inertia(s);
  const auto quantity = [](const char* key, double value, double share, const char* origin) {
    return fmt::format("{} = {{ value = {:.4g}, u = {:.2g}, origin = \"{}\" }}\n", key, value, std::fabs(share * value), origin);
  };
  std::string text = fmt::format(
      "# {} before any flight: mass and geometry as measured, the rest guessed by size. `rotorloop calibrate` and `rotorloop identify` "
      "start from it.\n"
      "format = 1\nname = \"{}\"\n\n[body]\n",
      s.name, s.name);
  text += quantity("mass_kg", s.mass_kg, 0.002, "cad");
  const std::array<const char*, 3> axis{"inertia_kg_m2.xx", "inertia_kg_m2.yy", "inertia_kg_m2.zz"};
  for (std::size_t k = 0; k < 3; ++k) text += quantity(axis[k], b.inertia_kg_m2[k], 0.3, "guess");
  text += fmt::format(
      "com_offset_m.x = {{ value = 0.0, u = {0:.2g}, origin = \"guess\" }}\ncom_offset_m.y = {{ value = 0.0, u = {0:.2g}, origin = "
      "\"guess\" }}\n",
      0.02 * b.arm_m);
  for (const Corner& c : kCorners)
    text += fmt::format("\n[[rotor]] # {}\nposition_m = [{:.4g}, {:.4g}, {:.3g}]\nreaction = {}\n", c.name, c.x * b.axis_m, c.y * b.axis_m,
                        b.height_m, -c.spin);
  // k1 - kFlowLoss k1 v_i / (omega R) is c_t in hover. By size: as the shipped vehicles have it; of a blade: so that its own c_t comes out.
  const double inflow_over_tip = std::sqrt(c_t / (2.0 * kDensity_kg_m3 * kPi * std::pow(radius, 4.0)));
  const double k1 = s.own_blade ? c_t / (1.0 - kFlowLoss * inflow_over_tip) : 1.6 * c_t;
  text += "\n[thrust_model]\n" + quantity("k1_N_s2", k1, 0.3, "guess") + quantity("k2_N_s2_m", -kFlowLoss * k1 / radius, 0.5, "guess") +
          fmt::format("radius_m = {:.5g}\nair_density_kg_m3 = {}\nrpm_window = [{:.0f}, {:.0f}]\n", radius, kDensity_kg_m3, 0.4 * hover_rpm,
                      2.0 * hover_rpm);
  text += "\n[torque_model]\n" + quantity("c_q_N_m_s2", c_q, 0.3, "guess") + quantity("rotor_inertia_kg_m2", inertia, 0.5, "guess");
  text += "\n[drag]\n" + quantity("c_dh_s_m", 0.02, 0.5, "guess") + quantity("c_dxy_N_s2_m2", b.drag_xy, 0.5, "guess") +
          quantity("c_dz_N_s2_m2", b.drag_z, 0.5, "guess");
  text +=
      "\n[pose_sensor]\noffset_m = { value = [0.0, 0.0, 0.0], u = [0.001, 0.001, 0.001], origin = \"cad\" }\n"
      "quaternion_wxyz = { value = [1.0, 0.0, 0.0, 0.0], u_rad = [0.002, 0.002, 0.002], origin = \"cad\" }\n"
      "\n[provenance]\nwritten_by = \"rotorloop vehicle new\"\n";
  return text;
}

std::string scenario_text(const VehicleSketch& s) {
  return fmt::format(
      "# {}: out and back, and up and down, with three controllers each.\nformat = 1\nname = \"{}\"\nplant = \"plant.toml\"\nvehicle = "
      "\"calibrated.toml\"\n"
      "seeds = [1, 2, 3]\nvariants = [\"pd_ff\", \"pd_ff_drag\", \"pd_ff_thrust_drag\"]\n\n[controller]\ngains = \"gains.toml\"\n"
      "\n[[flight]]\nname = \"horizontal\"\ntrajectory = \"horizontal.toml\"\n[[flight]]\nname = \"vertical\"\ntrajectory = "
      "\"vertical.toml\"\n"
      "\n[bus]\nesc = \"virtual:\"\nstate = \"virtual:\"\npace = \"lockstep\"\n\n[esc]\nkind = \"native\"\nfast_channel_Hz = 1000\n",
      s.name, s.name);
}

}  // namespace

bool parse_propeller(const std::string& text, VehicleSketch& sketch) {
  double diameter_in = 0.0, pitch_in = 0.0;
  int blades = 2, end = 0;
  if (std::sscanf(text.c_str(), "%lfx%lf%n", &diameter_in, &pitch_in, &end) != 2) return false;
  if (text[static_cast<std::size_t>(end)] == 'x') {
    int more = 0;
    if (std::sscanf(text.c_str() + end, "x%d%n", &blades, &more) != 1) return false;
    end += more;
  }
  if (text.substr(static_cast<std::size_t>(end)) != "" && text.substr(static_cast<std::size_t>(end)) != " in") return false;
  if (blades < 2 || blades > 8) return false;
  sketch.diameter_m = kInch_m * diameter_in;
  sketch.pitch_m = kInch_m * pitch_in;
  sketch.blades = blades;
  return true;
}

sim::ServableLimit sketch_servable(const VehicleSketch& s) {
  return sim::servable_limit(stage(s), 0.5 * (1.0 + kInductanceRatio) * inductance_d_H(s), sim::kFullCell_V * s.cells);
}

SketchFiles sketch_files(const VehicleSketch& s) {
  check(s);
  sim::check_servable(sketch_servable(s), s.current_limit_A, "", "--current-limit-A");
  return {.blade = blade_text(s), .motor = motor_text(s), .plant = plant_text(s), .vehicle = vehicle_text(s), .scenario = scenario_text(s)};
}

}  // namespace rotorloop::calibrate
