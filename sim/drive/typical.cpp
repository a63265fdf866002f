#include "sim/drive/typical.hpp"

#include "host/base/elementary.hpp"

namespace rotorloop::sim {
namespace {

// Heat capacity grows with the motor's mass, and the motor constant squared about with mass^1.3 (a fit by eye over outrunners of
// 10 to 400 g); heat leaves through the surface, mass^(2/3).
void scale_to_motor(ThermalParameters& t, const MotorParameters& m) {
  const auto constant_squared = [](double pole_pairs, double flux_Wb, double resistance_ohm) {
    return 1.5 * pole_pairs * pole_pairs * flux_Wb * flux_Wb / resistance_ohm;
  };
  const double of_2306 = constant_squared(7.0, 3.42e-4, 0.06);
  const double mass = pow_exact(constant_squared(m.pole_pairs, m.flux_linkage_Wb, m.resistance_ohm) / of_2306, 1.0 / 1.3);
  const double surface = pow_exact(mass, 2.0 / 3.0);
  t.winding_J_K *= mass;
  t.iron_J_K *= mass;
  t.winding_K_W /= surface;
  t.iron_K_W /= surface;
}

}  // namespace

TypicalDrive typical_drive(const DriveParameters& nominal, double most_phase_A, const RandomStream& random) {
  TypicalDrive t{nominal, 0.0, 0.0};
  std::uint64_t n = 100;  // typical_board() uses the first six
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(n++); };
  DriveParameters& d = t.drive;
  d.inverter.dead_time_s *= between(5.0 / 8.0, 11.0 / 8.0);
  d.inverter.node_capacitance_F = between(2e-9, 6e-9) * most_phase_A / 45.0;

  const double saliency = between(1.0, 1.4), mean_H = 0.5 * (d.motor.inductance_H.d + d.motor.inductance_H.q);
  d.motor.inductance_H = {.d = 2.0 * mean_H / (1.0 + saliency), .q = 2.0 * mean_H * saliency / (1.0 + saliency)};
  d.motor.saturation_A = between(1.0, 2.0) * d.motor.flux_linkage_Wb / mean_H;
  d.motor.saturated_share = between(0.6, 0.9);

  const SensingParameters drawn = typical_board(random);
  d.sensing.gain = drawn.gain;
  d.sensing.offset_counts = drawn.offset_counts;
  for (double& drift : d.sensing.drift_counts) drift = between(-20.0, 20.0);
  d.sensing.drift_s = between(3.0, 10.0);
  const double reference = between(0.99, 1.01);  // the bias of the amplifiers comes from the same reference
  d.sensing.reference_V *= reference;
  d.sensing.current_zero_V *= reference;
  d.sensing.bus_ratio *= between(0.99, 1.01);
  d.sensing.bad_sample_every = 4.0 * 24000.0;

  d.thermal.follows = true;
  scale_to_motor(d.thermal, d.motor);
  t.clock_ppm = between(-50.0, 50.0);
  t.pwm_phase = between(0.0, 1.0);
  return t;
}

}  // namespace rotorloop::sim
