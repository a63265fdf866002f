#include "bench/hil/esc_lab/motor_classes.hpp"

#include <algorithm>
#include <array>
#include <numbers>

#include "host/base/random.hpp"

namespace rotorloop::esc_lab {
namespace {

using enum LabBoard;

// Sizes and masses of the class: 1404, 2306, 2806.5, 3508, 4006, 6008, 5208 gimbal. Propeller torque by size from the reference
// three-blade (3, 5, 7 inch) and from C_P = 0.045 (10, 12, 17 inch).
constexpr std::array<MotorClass, 7> kClasses = {{
    {"3in", b_g431b_esc1, 4, 3800, 6, 0.055, 8e-6, 2.9e-7, 4.3e-7, 2.3e-9, 0.7e-3, 0.4e-3, 25.0, 600.0},
    {"5in", b_g431b_esc1, 4, 2300, 7, 0.060, 15e-6, 5.0e-6, 4.4e-6, 2.9e-8, 1.5e-3, 1.0e-3, 40.0, 600.0},
    {"7in", b_g431b_esc1, 6, 1300, 7, 0.035, 18e-6, 9.0e-6, 1.5e-5, 1.2e-7, 3.0e-3, 2.0e-3, 40.0, 600.0},
    {"10in", b_g431b_esc1, 6, 580, 7, 0.060, 35e-6, 1.5e-5, 5.5e-5, 2.3e-7, 5.0e-3, 4.0e-3, 35.0, 1000.0},
    {"12in", b_g431b_esc1, 6, 380, 12, 0.090, 45e-6, 2.2e-5, 8.0e-5, 5.7e-7, 6.0e-3, 4.0e-3, 30.0, 1000.0},
    {"17in", high_voltage, 12, 170, 14, 0.045, 60e-6, 1.6e-4, 4.2e-4, 3.0e-6, 15.0e-3, 10.0e-3, 60.0, 1500.0},
    {"gimbal", b_g431b_esc1, 4, 90, 7, 5.0, 2.0e-3, 6.0e-5, 0.0, 1.0e-6, 5.0e-3, 4.0e-3, 2.0, 1500.0},
}};

constexpr std::uint64_t kDrawStream = 0x45534453;

double flux_Wb(const MotorClass& c) { return 60.0 / (std::numbers::sqrt3 * 2.0 * std::numbers::pi * c.kv_rpm_V * c.pole_pairs); }

// What stays the same however the motor's numbers were found: limits of board, supply and motor.
firmware::Parameters limits_for(const MotorClass& c, int cells) {
  firmware::Parameters p;
  p.pole_pairs = static_cast<std::uint8_t>(c.pole_pairs);
  p.phase_current_limit_A = static_cast<float>(c.phase_limit_A);
  p.bus_current_limit_A = p.regen_current_limit_A = static_cast<float>(c.phase_limit_A);
  const double fastest_rad_s = std::min(200e3 / c.pole_pairs, 1.05 * 4.2 * cells * c.kv_rpm_V) * std::numbers::pi / 30.0;
  p.max_speed_rad_s = static_cast<float>(fastest_rad_s);
  p.min_speed_rad_s = static_cast<float>(std::min(105.0, 0.08 * fastest_rad_s));
  p.undervoltage_V = 3.0f * static_cast<float>(cells);
  p.overvoltage_V = c.board == high_voltage ? 62.0f : 28.0f;
  return p;
}

}  // namespace

std::span<const MotorClass> motor_classes() { return kClasses; }

const MotorClass* find_motor_class(std::string_view name) {
  for (const MotorClass& c : kClasses)
    if (c.name == name) return &c;
  return nullptr;
}

const MotorClass& class_of_trial(std::uint64_t index, std::uint64_t trials) {
  const std::uint64_t in_turn = std::max<std::uint64_t>(trials / 15, 1) * kClasses.size();
  return index < in_turn ? kClasses[index % kClasses.size()] : *find_motor_class("5in");
}

EscDraw draw_esc(const MotorClass& c, std::uint64_t seed, Knowledge knowledge) {
  EscDraw d;
  d.motor_class = c.name;
  d.board = c.board;
  d.start_within_ms = c.start_within_ms;
  d.seed = seed;
  const RandomStream random(seed, kDrawStream);
  const auto within = [&](std::uint64_t k, double share) { return 1.0 - share + 2.0 * share * random.uniform(k); };
  const auto half_to_twice = [&](std::uint64_t k) { return exp_exact((2.0 * random.uniform(k) - 1.0) * std::numbers::ln2); };

  d.drive = sim::on_stage({}, with_esc_of(c.board, []<class Esc>() -> const sim::BoardStage& { return Esc::stage(); }));
  sim::MotorParameters& m = d.drive.motor;
  m.resistance_ohm = c.resistance_ohm * within(0, 0.2);
  m.inductance_H.d = m.inductance_H.q = c.inductance_H * within(1, 0.2);
  m.flux_linkage_Wb = flux_Wb(c) * within(2, 0.2);
  m.pole_pairs = c.pole_pairs;
  const double inertia = within(3, 0.3);
  m.inertia_kg_m2 = c.rotor_inertia_kg_m2 * inertia;
  d.drive.blade_inertia_kg_m2 = c.blade_inertia_kg_m2 * inertia;
  m.static_friction_N_m = c.static_friction_N_m * half_to_twice(4);
  m.cogging_N_m = c.cogging_N_m * half_to_twice(5);
  d.load_N_m_s2 = c.load_N_m_s2;
  const int cells = c.name == "gimbal" && seed % 4 < 2 ? 3 : c.cells;
  d.cells = cells;
  d.bus_V = cells * (seed % 2 == 1 ? 3.5 : 4.2);

  firmware::Parameters& p = d.firmware = limits_for(c, cells);
  p.load_N_m_s2 = static_cast<float>(c.load_N_m_s2);
  const bool sheet = knowledge == Knowledge::data_sheet;
  const double true_J = m.inertia_kg_m2 + d.drive.blade_inertia_kg_m2, class_J = c.rotor_inertia_kg_m2 + c.blade_inertia_kg_m2;
  p.resistance_ohm = static_cast<float>(sheet ? c.resistance_ohm : m.resistance_ohm * within(10, 0.05));
  p.inductance_H = static_cast<float>(sheet ? c.inductance_H : m.inductance_H.d * within(11, 0.05));
  p.flux_linkage_Wb = static_cast<float>(sheet ? flux_Wb(c) : m.flux_linkage_Wb * within(12, 0.05));
  p.inertia_kg_m2 = static_cast<float>(sheet ? class_J : true_J * within(13, 0.08));
  return d;
}

}  // namespace rotorloop::esc_lab
