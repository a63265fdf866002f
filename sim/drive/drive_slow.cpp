// What changes slowly in a drive, and what breaks.
#include <cmath>

#include "sim/drive/drive.hpp"
#include "sim/drive/saturation.hpp"

namespace rotorloop::sim {
namespace {

constexpr double kSlow_s = 1e-3;
constexpr double kGone_A = 0.05;     // two counts of the converter
constexpr double kHeld_kg_m2 = 1e3;  // a rotor held fast: nothing of this size turns it

bool acts(const DriveFault& f, double t_s) { return t_s >= f.from_s && t_s < f.until_s; }

}  // namespace

// Slow parameters follow the drive's own periods, so that company changes nothing. A fault acts from the first such instant on.
std::int64_t Drive::slow_periods() const { return static_cast<std::int64_t>(kSlow_s * p_.inverter.pwm_Hz + 0.5); }

void Drive::count_periods(int periods) {
  pwm_periods_ += periods;
  if (pwm_periods_ < next_slow_) return;
  next_slow_ = pwm_periods_ + slow_periods();
  sensing_.set_drift_share(std::fmin(1.0, time_s() / p_.sensing.drift_s));
  if (p_.thermal.follows) follow_losses(kSlow_s);
  if (!p_.faults.empty()) follow_faults();
}

void Drive::follow_losses(double dt_s) {
  const MotorState& s = motor_.state();
  const double squared_A2 = 1.5 * (s.i_d_A * s.i_d_A + s.i_q_A * s.i_q_A), peak_A = std::sqrt(squared_A2 / 1.5);
  const InverterParameters& v = p_.inverter;
  // Three legs, mean of a rectified sine 2/pi: channels, diodes in the dead times, hard edges.
  constexpr double kThreeMeans = 3.0 * 2.0 / 3.14159265358979323846;
  const double stage_W = squared_A2 * v.switch_resistance_ohm * channel_ +
                         kThreeMeans * peak_A * v.pwm_Hz * (2.0 * v.dead_time_s * v.diode_drop_V + 0.5 * bus_V_ * v.switching_s);
  advance(p_.thermal, temperatures_, squared_A2 * motor_.parameters().resistance_ohm * copper_, stage_W, dt_s);
  copper_ = copper_factor(temperatures_.winding_K);
  channel_ = channel_factor(temperatures_.fets_K);
  flux_ = magnet_factor(temperatures_.iron_K);
}

void Drive::follow_faults() {
  const double whole_kg_m2 = p_.motor.inertia_kg_m2 + p_.blade_inertia_kg_m2;
  legs_ = {};
  sensing_.faults = {};
  double magnets = 1.0, inertia_kg_m2 = whole_kg_m2;
  load_share_ = 1.0;
  strike_N_m_ = 0.0;
  bool locked = false;
  for (const DriveFault& f : p_.faults) {
    if (!acts(f, time_s())) continue;
    using enum DriveFaultKind;
    const std::size_t k = f.phase;
    switch (f.kind) {
      case phase_open:
        legs_.phase_open[k] = legs_.any = true;
        break;
      case shunt_open:
        legs_.no_low_path[k] = legs_.any = true;
        sensing_.faults[k] = ChannelFault::high_rail;
        break;
      case shunt_short:
        sensing_.faults[k] = ChannelFault::no_current;
        break;
      case high_fet_open:
        legs_.high_open[k] = legs_.any = true;
        break;
      case high_fet_short:
        legs_.high_short[k] = legs_.any = true;
        break;
      case low_fet_open:
        legs_.low_open[k] = legs_.any = true;
        break;
      case low_fet_short:
        legs_.low_short[k] = legs_.any = true;
        break;
      case ntc_open:
        sensing_.faults[3] = ChannelFault::low_rail;
        break;
      case ntc_short:
        sensing_.faults[3] = ChannelFault::high_rail;
        break;
      case weak_magnets:
        magnets *= f.size;
        break;
      case rotor_lock:
        locked = true;
        break;
      case prop_strike:
        strike_N_m_ += f.size;
        break;
      case prop_loss:
        load_share_ = 0.0;
        inertia_kg_m2 = p_.motor.inertia_kg_m2;
        break;
    }
  }
  flux_ = magnets * (p_.thermal.follows ? magnet_factor(temperatures_.iron_K) : 1.0);
  if (locked) motor_.state().omega_rad_s = 0.0;
  motor_.set_inertia_kg_m2(locked ? kHeld_kg_m2 : inertia_kg_m2);
}

ShaftLoad Drive::present_load() const { return {load_.quadratic_N_m_s2 * load_share_, load_.constant_N_m * load_share_ + strike_N_m_}; }

MotorConstants<double> Drive::present_motor() const {
  MotorConstants<double> m = motor_.constants(0.0);
  const MotorParameters& p = motor_.parameters();
  m.resistance_ohm = p.resistance_ohm * copper_;
  m.flux_linkage_Wb = p.flux_linkage_Wb * flux_;
  if (p.saturation_A > 0.0) {
    m.inductance_d_H = axis_flux(p.inductance_H.d, p.saturated_share, 1.0 / p.saturation_A, motor_.state().i_d_A).apparent_H;
    m.inductance_q_H = axis_flux(p.inductance_H.q, p.saturated_share, 1.0 / p.saturation_A, motor_.state().i_q_A).apparent_H;
  }
  return m;
}

bool Drive::at_rest(const PwmCommand& pwm) const {
  if (driven(pwm)) return false;
  for (std::size_t k = 0; k < 3; ++k)
    if (legs_.high_short[k] || legs_.low_short[k]) return false;
  const MotorState& s = motor_.state();
  return s.i_d_A * s.i_d_A + s.i_q_A * s.i_q_A < kGone_A * kGone_A;
}

void Drive::step_switched(const PwmCommand& pwm) {
  SwitchedStage stage;
  stage.inverter = p_.inverter;
  stage.inverter.switch_resistance_ohm *= channel_;
  stage.bus_V = bus_V_ > 0.0 ? bus_V_ : 0.0;
  stage.faults = legs_;
  stage.longest_step_s = p_.switched_step_s;
  std::array<double, 3> duty{};
  for (std::size_t k = 0; k < 3; ++k) duty[k] = pwm.compare[k] >= pwm.top ? 1.0 : pwm.compare[k] * (1.0 / pwm.top);
  const bool on = driven(pwm);
  by_edges_ = true;
  const SwitchedPeriod p = bridge_.step_period(stage, present_motor(), motor_.state(), duty, on ? pwm.gates : kNoGates, present_load());
  bus_energy_J_ += p.bus_J;
  shorted_s_ += p.shorted_s;
  low_current_A_ = p.low_current_A;
  const double period_s = 1.0 / p_.inverter.pwm_Hz;
  for (std::size_t k = 0; k < 3; ++k) low_window_s_[k] = on ? 0.5 * ((1.0 - duty[k]) * period_s - p_.inverter.dead_time_s) : 0.5 * period_s;
  count_periods(1);
}

}  // namespace rotorloop::sim
