#include "host/effects/loads.hpp"

#include "host/effects/advance.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::host {

LoadGeometry load_geometry(const VehicleModel& model) {
  LoadGeometry g;
  g.rotors = model.rotors;
  g.com_z_m = model.com_offset_m.z();
  g.radius_m = model.thrust.radius_m;
  g.air_density_kg_m3 = model.thrust.air_density_kg_m3;
  g.advance = model.advance;
  g.mass_kg = model.mass_kg;
  g.inertia_kg_m2 = {model.inertia_kg_m2.x(), model.inertia_kg_m2.y(), model.inertia_kg_m2.z()};
  g.ceiling_z_m = model.ceiling_z_m;
  return g;
}

LoadParameters<double> load_parameters(const VehicleModel& m) {
  return {m.thrust.k1_N_s2,   m.thrust.k2_N_s2_m, m.c_q_N_m_s2,         m.com_offset_m.x(),
          m.com_offset_m.y(), m.drag.c_dh_s_m,    m.drag.c_dxy_N_s2_m2, m.drag.c_dz_N_s2_m2};
}

template <class S>
S rotor_thrust(const LoadParameters<S>& p, const LoadGeometry& g, const S& omega, const Vec3<S>& v, S& through) {
  const ThrustModel model{value_of(p.k1_N_s2), value_of(p.k2_N_s2_m), g.radius_m, g.air_density_kg_m3};
  const S across2 = v.x * v.x + v.y * v.y;
  const RotorThrust solved = solve_thrust(model, value_of(omega), value_of(v.z), std::sqrt(value_of(across2)));
  if (solved.status == ThrustStatus::stopped || solved.status == ThrustStatus::bad_input) {
    through = v.z;
    return S(0.0);
  }
  const double u = value_of(v.z) + solved.induced_m_s;
  const S speed = magnitude(omega);  // a rotor's sense of rotation is not the sign of its speed
  if constexpr (std::is_same_v<S, double>) {
    through = u;
  } else {
    // One Newton step in S from the root: changes the value by nothing, the derivatives to those of the root.
    const double q = model.momentum_kg_m(), w2 = value_of(across2);
    const double s = std::fmax(std::sqrt(u * u + w2), 1e-9);
    double slope = q * s + q * solved.induced_m_s * u / s - model.k2_N_s2_m * value_of(speed);
    if (std::fabs(slope) < 1e-6 * q) slope = std::copysign(1e-6 * q, slope);
    S difference = (u - v.z) * square_root(across2 + u * u) * q - p.k2_N_s2_m * speed * u - p.k1_N_s2 * omega * omega;
    difference.a = 0.0;
    through = u - difference / slope;
  }
  return p.k1_N_s2 * omega * omega + p.k2_N_s2_m * speed * through;
}

// Thrust and drag, eq. (4), (5).
template <class S>
void drag_of_airframe(LoadState<S>& s) {
  const LoadParameters<S>& p = s.parameters;
  const Vec3<S>& v = s.v_air_B_m_s;
  const S rotor_drag = p.c_dh_s_m * s.thrust_sum_N;
  s.force_B_N.x = -(rotor_drag * v.x) - p.c_dxy_N_s2_m2 * v.x * magnitude(v.x);
  s.force_B_N.y = -(rotor_drag * v.y) - p.c_dxy_N_s2_m2 * v.y * magnitude(v.y);
  s.force_B_N.z = s.thrust_sum_N - p.c_dz_N_s2_m2 * v.z * magnitude(v.z);
}

