#include "bench/stand/virtual/stand_rotor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/plant/motor_file.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::virtual_stand {
namespace {

constexpr double kNode_rad_s = 50.0;  // of the tables of loads
constexpr std::size_t kNodes = 60;
constexpr std::uint8_t kEscNode = 21;
constexpr int kPeriodsOfPoll = 6, kPollsOfCoupling = 2;  // 2 kHz, as the airframe of a flight

// A bench supply: it holds its voltage but for the leads, and takes nothing back to speak of.
sim::BatteryParameters bench_supply(int cells) {
  sim::BatteryParameters p;
  p.cells = cells;
  p.capacity_A_s = 1e9;
  p.resistance_ohm = 0.02;
  p.relaxation_ohm = 1e-6;
  p.initial_charge = 0.9;
  return p;
}

firmware::Parameters esc_parameters(const StandRotorConfig& c, const sim::PlantFile& plant) {
  const sim::MotorFile& m = plant.rotors[0].motor;
  firmware::Parameters p;
  p.node_id = kEscNode;
  p.esc_index = static_cast<std::uint8_t>(c.esc_index);
  p.status_Hz = 200;  // what a stand asks of its ESC, for speeds in steps
  p.pole_pairs = static_cast<std::uint8_t>(c.pole_pairs > 0 ? c.pole_pairs : m.pole_pairs);
  p.resistance_ohm = static_cast<float>(m.resistance_ohm);
  p.inductance_H = static_cast<float>(0.5 * (m.inductance_d_H + m.inductance_q_H));
  p.flux_linkage_Wb = static_cast<float>(m.flux_linkage_Wb);
  return p;
}

}  // namespace

StandRotor::StandRotor(const StandRotorConfig& config, CanBus& port)
    : config_(config),
      plant_(sim::read_plant(config.plant)),
      rotor_(config.blade ? std::make_shared<const sim::Rotor>(*config.blade) : sim::read_rotors(plant_)[0]),
      supply_(bench_supply(plant_.battery.cells)) {
  const sim::Rotor& rotor = *rotor_;
  for (std::size_t i = 0; i < kNodes; ++i) {
    sim::RotorCondition condition;
    condition.omega_rad_s = kNode_rad_s * static_cast<double>(i + 1);
    condition.v_R_m_s.z() = config_.axial_wind_m_s;
    condition.density_kg_m3 = config_.density_kg_m3;
    sim::RotorWarmStart cold;
    const sim::RotorLoads loads = sim::solve_rotor(rotor, condition, cold);
    const double square = condition.omega_rad_s * condition.omega_rad_s;
    c_t_.push_back(loads.force_R_N.z() / square);
    c_q_.push_back(loads.shaft_torque_N_m / square);
  }
  sim::NativeEscConfig e;
  e.drive = sim::drive_parameters(plant_, rotor, 0);
  e.firmware = esc_parameters(config_, plant_);
  e.bus_V = supply_.voltage_V();
  e.seed = config_.seed;
  inertia_kg_m2_ = e.drive.motor.inertia_kg_m2 + e.drive.blade_inertia_kg_m2;
  resistance_ohm_ = e.drive.motor.resistance_ohm + e.drive.inverter.switch_resistance_ohm;
  speed_constant_rpm_V_ = 60.0 / (std::numbers::sqrt3 * 2.0 * std::numbers::pi * e.drive.motor.pole_pairs * e.drive.motor.flux_linkage_Wb);
  diameter_m_ = 2.0 * rotor.radius_m();
  firmware::NodeIdentity identity;
  identity.unique_id = {'v', 'i', 'r', 't', 'u', 'a', 'l', ' ', 's', 't', 'a', 'n', 'd', 0, 0, 1};
  sim::EscSetup setup;
  setup.speed_scale = 1.0 + config_.speed_error;
  esc_ = std::make_unique<Esc>(sim::NativeEsc(e), firmware::EscNode(e.firmware, identity), port, setup);
  couple();
}

StandRotor::~StandRotor() = default;

double StandRotor::table(const std::vector<double>& v, double omega_rad_s) const {
  const double x = std::clamp(omega_rad_s / kNode_rad_s - 1.0, 0.0, static_cast<double>(kNodes - 1));
  const auto i = std::min(static_cast<std::size_t>(x), kNodes - 2);
  return v[i] + (x - static_cast<double>(i)) * (v[i + 1] - v[i]);
}

double StandRotor::omega_rad_s() const { return esc_->esc().omega_rad_s(); }

void StandRotor::couple() { esc_->esc().couple_quadratic(c_q_N_m_s2(std::abs(omega_rad_s())), supply_.voltage_V()); }

void StandRotor::advance() {
  for (int i = 0; i < kPeriodsOfPoll; ++i) esc_->step_current_loop();
  if (++polls_ % kPollsOfCoupling != 0) return;
  const double w = omega_rad_s(), square = w * std::abs(w);
  supply_A_ = esc_->esc().bus_current_A();
  thrust_N_ = c_t_N_s2(std::abs(w)) * w * w * (configuration_ == 'B' ? 1.0 - config_.thrust_lost : 1.0);
  reaction_N_m_ = c_q_N_m_s2(std::abs(w)) * square + inertia_kg_m2_ * esc_->esc().shaft_acceleration_rad_s2();
  supply_.step(supply_A_, kPeriodsOfPoll * kPollsOfCoupling / sim::kCurrentLoop_Hz);
  couple();
}

}  // namespace rotorloop::virtual_stand
