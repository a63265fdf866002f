#include "sim/drive/switched_bridge.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::sim {
namespace {

using Gates = SwitchedBridge::Gates;
// Directions of the phases: 0, 120, 240 degrees electrical.
constexpr std::array<double, 3> kCos = {1.0, -0.5, -0.5};
constexpr std::array<double, 3> kSin = {0.0, 0.86602540378443864676, -0.86602540378443864676};

// Gates of one leg at time t of a period that begins and ends at the middle of its low side.
Gates gates_at(double t_s, double duty, double period_s, double dead_s) {
  const double up_s = 0.5 * (1.0 - duty) * period_s, down_s = period_s - up_s;
  if (duty <= 0.0) return {false, true};
  if (duty >= 1.0) return {true, false};
  return {t_s >= up_s + dead_s && t_s < down_s, t_s < up_s || t_s >= down_s + dead_s};
}

struct PhaseAxes {
  std::array<double, 3> c, s;  // cosine and sine of rotor angle less the phase's direction
};

PhaseAxes axes(const MotorState& m) {
  PhaseAxes a;
  for (std::size_t k = 0; k < 3; ++k) {
    a.c[k] = m.cos_e * kCos[k] + m.sin_e * kSin[k];
    a.s[k] = m.sin_e * kCos[k] - m.cos_e * kSin[k];
  }
  return a;
}

std::array<double, 3> phase_currents(const PhaseAxes& a, double i_d, double i_q) {
  std::array<double, 3> i;
  for (std::size_t k = 0; k < 3; ++k) i[k] = a.c[k] * i_d - a.s[k] * i_q;
  return i;
}

struct Slope {
  double d, q;
};

Slope current_slope(const MotorConstants<double>& m, double w_e, double i_d, double i_q, double v_d, double v_q) {
  return {(v_d - m.resistance_ohm * i_d + w_e * m.inductance_q_H * i_q) / m.inductance_d_H,
          (v_q - m.resistance_ohm * i_q - w_e * (m.inductance_d_H * i_d + m.flux_linkage_Wb)) / m.inductance_q_H};
}

struct Leg {
  double v_V = 0.0;        // over the step
  double end_V = 0.0;      // of the node, at its end
  bool low = false;        // the phase current passes the low shunt
  double bus_share = 0.0;  // of the phase current that comes from the bus
  double short_A = 0.0;    // from the bus to ground through both channels
};

double node_F(const SwitchedStage& g) { return std::max(g.inverter.node_capacitance_F, 0.5e-9); }
double floor_V(const SwitchedStage& g, std::size_t k) {
  return g.faults.no_low_path[k] ? g.bus_V - g.avalanche_V : -g.inverter.diode_drop_V;
}
double top_V(const SwitchedStage& g) { return g.bus_V + g.inverter.diode_drop_V; }

// A node that nobody holds: the current charges it until a diode takes over within the step. While it moves the winding sees the voltage
// that it ends with (first the node, then the current): with the mean of both ends winding and node gain energy with every swing.
Leg free_node(const SwitchedStage& g, std::size_t k, double i_A, double node_V, double dt_s) {
  const double rate_V_s = -i_A / node_F(g), limit_V = rate_V_s > 0.0 ? top_V(g) : floor_V(g, k);
  const double begin_V = std::clamp(node_V, floor_V(g, k), top_V(g));
  const double moving_s = rate_V_s == 0.0 ? dt_s : std::min(dt_s, (limit_V - begin_V) / rate_V_s);
  const double on_diode = 1.0 - moving_s / dt_s;
  const bool arrives = moving_s < dt_s;
  Leg leg{.end_V = arrives ? limit_V : begin_V + rate_V_s * dt_s};
  leg.v_V = arrives ? 0.5 * (begin_V + limit_V) * (1.0 - on_diode) + limit_V * on_diode : leg.end_V;
  leg.bus_share = rate_V_s > 0.0 ? on_diode : 0.0;
  leg.low = rate_V_s < 0.0 && on_diode > 0.5 && !g.faults.no_low_path[k];
  return leg;
}

Leg leg_voltage(const SwitchedStage& g, std::size_t k, Gates gate, double i_A, double node_V, double dt_s) {
  const LegFaults& f = g.faults;
  const double r = g.inverter.switch_resistance_ohm;
  const bool high = (gate.high && !f.high_open[k]) || f.high_short[k];
  const bool low = ((gate.low && !f.low_open[k]) || f.low_short[k]) && !f.no_low_path[k];
  if (!high && !low) return free_node(g, k, i_A, node_V, dt_s);
  Leg leg{.low = low};
  leg.v_V = high && low ? 0.5 * g.bus_V - 0.5 * r * i_A : (high ? g.bus_V : 0.0) - r * i_A;
  leg.bus_share = high ? (low ? 0.5 : 1.0) : 0.0;
  if (high && low) leg.short_A = g.bus_V / g.short_circuit_ohm;
  leg.end_V = leg.v_V;
  return leg;
}

struct Voltage {
  double d = 0.0, q = 0.0;
};

// An open phase carries nothing, whatever it carried when it broke.
void empty_open_phases(const LegFaults& f, const PhaseAxes& a, MotorState& s) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (!f.phase_open[k]) continue;
    const double i_k = a.c[k] * s.i_d_A - a.s[k] * s.i_q_A;
    s.i_d_A -= i_k * a.c[k];
    s.i_q_A += i_k * a.s[k];
  }
}