template <class S>
void loads(LoadState<S>& s, const TermSet<S>* terms) {
  const auto each = [&](auto&& act) {
    if constexpr (!std::is_same_v<S, MotionDual>) {
      if (!terms) return;
      terms->each([&](const auto& h, const void* own, const S* c, const S* memory) {
        s.memory = memory;
        act(h, own, c);
      });
    }
  };
  s.omega_rad_s = s.in.omega_rad_s;
  s.omega_dot_rad_s2 = s.in.omega_dot_rad_s2;
  each([&](const auto& h, const void* own, const S* c) {
    if (h.speeds) h.speeds(own, c, s);
  });
  s.v_air_B_m_s = s.in.v_B_m_s;
  each([&](const auto& h, const void* own, const S* c) {
    if (h.air) h.air(own, c, s);
  });

  const LoadParameters<S>& p = s.parameters;
  s.thrust_sum_N = S(0.0);
  s.torque_B_N_m = {};
  s.hub_moment_share = S(1.0);
  for (std::size_t i = 0; i < kRotors; ++i) {
    RotorLoad<S>& r = s.rotor[i];
    const RotorMount& mount = s.geometry.rotors[i];
    r.arm_B_m = {mount.position_m.x() - p.com_x_m, mount.position_m.y() - p.com_y_m, S(mount.position_m.z() - s.geometry.com_z_m)};
    r.v_air_B_m_s = s.v_air_B_m_s;
    each([&](const auto& h, const void* own, const S* c) {
      if (h.inflow) h.inflow(own, c, s, i);
    });
    r.thrust_N = rotor_thrust(p, s.geometry, s.omega_rad_s[i], r.v_air_B_m_s, r.through_m_s);
    r.torque_N_m = p.c_q_N_m_s2 * s.omega_rad_s[i] * s.omega_rad_s[i];
    if (s.geometry.advance.c_q2_N_m_s2 != 0.0)
      r.torque_N_m += advance_torque_N_m(s.geometry.advance, s.geometry.radius_m, s.omega_rad_s[i], r.v_air_B_m_s.z);
    r.drag_N_s_m = S(0.0);
    each([&](const auto& h, const void* own, const S* c) {
      if (h.rotor) h.rotor(own, c, s, i);
    });
    s.thrust_sum_N += r.thrust_N;
    // Eq. (3).
    s.torque_B_N_m.x += r.arm_B_m.y * r.thrust_N;
    s.torque_B_N_m.y -= r.arm_B_m.x * r.thrust_N;
    s.torque_B_N_m.z += static_cast<double>(mount.reaction) * r.torque_N_m;
  }
  drag_of_airframe(s);
  for (std::size_t i = 0; terms && i < kRotors; ++i) {
    const Vec3<S> at = hub_velocity(s, i);
    push_at_hub(s, i, -(s.rotor[i].drag_N_s_m * at.x), -(s.rotor[i].drag_N_s_m * at.y));
  }
  each([&](const auto& h, const void* own, const S* c) {
    if (h.body) h.body(own, c, s);
  });
}

template <class S>
void readings(ReadingState<S>& r, const TermSet<S>& terms) {
  terms.each([&](const auto& h, const void* own, const S* c, const S* memory) {
    r.memory = memory;
    if (h.reading) h.reading(own, c, r);
  });
}

template double rotor_thrust(const LoadParameters<double>&, const LoadGeometry&, const double&, const Vec3<double>&, double&);
template MotionDual rotor_thrust(const LoadParameters<MotionDual>&, const LoadGeometry&, const MotionDual&, const Vec3<MotionDual>&,
                                 MotionDual&);
template PlaceDual rotor_thrust(const LoadParameters<PlaceDual>&, const LoadGeometry&, const PlaceDual&, const Vec3<PlaceDual>&,
                                PlaceDual&);
template ExtraDual rotor_thrust(const LoadParameters<ExtraDual>&, const LoadGeometry&, const ExtraDual&, const Vec3<ExtraDual>&,
                                ExtraDual&);
template void loads(LoadState<double>&, const TermSet<double>*);
template void loads(LoadState<MotionDual>&, const TermSet<MotionDual>*);
template void loads(LoadState<PlaceDual>&, const TermSet<PlaceDual>*);
template void loads(LoadState<ExtraDual>&, const TermSet<ExtraDual>*);
template void readings(ReadingState<double>&, const TermSet<double>&);
template void readings(ReadingState<PlaceDual>&, const TermSet<PlaceDual>&);
template void readings(ReadingState<ExtraDual>&, const TermSet<ExtraDual>&);

}  // namespace rotorloop::host
