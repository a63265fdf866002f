#include "sim/drive/drive.hpp"

#include <algorithm>

#include "sim/drive/commutation.hpp"
#include "sim/drive/saturation.hpp"

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
    put(*d[0], value[0]);
    put(*d[1], value[1]);
    put(*d[2], value[2]);
    put(*d[3], value[3]);
  }
}

double high_side_share(const PwmCommand& pwm, std::size_t phase) {
  return pwm.compare[phase] >= pwm.top ? 1.0 : pwm.compare[phase] * (1.0 / pwm.top);
}

}  // namespace

Drive::Drive(const DriveParameters& parameters, RandomStream noise, double initial_angle_rad)
    : p_(parameters),
      motor_(parameters.motor, parameters.motor.inertia_kg_m2 + parameters.blade_inertia_kg_m2, initial_angle_rad),
      sensing_(parameters.sensing, noise) {
  temperatures_ = {p_.thermal.air_K, p_.thermal.air_K, parameters.temperature_K, parameters.temperature_K};
  next_slow_ = slow_periods();
  if (!p_.faults.empty()) follow_faults();
}

AdcReading Drive::sample() {
  const auto& low = low_current_A_;
  const PhaseCurrents currents = legs_.any || by_edges_ ? PhaseCurrents{low[0], low[1], low[2]} : phase_currents_A();
  return sensing_.sample(currents, low_window_s_, bus_V_ + bus_ripple_V_, temperatures_.board_K);
}

// The current is taken for being that of the sample: what an amplifier has not yet forgotten of it is small, and gone at most duties.
std::array<std::uint16_t, 3> Drive::sample_unloaded() {
  const double half_s = 0.5 * time_in_step_s() - p_.inverter.dead_time_s;
  std::array<double, 3> off_s{};
  for (std::size_t k = 0; k < 3; ++k) {
    const bool loaded = legs_.any && (legs_.high_open[k] || legs_.low_short[k]);  // through the low diode, or both FETs
    off_s[k] = loaded ? 0.0 : half_s - low_window_s_[k];
  }
  return sensing_.sample_unloaded(phase_currents_A(), off_s);
}

template <class Real, std::size_t Count>
inline Drive::SideBySide<Real> Drive::gather(const std::array<Drive*, Count>& drives, const std::array<const PwmCommand*, Count>& pwm) {
  const auto each = [&](const auto& get) { return collect<Real>(drives, get); };
  const auto parameter = [&](const auto& get) { return each([&](const Drive& d, std::size_t) { return get(d.motor_.parameters()); }); };
  const auto state_of = [&](double MotorState::*which) {
    return each([&](const Drive& d, std::size_t) { return d.motor_.state().*which; });
  };
  const auto inverter = [&](double InverterParameters::*which) {
    return each([&](const Drive& d, std::size_t) { return d.p_.inverter.*which; });
  };
  const auto own = [&](double Drive::*which) { return each([&](const Drive& d, std::size_t) { return d.*which; }); };

  SideBySide<Real> g;
  g.period_s = 1.0 / inverter(&InverterParameters::pwm_Hz);
  g.dead_time_s = inverter(&InverterParameters::dead_time_s);
  g.motor = {.pole_pairs = parameter([](const MotorParameters& p) { return static_cast<double>(p.pole_pairs); }),
             .resistance_ohm = parameter([](const MotorParameters& p) { return p.resistance_ohm; }) * own(&Drive::copper_) +
                               inverter(&InverterParameters::switch_resistance_ohm) * own(&Drive::channel_),
             .inductance_d_H = parameter([](const MotorParameters& p) { return p.inductance_H.d; }),
             .inductance_q_H = parameter([](const MotorParameters& p) { return p.inductance_H.q; }),
             .flux_linkage_Wb = parameter([](const MotorParameters& p) { return p.flux_linkage_Wb; }) * own(&Drive::flux_),
             .inertia_kg_m2 = each([](const Drive& d, std::size_t) { return d.motor_.inertia_kg_m2(); }),
             .static_friction_N_m = parameter([](const MotorParameters& p) { return p.static_friction_N_m; }),
             .cogging_N_m = parameter([](const MotorParameters& p) { return p.cogging_N_m; })};
  g.bridge = {.dead_share = g.dead_time_s * inverter(&InverterParameters::pwm_Hz),
              .diode_drop_V = inverter(&InverterParameters::diode_drop_V),
              .zero_zone_A = inverter(&InverterParameters::zero_zone_A),
              .bus_V = own(&Drive::bus_V_)};
  g.load = {each([](const Drive& d, std::size_t) { return d.present_load().quadratic_N_m_s2; }),
            each([](const Drive& d, std::size_t) { return d.present_load().constant_N_m; })};
  for (std::size_t k = 0; k < 3; ++k) g.duty[k] = each([&](const Drive&, std::size_t i) { return high_side_share(*pwm[i], k); });
  g.state = {state_of(&MotorState::i_d_A),     state_of(&MotorState::i_q_A), state_of(&MotorState::omega_rad_s),
             state_of(&MotorState::angle_rad), state_of(&MotorState::cos_e), state_of(&MotorState::sin_e)};
  g.energy_J = own(&Drive::bus_energy_J_);
  return g;
}

