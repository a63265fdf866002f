#include "bench/hil/esc_lab/subject.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

#include "bench/hil/flight/esc_parameters.hpp"
#include "bench/hil/flight/vehicle_figures.hpp"
#include "host/vehicle/model.hpp"
#include "sim/esc/servable_limit.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::esc_lab {
namespace {

constexpr double kInch_m = 0.0254;
constexpr double kLow_V = 3.5, kFull_V = 4.2;  // per cell, as class draws have them

const MotorClass& class_of_propeller(double diameter_inch) {
  // Half-way to the next size.
  constexpr std::array<std::pair<double, std::string_view>, 5> kUpTo{
      {{4.0, "3in"}, {6.0, "5in"}, {8.5, "7in"}, {11.0, "10in"}, {14.5, "12in"}}};
  for (const auto& [inch, name] : kUpTo)
    if (diameter_inch < inch) return *find_motor_class(name);
  return *find_motor_class("17in");
}

LabBoard board_of(const sim::BoardStage& stage) {
  if (stage.name == sim::SmallNativeEsc::stage().name) return LabBoard::small;
  return stage.name == sim::HighVoltageNativeEsc::stage().name ? LabBoard::high_voltage : LabBoard::b_g431b_esc1;
}

std::string limit_text(double limit_A, const sim::ServableLimit& servable) {
  return fmt::format("{:.4g} A; the ESC holds up to {}", limit_A, sim::servable_text(servable));
}

// What stays the same whatever the seed.
struct PlantMotor {
  sim::PlantFile plant;
  const MotorClass* of = nullptr;
  double load_N_m_s2 = 0.0, blade_inertia_kg_m2 = 0.0;
  sim::DriveParameters drive;
};

EscDraw draw_of(const PlantMotor& m, std::uint64_t seed, Knowledge knowledge) {
  EscDraw d;
  d.motor_class = m.of->name;
  d.board = board_of(*m.plant.esc.stage);
  d.start_within_ms = m.of->start_within_ms;
  d.cells = m.plant.battery.cells;
  d.seed = seed;
  d.drive = m.drive;
  d.load_N_m_s2 = m.load_N_m_s2;
  d.bus_V = d.cells * (seed % 2 == 1 ? kLow_V : kFull_V);
  sim::PlantFile told = m.plant;
  told.esc.knowledge = knowledge == Knowledge::data_sheet ? sim::EscKnowledge::data_sheet : sim::EscKnowledge::commissioned;
  host::VehicleModel sheet;  // of which the parameters take these two
  sheet.c_q_N_m_s2 = m.load_N_m_s2;
  sheet.rotor_inertia_kg_m2 = m.drive.motor.inertia_kg_m2 + m.blade_inertia_kg_m2;
  d.firmware = hil::esc_parameters(told, sheet, 0, m.blade_inertia_kg_m2, seed);
  return d;
}

}  // namespace

Subject class_subject(const MotorClass& c) {
  Subject s;
  const sim::BoardStage& stage = with_esc_of(c.board, []<class Esc>() -> const sim::BoardStage& { return Esc::stage(); });
  const sim::ServableLimit servable = sim::servable_limit(stage, c.inductance_H, sim::kFullCell_V * c.cells);
  sim::check_servable(servable, c.phase_limit_A, "", fmt::format("phase current limit of class {}", c.name));
  s.name = fmt::format("{} motors", c.name);
  s.facts = {{"motors", fmt::format("class {}: {:.0f} rpm/V, R, L, flux ± 20 %, J ± 30 %", c.name, c.kv_rpm_V)},
             {"battery", fmt::format("{} cells", c.cells)},
             {"phase current limit", limit_text(c.phase_limit_A, servable)}};
  s.draw = [&c](std::uint64_t seed, Knowledge k) { return draw_esc(c, seed, k); };
  return s;
}

Subject plant_subject(const sim::PlantFile& plant) {
  const sim::SharedRotors rotors = sim::read_rotors(plant);
  const hil::VehicleFigures f = hil::vehicle_figures(plant, rotors);
  if (plant.esc.given) sim::check_servable(f.servable, f.phase_limit_A, plant.path.generic_string(), "esc.phase_current_limit_A");
  auto m = std::make_shared<PlantMotor>();
  m->plant = plant;
  m->plant.drive_faults.clear();
  m->drive = sim::drive_parameters(m->plant, *rotors[0], 0);
  m->blade_inertia_kg_m2 = m->drive.blade_inertia_kg_m2;
  const sim::MotorParameters& motor = m->drive.motor;
  const double hover_rad_s = f.hover_rpm * std::numbers::pi / 30.0;
  const double torque_N_m = 1.5 * motor.pole_pairs * motor.flux_linkage_Wb * f.hover_phase_A - motor.static_friction_N_m;
  m->load_N_m_s2 = torque_N_m / (hover_rad_s * hover_rad_s);
  const double inch = 2.0 * rotors[0]->radius_m() / kInch_m;
  m->of = &class_of_propeller(inch);
  Subject s;
  s.name = plant.name;
  s.facts = {{"plant", plant.path.generic_string()},
             {"motor", fmt::format("{:.0f} rpm/V, {} pole pairs", f.kv_rpm_V, motor.pole_pairs)},
             {"propeller", fmt::format("{:.1f} in; times of the {} class", inch, m->of->name)},
             {"battery", fmt::format("{} cells", plant.battery.cells)},
             {"power stage", std::string(plant.esc.stage->name)},
             {"phase current limit", limit_text(f.phase_limit_A, f.servable)}};
  s.draw = [m](std::uint64_t seed, Knowledge k) { return draw_of(*m, seed, k); };
  return s;
}

}  // namespace rotorloop::esc_lab
