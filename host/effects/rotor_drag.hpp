// Forces of the rotors in their plane, where the paper's eq. (4) has -c_dh ΣT v_xy at the centre of mass: another size, another law,
// another place.
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// The rotors' whole force in their plane, eq. (4) and what goes with rotor speed, times (1 + more).
template <class S>
void add_rotor_drag(const S& more, LoadState<S>& s) {
  const S drag = more * s.parameters.c_dh_s_m * s.thrust_sum_N;
  s.force_B_N.x -= drag * s.v_air_B_m_s.x;
  s.force_B_N.y -= drag * s.v_air_B_m_s.y;
  for (std::size_t i = 0; i < kRotors; ++i) {
    const Vec3<S> v = hub_velocity(s, i);
    const S own = more * s.rotor[i].drag_N_s_m;
    push_at_hub(s, i, -(own * v.x), -(own * v.y));
  }
}

struct RotorDrag {
  static constexpr std::string_view kId = "rotor_drag";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 2.0, 0.5, 1.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    add_rotor_drag(c[0] - 1.0, s);
  }
};

// The same load as rotor_drag: only a measurement of the rotor alone distinguishes the two.
struct RotorBodyInterference {
  static constexpr std::string_view kId = "rotor_body_interference";
  static constexpr TermParameter kParameters[] = {{"k_H", "1", 1.0, 4.0, 0.5, 1.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    add_rotor_drag(c[0] - 1.0, s);
  }
};

// In proportion to rotor speed instead of thrust, -k_d ω_i v_xy (Bangura 2016), each at its hub with the hub's velocity v + Ω x r_i.
struct RotorDragWithSpeed {
  static constexpr std::string_view kId = "rotor_drag_with_speed";
  static constexpr TermParameter kParameters[] = {{"k_d_N_s2_m", "N s2/m", 0.0, 1e-3, 1e-5, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].drag_N_s_m += c[0] * magnitude(s.omega_rad_s[i]);
  }
};

// In proportion to the flow through the disk, -k (v_z + v_i) v_xy at each hub: the air that a rotor draws in it takes along edgewise.
struct RotorDragWithInflow {
  static constexpr std::string_view kId = "rotor_drag_with_inflow";
  static constexpr TermParameter kParameters[] = {{"k_N_s2_m2", "N s2/m2", -0.05, 0.05, 1e-3, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].drag_N_s_m += c[0] * s.rotor[i].through_m_s;
  }
};

// Eq. (4) at each hub with its own thrust and velocity v + Ω x r_i. Damps yaw, and turns the body when thrusts differ or the disks do
// not lie in the plane of the centre of mass. No new coefficient: physics says share = 1, the paper share = 0.
struct RotorDragAtHubs {
  static constexpr std::string_view kId = "rotor_drag_at_hubs";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 2.0, 1.0, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const S at_centre = c[0] * s.parameters.c_dh_s_m * s.thrust_sum_N;
    s.force_B_N.x += at_centre * s.v_air_B_m_s.x;
    s.force_B_N.y += at_centre * s.v_air_B_m_s.y;
    for (std::size_t i = 0; i < kRotors; ++i) {
      const Vec3<S> v = hub_velocity(s, i);
      const S drag = c[0] * s.parameters.c_dh_s_m * s.rotor[i].thrust_N;
      push_at_hub(s, i, -(drag * v.x), -(drag * v.y));
    }
  }
};

// τ = h e_z x F with F the rotors' force in their plane: the disks lie higher above the centre of mass than nominal.
struct RotorPlaneHeight {
  static constexpr std::string_view kId = "rotor_plane_height";
  static constexpr TermParameter kParameters[] = {{"h_m", "m", -0.05, 0.05, 0.02, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    S drag = s.parameters.c_dh_s_m * s.thrust_sum_N;
    for (const RotorLoad<S>& r : s.rotor) drag += r.drag_N_s_m;
    s.torque_B_N_m.x += c[0] * drag * s.v_air_B_m_s.y;
    s.torque_B_N_m.y -= c[0] * drag * s.v_air_B_m_s.x;
  }
};

}  // namespace rotorloop::host
