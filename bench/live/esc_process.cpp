#include "bench/live/esc_process.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware/core/node/parameters.hpp"
#include "host/base/error.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::live {
namespace {

constexpr std::uint64_t kPeriodsPerCoupling = 12;      // as the airframe of a flight: 2 kHz
constexpr std::int64_t kSlice_ns = 1'000'000;          // between two looks at the clock when no frame comes
constexpr std::int64_t kLongestCatchUp_ns = 50'000'000;
constexpr double kReferenceSpeed_rad_s = 900.0;        // near hover: torque over speed squared hardly changes around it

// End of the n-th period: 41 2/3 us each.
std::int64_t period_ns(std::uint64_t periods) { return static_cast<std::int64_t>(periods) * 125'000 / 3; }

// Torque of the propeller in still air over its speed squared, from the blade-element rotor.
double static_load(const sim::Rotor& rotor, double density_kg_m3) {
  sim::RotorWarmStart start;
  sim::RotorCondition condition;
  condition.omega_rad_s = kReferenceSpeed_rad_s;
  condition.density_kg_m3 = density_kg_m3;
  const sim::RotorLoads loads = sim::solve_rotor(rotor, condition, start);
  return std::fabs(loads.shaft_torque_N_m) / (kReferenceSpeed_rad_s * kReferenceSpeed_rad_s);
}

firmware::Parameters parameters(const EscProcessConfig& c) {
  firmware::Parameters p;
  p.node_id = c.node_id;
  p.esc_index = c.esc_index;
  p.require_arming = c.require_arming;
  if (const auto wrong = firmware::check(p)) {
    const firmware::ParameterRange& r = firmware::kParameterRanges[wrong->index];
    throw Error({"esc-sim", fmt::format("{} = {} {} is out of range: {} to {}", r.name, wrong->value, r.unit, wrong->min, wrong->max), "",
                 "give a value within the range"});
  }
  return p;
}

firmware::NodeIdentity identity_of(const EscProcessConfig& c) {
  firmware::NodeIdentity id;
  id.unique_id = c.unique_id;
  id.feedback_with_voltage = true;
  return id;
}

}  // namespace

std::array<std::uint8_t, 16> default_unique_id(std::uint8_t esc_index) {
  std::array<std::uint8_t, 16> id{'r', 'o', 't', 'o', 'r', 'l', 'o', 'o', 'p', ' ', 'e', 's', 'c', 0, 0, 0};
  id[15] = esc_index;
  return id;
}

EscProcess::EscProcess(const EscProcessConfig& config, TimedBus& bus)
    : config_(config), bus_(bus), plant_(sim::read_plant(config.plant)), rotors_(sim::read_rotors(plant_)),
      battery_(sim::battery_parameters(plant_)), begun_ns_(bus.now_ns()) {
  const sim::Rotor& rotor = *rotors_[0];
  load_N_m_s2_ = static_load(rotor, plant_.density_kg_m3);
  const firmware::Parameters p = parameters(config_);
  sim::NativeEscConfig e;
  e.drive = sim::drive_parameters(plant_, rotor, 0);
  e.firmware = p;
  e.bus_V = battery_.voltage_V();
  e.seed = config_.seed;
  e.module = config_.esc_index;
  esc_ = std::make_unique<Esc>(sim::NativeEsc(e), firmware::EscNode(p, identity_of(config_)), bus_);
  couple();
}

EscProcess::~EscProcess() = default;

void EscProcess::couple() { esc_->esc().couple_quadratic(load_N_m_s2_, battery_.voltage_V()); }

void EscProcess::step_period() {
  esc_->step_current_loop();
  if (++periods_ % kPeriodsPerCoupling != 0) return;
  battery_.step(esc_->esc().bus_current_A(), static_cast<double>(kPeriodsPerCoupling) / sim::kCurrentLoop_Hz);
  couple();
}

void EscProcess::advance() {
  const auto passed_ns = static_cast<std::int64_t>(static_cast<double>(bus_.now_ns() - begun_ns_) * config_.pace);
  const std::int64_t behind_ns = passed_ns - lost_ns_ - period_ns(periods_);
  if (behind_ns > kLongestCatchUp_ns) lost_ns_ += behind_ns - kLongestCatchUp_ns;
  while (period_ns(periods_ + 1) <= passed_ns - lost_ns_) step_period();
}

std::int64_t EscProcess::next_ns() const { return bus_.now_ns() + kSlice_ns; }
bool EscProcess::operational() const { return esc_->node().mode() == protocols::NodeMode::operational; }
const firmware::EscNode& EscProcess::node() const { return esc_->node(); }
firmware::Telemetry EscProcess::telemetry() const { return esc_->esc().telemetry(); }
double EscProcess::omega_rad_s() const { return esc_->esc().omega_rad_s(); }

}  // namespace rotorloop::live