// In the rotor's frame. The end of an open phase follows its EMF: it stands at the voltage that keeps its current zero.
Voltage winding_voltage(const LegFaults& f, const PhaseAxes& a, const std::array<Leg, 3>& leg, const MotorConstants<double>& m,
                        const MotorState& s) {
  Voltage v;
  const auto add = [&](std::size_t k, double volt) {
    v.d += 2.0 / 3.0 * volt * a.c[k];
    v.q -= 2.0 / 3.0 * volt * a.s[k];
  };
  for (std::size_t k = 0; k < 3; ++k)
    if (!f.phase_open[k]) add(k, leg[k].v_V);
  for (std::size_t k = 0; k < 3; ++k) {
    if (!f.phase_open[k]) continue;
    const double w_e = s.omega_rad_s * m.pole_pairs;
    const Slope y = current_slope(m, w_e, s.i_d_A, s.i_q_A, v.d, v.q);
    const double rate = a.c[k] * (y.d - w_e * s.i_q_A) - a.s[k] * (y.q + w_e * s.i_d_A);
    const double per_V = 2.0 / 3.0 * (a.c[k] * a.c[k] / m.inductance_d_H + a.s[k] * a.s[k] / m.inductance_q_H);
    add(k, -rate / per_V);
  }
  return v;
}

// Midpoint rule; the voltage stands still in the stator and turns back in the rotor's frame.
void step_machine(const MotorConstants<double>& m, MotorState& s, const Voltage& v, const ShaftLoad& load, double dt) {
  const double w0 = s.omega_rad_s, w_e = w0 * m.pole_pairs;
  const BasicRotation<double> back = small_rotation(0.5 * w_e * dt);
  const Slope first = current_slope(m, w_e, s.i_d_A, s.i_q_A, v.d, v.q);
  const Slope middle = current_slope(m, w_e, s.i_d_A + 0.5 * dt * first.d, s.i_q_A + 0.5 * dt * first.q, back.cos * v.d + back.sin * v.q,
                                     back.cos * v.q - back.sin * v.d);
  const double d_A = s.i_d_A + 0.5 * dt * middle.d, q_A = s.i_q_A + 0.5 * dt * middle.q;  // means over the step: the EMF took their power
  s.i_d_A += dt * middle.d;
  s.i_q_A += dt * middle.q;
  s.omega_rad_s += dt * (torque_N_m(m, d_A, q_A) - load_N_m(load, s) - friction_N_m(m, s) - cogging_N_m(m, s)) / m.inertia_kg_m2;
  advance_angle(m, s, w0, dt);
}

// Winding and a free node swing with sqrt(L C), some 100 ns: half of it is enough for a rule that keeps energy. A larger current carries
// the node to a diode at once and holds it there: no longer than until a voltage could end it.
double next_step_s(const SwitchedStage& g, const MotorConstants<double>& m, const std::array<Gates, 3>& gate,
                   const std::array<double, 3>& i_A) {
  const double least_H = std::min(m.inductance_d_H, m.inductance_q_H), most_V = 2.0 * (g.bus_V + g.inverter.diode_drop_V);
  double step_s = g.longest_step_s;
  for (std::size_t k = 0; k < 3; ++k) {
    if (gate[k].high || gate[k].low || g.faults.phase_open[k]) continue;
    const double swing_s = 0.5 * std::sqrt(least_H * node_F(g)), held_s = std::fabs(i_A[k]) * least_H / most_V;
    step_s = std::min(step_s, std::max(swing_s, held_s));
  }
  return step_s;
}

