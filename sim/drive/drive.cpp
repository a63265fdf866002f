#include "sim/drive/drive.hpp"

#include <algorithm>

namespace rotorloop::sim {
namespace {

// One number of each drive, and back: a double for one drive, Lanes for four. Written out lane by lane: through an array in
// memory the processor would wait for narrow stores before a wide load.
template <class Real, std::size_t Count, class Get>
Real collect(const std::array<Drive*, Count>& d, const Get& get) {
  if constexpr (Count == 1) {
    return get(*d[0], 0);
  } else {
    static_assert(Count == Lanes::kCount);
    return Real(get(*d[0], 0), get(*d[1], 1), get(*d[2], 2), get(*d[3], 3));
  }
}

template <class Real, std::size_t Count, class Put>
void distribute(const std::array<Drive*, Count>& d, const Real& value, const Put& put) {
  if constexpr (Count == 1) {
    put(*d[0], value);
  } else {
    static_assert(Count == Lanes::kCount);
    put(*d[0], value[0]), put(*d[1], value[1]), put(*d[2], value[2]), put(*d[3], value[3]);
  }
}

double high_side_share(const PwmCommand& pwm, std::size_t phase) {
  return pwm.compare[phase] >= pwm.top ? 1.0 : pwm.compare[phase] * (1.0 / pwm.top);
}

}  // namespace

Drive::Drive(const DriveParameters& parameters, RandomStream noise, double initial_angle_rad)
    : p_(parameters),
      motor_(parameters.motor, parameters.motor.inertia_kg_m2 + parameters.blade_inertia_kg_m2, initial_angle_rad),
      sensing_(parameters.sensing, noise),
      temperature_K_(parameters.temperature_K) {}

AdcReading Drive::sample() { return sensing_.sample(phase_currents_A(), low_window_s_, bus_V_, temperature_K_); }

template <class Real, std::size_t Count>
void Drive::step_driven(const std::array<Drive*, Count>& drives, const std::array<const PwmCommand*, Count>& pwm, int periods) {
  const auto each = [&](const auto& get) { return collect<Real>(drives, get); };
  const auto parameter = [&](const auto& get) { return each([&](const Drive& d, std::size_t) { return get(d.motor_.parameters()); }); };
  const auto state_of = [&](double MotorState::*which) {
    return each([&](const Drive& d, std::size_t) { return d.motor_.state().*which; });
  };
  const auto inverter = [&](double InverterParameters::*which) {
    return each([&](const Drive& d, std::size_t) { return d.p_.inverter.*which; });
  };

  const Real period_s = 1.0 / inverter(&InverterParameters::pwm_Hz);
  const MotorConstants<Real> motor{.pole_pairs = parameter([](const MotorParameters& p) { return static_cast<double>(p.pole_pairs); }),
                                   .resistance_ohm = parameter([](const MotorParameters& p) { return p.resistance_ohm; }) +
                                                     inverter(&InverterParameters::switch_resistance_ohm),
                                   .inductance_d_H = parameter([](const MotorParameters& p) { return p.inductance_H.d; }),
                                   .inductance_q_H = parameter([](const MotorParameters& p) { return p.inductance_H.q; }),
                                   .flux_linkage_Wb = parameter([](const MotorParameters& p) { return p.flux_linkage_Wb; }),
                                   .inertia_kg_m2 = each([](const Drive& d, std::size_t) { return d.motor_.inertia_kg_m2(); }),
                                   .static_friction_N_m = parameter([](const MotorParameters& p) { return p.static_friction_N_m; }),
                                   .cogging_N_m = parameter([](const MotorParameters& p) { return p.cogging_N_m; })};
  const BridgeConstants<Real> bridge{.dead_share = inverter(&InverterParameters::dead_time_s) * inverter(&InverterParameters::pwm_Hz),
                                     .diode_drop_V = inverter(&InverterParameters::diode_drop_V),
                                     .zero_zone_A = inverter(&InverterParameters::zero_zone_A),
                                     .bus_V = each([](const Drive& d, std::size_t) { return d.bus_V_; })};
  const BasicShaftLoad<Real> load{each([](const Drive& d, std::size_t) { return d.load_.quadratic_N_m_s2; }),
                                  each([](const Drive& d, std::size_t) { return d.load_.constant_N_m; })};
  std::array<Real, 3> duty;
  for (std::size_t k = 0; k < 3; ++k) duty[k] = each([&](const Drive&, std::size_t i) { return high_side_share(*pwm[i], k); });
  BasicMotorState<Real> s{state_of(&MotorState::i_d_A),     state_of(&MotorState::i_q_A), state_of(&MotorState::omega_rad_s),
                          state_of(&MotorState::angle_rad), state_of(&MotorState::cos_e), state_of(&MotorState::sin_e)};
  Real energy_J = each([](const Drive& d, std::size_t) { return d.bus_energy_J_; });

  for (int n = 0; n < periods; ++n) {
    const BasicBridgeOutput<Real> out = bridge_output(bridge, duty, to_phases(stator_current_A(s)));
    energy_J += driven_step(motor, s, out.v_V, load, period_s) + out.diode_loss_W * period_s;
  }

  const auto put_state = [&](double MotorState::*which, const Real& value) {
    distribute(drives, value, [&](Drive& d, double x) { d.motor_.state().*which = x; });
  };
  put_state(&MotorState::i_d_A, s.i_d_A);
  put_state(&MotorState::i_q_A, s.i_q_A);
  put_state(&MotorState::omega_rad_s, s.omega_rad_s);
  put_state(&MotorState::angle_rad, s.angle_rad);
  put_state(&MotorState::cos_e, s.cos_e);
  put_state(&MotorState::sin_e, s.sin_e);
  distribute(drives, energy_J, [](Drive& d, double x) { d.bus_energy_J_ = x; });
  const Real dead_time_s = inverter(&InverterParameters::dead_time_s);
  for (std::size_t k = 0; k < 3; ++k) {
    const Real window_s = 0.5 * ((1.0 - duty[k]) * period_s - dead_time_s);
    distribute(drives, window_s, [&](Drive& d, double x) { d.low_window_s_[k] = x; });
  }
}

void Drive::step(const PwmCommand& pwm) {
  if (driven(pwm)) {
    step_driven<double, 1>({this}, {&pwm}, 1);
    return;
  }
  bus_energy_J_ += motor_.step_open(bus_V_ > 0.0 ? bus_V_ : 0.5, load_, 1.0 / p_.inverter.pwm_Hz);
  low_window_s_ = {};
}

void Drive::step_together(std::span<Drive* const> drives, std::span<const PwmCommand> pwm, int periods) {
  std::array<Drive*, Lanes::kCount> batch;
  std::array<const PwmCommand*, Lanes::kCount> command;
  std::size_t filled = 0;
  for (std::size_t i = 0; i < drives.size(); ++i) {
    if (!drives[i]->driven(pwm[i])) {
      for (int n = 0; n < periods; ++n) drives[i]->step(pwm[i]);
      continue;
    }
    batch[filled] = drives[i];
    command[filled] = &pwm[i];
    if (++filled < Lanes::kCount) continue;
    step_driven<Lanes>(batch, command, periods);
    filled = 0;
  }
  for (std::size_t i = 0; i < filled; ++i) step_driven<double, 1>({batch[i]}, {command[i]}, periods);
}

}  // namespace rotorloop::sim
