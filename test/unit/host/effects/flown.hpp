// The paper's vehicle and states of flight for tests of its loads: force, torque and rotors of the model with terms, for any scalar.
#pragma once
#include <cmath>
#include <vector>

#include "host/effects/loads.hpp"
#include "host/effects/term.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::host {

inline VehicleModel paper_vehicle() {
  VehicleModel m;
  m.mass_kg = 0.682;
  m.inertia_kg_m2 = {2.41e-3, 3.42e-3, 5.22e-3};
  m.com_offset_m = {1.4e-3, -7e-4, 0.0};
  const double l = 0.0885;
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  m.thrust = {3.12e-6, -1.55e-4, 0.0635, 1.2};
  m.c_q_N_m_s2 = 3.1e-8;
  m.drag = {0.0175, 0.0055, 0.0185};
  m.ceiling_z_m = 3.0;
  return m;
}

inline LoadInput<double> general_flight() {
  LoadInput<double> in;
  in.v_B_m_s = {6.0, -2.0, 1.5};
  in.rates_B_rad_s = {1.0, -2.0, 3.0};
  in.world_B = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  in.p_W_m = {0, 0, 2};
  in.omega_rad_s = {930, 905, 970, 940};
  in.omega_dot_rad_s2 = {800, -500, 300, 1200};
  in.battery_V = 15.0;
  return in;
}

inline LoadInput<double> hover(const VehicleModel& m) {
  LoadInput<double> in;
  in.world_B = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  in.p_W_m = {0, 0, 1.5};
  in.omega_rad_s.fill(hover_omega_rad_s(m));
  in.battery_V = 15.0;
  return in;
}

struct Wrench {
  Eigen::Vector3d force, torque;
  std::array<RotorLoad<double>, kRotors> rotor;
};

// Of the terms twenty seconds after the flight began; whatever swings hangs at rest.
inline constexpr double kInFlight_s = 20.0;
template <class S>
std::vector<S> memory_in_flight(const TermList& terms) {
  std::vector<S> out;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    for (const TermMemory& m : terms.term(i).info.memory) out.push_back(S(m.start_u > 0.0 ? m.start.neutral : kInFlight_s));
  }
  return out;
}

inline Wrench wrench(const VehicleModel& m, const LoadInput<double>& in, const TermList& terms = {},
                     const std::vector<double>& values = {}) {
  const LoadParameters<double> p = load_parameters(m);
  const LoadGeometry g = load_geometry(m);
  LoadState<double> s{in, p, g, {}, {}, {}, {}, {}, {}, {}};
  const std::vector<double> memory = memory_in_flight<double>(terms);
  const TermSet<double> set(terms, values.data(), memory.empty() ? nullptr : memory.data());
  loads(s, &set);
  return {{s.force_B_N.x, s.force_B_N.y, s.force_B_N.z}, {s.torque_B_N_m.x, s.torque_B_N_m.y, s.torque_B_N_m.z}, s.rotor};
}
inline Wrench wrench(const LoadInput<double>& in, const TermList& terms = {}, const std::vector<double>& values = {}) {
  return wrench(paper_vehicle(), in, terms, values);
}

inline TermList only(const Term& term) {
  TermList list;
  list.add(term);
  return list;
}
inline TermList only(std::string_view id) { return only(*find_term(id)); }

inline std::vector<double> neutral(const Term& t) {
  std::vector<double> v;
  for (const TermParameter& p : t.info.parameters) v.push_back(p.neutral);
  return v;
}

}  // namespace rotorloop::host
