#include "bench/hil/esc_lab/commission_trial.hpp"

#include <algorithm>
#include <cmath>

#include "bench/hil/esc_lab/commissioning_rig.hpp"
#include "host/base/random.hpp"
#include "sim/drive/commutation.hpp"
#include "sim/drive/typical.hpp"
#include "sim/esc/native_esc.hpp"

namespace rotorloop::esc_lab {
namespace {

constexpr std::uint64_t kCommissionStream = 0x434F4D53;
constexpr double kUnmeasured = 1e9;

double percent(double found, double truth) { return 100.0 * (found / truth - 1.0); }

// What leg U loses at rest with current i out of it and half of i back through each of the others.
double true_loss_V(const sim::DriveParameters& d, double bus_V, double i_A, double resistance_ohm) {
  const double mean_H = 0.5 * (d.motor.inductance_H.d + d.motor.inductance_H.q);
  sim::CommutationConstants<double> c = sim::commutation_constants<double>(
      d.inverter.dead_time_s, d.inverter.pwm_Hz, d.inverter.diode_drop_V, bus_V, d.inverter.node_capacitance_F, mean_H);
  const double half = 0.75 * resistance_ohm * i_A / bus_V;
  const sim::BasicPhaseCurrents<double> phases{i_A, -0.5 * i_A, -0.5 * i_A};
  sim::set_ripple<double>(c, {0.5 + half, 0.5 - half, 0.5 - half}, phases, bus_V / (d.inverter.pwm_Hz * mean_H));
  const auto u = sim::leg_errors(c, phases)[0];
  return -(u.node_V + u.diode_V);
}

// From 1 A to 20 A, the motor's limit, or what half of the bus drives at rest.
template <class Board>
double bridge_error(const CommissionTrial& t, const sim::DriveParameters& d, const EscDraw& draw) {
  const double ohm = d.motor.resistance_ohm + d.inverter.switch_resistance_ohm;
  const double most_A = std::min({20.0, static_cast<double>(draw.firmware.phase_current_limit_A), 0.5 * draw.bus_V / ohm});
  double worst_V = 0.0;
  for (double i = 1.0; i <= most_A; i += 0.25) {
    const double measured_V = firmware::bridge_loss_V(t.result, static_cast<float>(Board::kPwm_Hz), Board::kDiodeDrop_V,
                                                      static_cast<float>(draw.bus_V), static_cast<float>(i));
    const double error_V = measured_V - true_loss_V(d, draw.bus_V, i, ohm);
    if (std::fabs(error_V) > std::fabs(worst_V)) worst_V = error_V;
  }
  return worst_V / (50e-9 * draw.bus_V * d.inverter.pwm_Hz);
}

template <class Board>
void compare(CommissionTrial& t, const sim::DriveParameters& d, const EscDraw& draw) {
  using enum Quantity;
  const firmware::CommissioningResult& r = t.result;
  const auto set = [&](Quantity q, double error, double scale) {
    t.error[static_cast<std::size_t>(q)] = error;
    t.scales[static_cast<std::size_t>(q)] = scale;
  };
  t.error.fill(kUnmeasured);
  // Counts per volt and per ampere over the nominal ones.
  const sim::SensingParameters &nominal = draw.drive.sensing, &drawn = d.sensing;
  const double reference = nominal.reference_V / drawn.reference_V, volts = reference * drawn.bus_ratio / nominal.bus_ratio;
  const double amperes = reference * (drawn.gain[0] + drawn.gain[1] + drawn.gain[2]) / 3.0;
  if (r.standstill_valid) {
    const double l_d = d.motor.inductance_H.d, l_q = d.motor.inductance_H.q, ratio = percent(volts, amperes);
    set(resistance, percent(r.resistance_ohm, d.motor.resistance_ohm + d.inverter.switch_resistance_ohm), ratio);
    set(inductance_d, percent(r.inductance_d_H, l_d), ratio);
    set(inductance_q, percent(r.inductance_q_H, l_q), ratio);
    set(Quantity::ratio, static_cast<double>(r.inductance_q_H / r.inductance_d_H) - l_q / l_d, 0.0);
    set(bridge, bridge_error<Board>(t, d, draw), 0.0);
  }
  if (r.spin_valid) {
    set(flux, percent(r.flux_linkage_Wb, d.motor.flux_linkage_Wb), percent(volts, 1.0));
    set(inertia, percent(r.inertia_kg_m2, d.motor.inertia_kg_m2 + d.blade_inertia_kg_m2), percent(volts * amperes, 1.0));
    t.load_percent = percent(r.load_N_m_s2, draw.load_N_m_s2);
    t.friction_percent = percent(r.friction_N_m, d.motor.static_friction_N_m);
  }
}

template <class Esc>
CommissionTrial run_on(const EscDraw& draw) {
  using Board = typename Esc::Board;
  const sim::DriveParameters d =
      sim::typical_drive(draw.drive, Esc::stage().most_phase_A, RandomStream(draw.seed, kCommissionStream)).drive;
  CommissioningRig<Board> rig(d, draw.firmware, draw.bus_V, draw.load_N_m_s2, draw.seed);
  rig.order.task = firmware::CommissioningTask::all;
  CommissionTrial t;
  t.seed = draw.seed;
  t.motor_class = draw.motor_class;
  t.result = rig.run_until();
  t.took_s = rig.drive().time_s();
  t.peak_A = rig.peak_A;
  t.peak_rad_s = rig.peak_rad_s;
  t.heated_K = rig.drive().temperatures().winding_K - d.thermal.air_K;
  compare<Board>(t, d, draw);
  return t;
}

}  // namespace

CommissionTrial run_commission_trial(const EscDraw& draw) {
  return with_esc_of(draw.board, [&]<class Esc>() { return run_on<Esc>(draw); });
}

CommissionTrial run_commission_trial(const MotorClass& c, std::uint64_t seed) {
  return run_commission_trial(draw_esc(c, seed, Knowledge::data_sheet));
}

}  // namespace rotorloop::esc_lab
