#include "bench/hil/flight/esc_parameters.hpp"

#include <algorithm>
#include <numbers>

#include "host/base/random.hpp"

namespace rotorloop::hil {
namespace {

constexpr std::uint64_t kSheetStream = 0x45535041, kCommissioningStream = 0x45535042;
constexpr double kMost_eRPM = 200e3, kMost_rad_s = 3430.0;  // the latter: range of the fast channel, 32 766 RPM

struct MotorNumbers {
  double resistance_ohm, inductance_H, flux_linkage_Wb, inertia_kg_m2, load_N_m_s2;
  int pole_pairs;
};

struct Tolerance {
  double electrical, inertia, load;
};

MotorNumbers with_errors(MotorNumbers m, const RandomStream& random, const Tolerance& by) {
  const auto within = [&](std::uint64_t k, double share) { return 1.0 - share + 2.0 * share * random.uniform(k); };
  m.resistance_ohm *= within(0, by.electrical);
  m.inductance_H *= within(1, by.electrical);
  m.flux_linkage_Wb *= within(2, by.electrical);
  m.inertia_kg_m2 *= within(3, by.inertia);
  m.load_N_m_s2 *= within(4, by.load);
  return m;
}

// The overvoltage limit leaves room for braking above the fullest battery that the stage takes.
double overvoltage_V(const sim::BoardStage& stage) {
  return stage.most_cells == 6 ? 28.0 : std::min(0.85 * stage.most_bus_V, 1.1 * kFullCell_V * stage.most_cells);
}

MotorNumbers known_motor(const sim::PlantFile& plant, const host::VehicleModel& vehicle, std::size_t esc, double blade_inertia_kg_m2,
                         std::uint64_t seed) {
  const sim::MotorFile& f = plant.rotors[esc].motor;
  MotorNumbers known{f.resistance_ohm, nominal_inductance_H(plant, esc), f.flux_linkage_Wb, vehicle.rotor_inertia_kg_m2, vehicle.c_q_N_m_s2,
                     f.pole_pairs};
  switch (plant.esc.knowledge) {
    case sim::EscKnowledge::motor_file:
      return known;
    case sim::EscKnowledge::data_sheet:
      return with_errors(known, RandomStream(seed, kSheetStream), {0.20, 0.30, 0.0});
    // As far off as the ESC's own commissioning may be; docs/acceptance/esc_commissioning.md has what it leaves.
    case sim::EscKnowledge::commissioned:
      known.inertia_kg_m2 = f.inertia_kg_m2 + blade_inertia_kg_m2;
      return with_errors(known, RandomStream(seed, (static_cast<std::uint64_t>(esc) << 32) | kCommissioningStream), {0.05, 0.08, 0.10});
    case sim::EscKnowledge::file:
      break;
  }
  const sim::EscFileValues& v = plant.esc.file;
  return {v.resistance_ohm, v.inductance_H, v.flux_linkage_Wb, v.inertia_kg_m2, v.load_N_m_s2, v.pole_pairs};
}

}  // namespace

double nominal_inductance_H(const sim::PlantFile& plant, std::size_t esc) {
  const sim::MotorFile& f = plant.rotors[esc].motor;
  switch (plant.esc.knowledge) {
    case sim::EscKnowledge::motor_file:
      return f.inductance_d_H;
    case sim::EscKnowledge::data_sheet:
    case sim::EscKnowledge::commissioned:
      return 0.5 * (f.inductance_d_H + f.inductance_q_H);
    case sim::EscKnowledge::file:
      break;
  }
  return plant.esc.file.inductance_H;
}

double highest_esc_speed_rad_s(const sim::MotorFile& motor, int cells) {
  const double rpm = std::min(kMost_eRPM / motor.pole_pairs, 1.05 * kFullCell_V * cells * sim::speed_constant_rpm_V(motor));
  return std::min(kMost_rad_s, rpm * std::numbers::pi / 30.0);
}

firmware::Parameters esc_parameters(const sim::PlantFile& plant, const host::VehicleModel& vehicle, int esc, double blade_inertia_kg_m2,
                                    std::uint64_t seed) {
  const auto index = static_cast<std::size_t>(esc);
  const MotorNumbers m = known_motor(plant, vehicle, index, blade_inertia_kg_m2, seed);
  firmware::Parameters p;
  p.pole_pairs = static_cast<std::uint8_t>(m.pole_pairs);
  p.resistance_ohm = static_cast<float>(m.resistance_ohm);
  p.inductance_H = static_cast<float>(m.inductance_H);
  p.flux_linkage_Wb = static_cast<float>(m.flux_linkage_Wb);
  p.inertia_kg_m2 = static_cast<float>(m.inertia_kg_m2);
  p.load_N_m_s2 = static_cast<float>(m.load_N_m_s2);
  p.undervoltage_V = static_cast<float>(kEmptyCell_V * plant.battery.cells);
  if (!plant.esc.given) return p;
  p.phase_current_limit_A = p.bus_current_limit_A = p.regen_current_limit_A = static_cast<float>(plant.esc.phase_current_limit_A);
  p.overvoltage_V = static_cast<float>(overvoltage_V(*plant.esc.stage));
  const double highest_rad_s = highest_esc_speed_rad_s(plant.rotors[index].motor, plant.battery.cells);
  p.max_speed_rad_s = static_cast<float>(highest_rad_s);
  p.min_speed_rad_s = static_cast<float>(std::min(105.0, 0.08 * highest_rad_s));
  return p;
}

}  // namespace rotorloop::hil