double rise_s(double duty, double period_s) { return 0.5 * (1.0 - duty) * period_s; }

// Begin, end and the twelve edges of a period, in order.
std::array<double, 14> edge_instants(const std::array<double, 3>& duty, double period_s, double dead_s) {
  std::array<double, 14> t{};
  std::size_t count = 0;
  for (const double d : duty) {
    const double up_s = rise_s(d, period_s);
    for (const double edge : {up_s, up_s + dead_s, period_s - up_s, period_s - up_s + dead_s}) t[count++] = std::clamp(edge, 0.0, period_s);
  }
  t[count++] = 0.0;
  t[count++] = period_s;
  std::sort(t.begin(), t.end());
  return t;
}

std::array<double, 3> phases_now(const MotorState& s) { return phase_currents(axes(s), s.i_d_A, s.i_q_A); }

}  // namespace

void SwitchedBridge::sub_step(const SwitchedStage& g, const MotorConstants<double>& m, MotorState& s, const std::array<Gates, 3>& gate,
                              const ShaftLoad& load, double dt, SwitchedPeriod& out) {
  const PhaseAxes a = axes(s);
  if (g.faults.any) empty_open_phases(g.faults, a, s);
  const std::array<double, 3> before = phase_currents(a, s.i_d_A, s.i_q_A);
  std::array<Leg, 3> leg;
  for (std::size_t k = 0; k < 3; ++k) leg[k] = leg_voltage(g, k, gate[k], before[k], node_V[k], dt);
  step_machine(m, s, winding_voltage(g.faults, a, leg, m, s), load, dt);
  const std::array<double, 3> after = phases_now(s);
  for (std::size_t k = 0; k < 3; ++k) {
    const double mean_A = g.faults.phase_open[k] ? 0.0 : 0.5 * (before[k] + after[k]);
    out.mean_node_V[k] += leg[k].v_V * dt;
    out.bus_J += (leg[k].bus_share * mean_A + leg[k].short_A) * g.bus_V * dt;
    out.low_current_A[k] = leg[k].low ? mean_A - leg[k].short_A : 0.0;
    node_V[k] = leg[k].end_V;
  }
  if (leg[0].short_A + leg[1].short_A + leg[2].short_A > 0.0) out.shorted_s += dt;
}

SwitchedPeriod SwitchedBridge::step_period(const SwitchedStage& g, const MotorConstants<double>& m, MotorState& s,
                                           const std::array<double, 3>& duty, std::uint8_t gates, const ShaftLoad& load) {
  SwitchedPeriod out;
  const double period_s = 1.0 / g.inverter.pwm_Hz, dead_s = g.inverter.dead_time_s;
  const std::array<double, 14> instants = edge_instants(duty, period_s, dead_s);
  for (std::size_t e = 0; e + 1 < instants.size(); ++e) {
    const std::array<double, 3> at_edge = phases_now(s);
    for (std::size_t k = 0; k < 3; ++k) {
      if (instants[e] == rise_s(duty[k], period_s)) out.rise_A[k] = at_edge[k];
      if (instants[e] == period_s - rise_s(duty[k], period_s)) out.fall_A[k] = at_edge[k];
    }
    const double span_s = instants[e + 1] - instants[e];
    if (span_s < 1e-12) continue;
    std::array<Gates, 3> gate{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Gates told = gates_at(0.5 * (instants[e] + instants[e + 1]), duty[k], period_s, dead_s);
      gate[k] = {told.high && (gates >> k & 1) != 0, told.low && (gates >> (3 + k) & 1) != 0};
    }
    for (double left_s = span_s; left_s > 1e-12;) {
      const double dt_s = std::min(left_s, next_step_s(g, m, gate, phases_now(s)));
      sub_step(g, m, s, gate, load, dt_s, out);
      left_s -= dt_s;
    }
  }
  for (double& v : out.mean_node_V) v /= period_s;
  const auto& v = out.mean_node_V;
  out.mean_v_V = {(2.0 * v[0] - v[1] - v[2]) / 3.0, (v[1] - v[2]) * 0.57735026918962576451};
  return out;
}

}  // namespace rotorloop::sim