template <class Real, std::size_t Count>
inline void Drive::scatter(const std::array<Drive*, Count>& drives, const SideBySide<Real>& g, int periods) {
  const auto put_state = [&](double MotorState::*which, const Real& value) {
    distribute(drives, value, [&](Drive& d, double x) { d.motor_.state().*which = x; });
  };
  put_state(&MotorState::i_d_A, g.state.i_d_A);
  put_state(&MotorState::i_q_A, g.state.i_q_A);
  put_state(&MotorState::omega_rad_s, g.state.omega_rad_s);
  put_state(&MotorState::angle_rad, g.state.angle_rad);
  put_state(&MotorState::cos_e, g.state.cos_e);
  put_state(&MotorState::sin_e, g.state.sin_e);
  distribute(drives, g.energy_J, [](Drive& d, double x) { d.bus_energy_J_ = x; });
  for (std::size_t k = 0; k < 3; ++k) {
    const Real window_s = 0.5 * ((1.0 - g.duty[k]) * g.period_s - g.dead_time_s);
    distribute(drives, window_s, [&](Drive& d, double x) { d.low_window_s_[k] = x; });
  }
  for (Drive* d : drives) {
    d->by_edges_ = false;
    d->count_periods(periods);
  }
}

template <bool kDetailed, class Real, std::size_t Count>
void Drive::step_driven(const std::array<Drive*, Count>& drives, const std::array<const PwmCommand*, Count>& pwm, int periods) {
  SideBySide<Real> g = gather<Real>(drives, pwm);
  BasicMotorState<Real> s = g.state;
  if constexpr (kDetailed) {
    const auto own = [&](const auto& get) { return collect<Real>(drives, [&](const Drive& d, std::size_t) { return get(d); }); };
    const Real l_d = g.motor.inductance_d_H, l_q = g.motor.inductance_q_H, mean_H = 0.5 * (l_d + l_q), bus_V = g.bridge.bus_V;
    const Real end_share = own([](const Drive& d) { return d.motor_.parameters().saturated_share; });
    const Real per_knee_A = own([](const Drive& d) {
      const double knee_A = d.motor_.parameters().saturation_A;
      return knee_A > 0.0 ? 1.0 / knee_A : 0.0;
    });
    CommutationConstants<Real> edges =
        commutation_constants(g.dead_time_s, own([](const Drive& d) { return d.p_.inverter.pwm_Hz; }), g.bridge.diode_drop_V, bus_V,
                              own([](const Drive& d) { return d.p_.inverter.node_capacitance_F; }), mean_H);
    const Real duty_V_s_over_H = bus_V * g.period_s / mean_H;
    for (int n = 0; n < periods; ++n) {
      const BasicPhaseCurrents<Real> phases = to_phases(stator_current_A(s));
      set_ripple(edges, g.duty, phases, duty_V_s_over_H);
      const AxisFlux<Real> d = axis_flux(l_d, end_share, per_knee_A, s.i_d_A), q = axis_flux(l_q, end_share, per_knee_A, s.i_q_A);
      g.motor.inductance_d_H = d.apparent_H;
      g.motor.inductance_q_H = q.apparent_H;
      const BasicBridgeOutput<Real> out = commutated_output(edges, g.duty, phases);
      g.energy_J +=
          driven_step(g.motor, s, out.v_V, g.load, g.period_s, {d.incremental_H, q.incremental_H}) + out.diode_loss_W * g.period_s;
    }
  } else {
    for (int n = 0; n < periods; ++n) {
      const BasicBridgeOutput<Real> out = bridge_output(g.bridge, g.duty, to_phases(stator_current_A(s)));
      g.energy_J += driven_step(g.motor, s, out.v_V, g.load, g.period_s) + out.diode_loss_W * g.period_s;
    }
  }
  g.state = s;
  scatter(drives, g, periods);
}

void Drive::step(const PwmCommand& pwm) { step_alone(pwm, 1); }

void Drive::step_alone(const PwmCommand& pwm, int periods) {
  if (periods > 1 && slow_within(periods)) {
    for (int n = 0; n < periods; ++n) step_alone(pwm, 1);
  } else if (edge_by_edge(pwm)) {
    for (int n = 0; n < periods; ++n) at_rest(pwm) ? step_off() : step_switched(pwm);
  } else if (!driven(pwm)) {
    for (int n = 0; n < periods; ++n) step_off();
  } else if (detailed()) {
    step_driven<true, double, 1>({this}, {&pwm}, periods);
  } else {
    step_driven<false, double, 1>({this}, {&pwm}, periods);
  }
}

void Drive::step_off() {
  bus_energy_J_ += motor_.step_open(bus_V_ > 0.0 ? bus_V_ : 0.5, present_load(), 1.0 / p_.inverter.pwm_Hz);
  low_window_s_ = {};
  low_current_A_ = {};
  by_edges_ = false;
  count_periods(1);
}

void Drive::step_together(std::span<Drive* const> drives, std::span<const PwmCommand> pwm, int periods) {
  struct Batch {
    std::array<Drive*, Lanes::kCount> drives;
    std::array<const PwmCommand*, Lanes::kCount> pwm;
    std::size_t filled = 0;
  };
  std::array<Batch, 2> batches;  // simple and detailed: a batch steps by one law
  for (std::size_t i = 0; i < drives.size(); ++i) {
    if (drives[i]->edge_by_edge(pwm[i]) || !drives[i]->driven(pwm[i]) || drives[i]->slow_within(periods)) {
      drives[i]->step_alone(pwm[i], periods);
      continue;
    }
    Batch& b = batches[drives[i]->detailed() ? 1 : 0];
    b.drives[b.filled] = drives[i];
    b.pwm[b.filled] = &pwm[i];
    if (++b.filled < Lanes::kCount) continue;
    if (drives[i]->detailed())
      step_driven<true, Lanes>(b.drives, b.pwm, periods);
    else
      step_driven<false, Lanes>(b.drives, b.pwm, periods);
    b.filled = 0;
  }
  for (const Batch& b : batches)
    for (std::size_t i = 0; i < b.filled; ++i) b.drives[i]->step_alone(*b.pwm[i], periods);
}

}  // namespace rotorloop::sim
