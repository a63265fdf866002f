#include "sim/drive/battery.hpp"

#include <algorithm>
#include <array>

namespace rotorloop::sim {
namespace {
// Lithium-polymer cell at rest, volts at 0, 10, … 100 % (typical of published discharge curves at low rate; ±30 mV by make).
constexpr std::array<double, 11> kRestCell_V = {3.27, 3.61, 3.69, 3.71, 3.76, 3.80, 3.84, 3.91, 3.98, 4.08, 4.20};
// Voltage to which a supply that cannot sink is allowed to be pushed per ampere fed back: its output capacitor, not a load.
constexpr double kSupplyCapacitance_F = 1000e-6;
}  // namespace

double Battery::open_circuit_cell_V(double charge) {
  const double x = std::clamp(charge, 0.0, 1.0) * 10.0;
  const auto k = std::min<std::size_t>(static_cast<std::size_t>(x), 9);
  const double f = x - static_cast<double>(k);
  return kRestCell_V[k] + f * (kRestCell_V[k + 1] - kRestCell_V[k]);
}

Battery::Battery(const BatteryParameters& parameters)
    : p_(parameters), charge_(parameters.initial_charge), bus_V_(parameters.cells * open_circuit_cell_V(parameters.initial_charge)) {}

double Battery::step(double current_A, double dt_s) {
  charge_ = std::clamp(charge_ - current_A * dt_s / p_.capacity_A_s, 0.0, 1.0);
  // Implicit Euler: stable for any step.
  const double k = dt_s / p_.relaxation_s;
  relaxation_V_ = (relaxation_V_ + k * p_.relaxation_ohm * current_A) / (1.0 + k);
  const double stiff_V = p_.cells * open_circuit_cell_V(charge_) - p_.resistance_ohm * current_A - relaxation_V_;
  if (!p_.can_sink && (current_A < 0.0 || bus_V_ > stiff_V + 1e-9)) {
    // Only the bus capacitor takes what comes back; it discharges into the loads before the supply delivers again.
    bus_V_ = std::max(stiff_V, bus_V_ - current_A * dt_s / kSupplyCapacitance_F);
  } else {
    bus_V_ = stiff_V;
  }
  return bus_V_;
}

double Battery::step(std::span<const double> currents_A, double dt_s) {
  double sum = 0.0;
  for (const double current : currents_A) sum += current;
  return step(sum, dt_s);
}

}  // namespace rotorloop::sim
