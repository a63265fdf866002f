// What a rotor meets of the air: the motion of its own hub, the wakes of its neighbours, its own wake in descent.
#pragma once
#include "host/effects/loads.hpp"
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// Each rotor meets the air at its own place: v_i = v + share * (Ω x r_i) in eq. (1)-(2), where the paper takes the velocity of
// the centre of mass for all four. Damps roll and pitch. Physics says share = 1; the paper's model is share = 0.
struct RotorLocalInflow {
  static constexpr std::string_view kId = "rotor_local_inflow";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 1.3, 1.0, 0.0}};

  template <class S>
  static void inflow(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].v_air_B_m_s += scaled(c[0], cross(s.in.rates_B_rad_s, s.rotor[i].arm_B_m));
  }
};

// Share of the climb speed that eq. (1)-(2) feel.
struct AxialInflow {
  static constexpr std::string_view kId = "axial_inflow";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 1.3, 1.0, 1.0}};

  template <class S>
  static void inflow(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].v_air_B_m_s.z *= c[0];
  }
};

// Share of what edgewise flight adds to the thrust in eq. (2), against the same rotor without edgewise flow.
struct TranslationalLift {
  static constexpr std::string_view kId = "translational_lift";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 1.0, 1.0, 1.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    RotorLoad<S>& r = s.rotor[i];
    S through;
    const S axial = rotor_thrust(s.parameters, s.geometry, s.omega_rad_s[i], Vec3<S>{S(0.0), S(0.0), r.v_air_B_m_s.z}, through);
    const S whole = rotor_thrust(s.parameters, s.geometry, s.omega_rad_s[i], r.v_air_B_m_s, through);
    r.thrust_N += (c[0] - 1.0) * (whole - axial);
  }
};

// A rotor behind others flies in their wakes, which come down at up to twice their induced velocity once they are developed, as far
// as the flow of flight turns them backwards: v_z,i += κ 2 v_f max(0, -r_i·v_xy) / sqrt(v_xy² + v_f²), r_i the unit vector to the hub.
// v_f is that of the mean rotor speed in still air.
struct RotorWakeInterference {
  static constexpr std::string_view kId = "rotor_wake_interference";
  static constexpr TermParameter kParameters[] = {{"kappa", "1", 0.0, 1.0, 0.3, 0.0}};

  template <class S>
  static void inflow(const S* c, LoadState<S>& s, std::size_t i) {
    RotorLoad<S>& r = s.rotor[i];
    S sum{};
    for (const S& w : s.omega_rad_s) sum += magnitude(w);
    const S front = (1.0 / kRotors) * still_flow_m(s) * sum;
    const auto& at = s.geometry.rotors[i].position_m;
    const double arm = std::sqrt(at.x() * at.x() + at.y() * at.y());
    if (arm <= 0.0) return;
    const Vec3<S>& v = s.v_air_B_m_s;
    const S behind = positive_part((v.x * at.x() + v.y * at.y()) * (-1.0 / arm));
    r.v_air_B_m_s.z += c[0] * 2.0 * front * behind / square_root(across2(v) + front * front + 1e-12);
  }
};

// The same wakes as a share of thrust: T_i -= loss T_i b / sqrt(v_xy² + (reach v_h)²), b = max(0, -r_i·v_xy) as above. Blades in air that
// is stirred, and turned by the wake's swirl, lose more than the downwash of its axial flow says, and with other rotor speeds in another
// proportion. reach v_h: speed of flight from which on the wakes meet the rotors behind, v_h that of the mean rotor speed in still air; far
// below it they fall past them.
struct RotorWakeThrustLoss {
  static constexpr std::string_view kId = "rotor_wake_thrust_loss";
  static constexpr TermParameter kParameters[] = {{"loss", "1", 0.0, 0.5, 0.05, 0.0}, {"reach", "1", 0.05, 2.0, 0.5, 0.5}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const auto& at = s.geometry.rotors[i].position_m;
    const double arm = std::sqrt(at.x() * at.x() + at.y() * at.y());
    if (arm <= 0.0) return;
    S sum{};
    for (const S& w : s.omega_rad_s) sum += magnitude(w);
    const S from = c[1] * (1.0 / kRotors) * still_flow_m(s) * sum;
    const Vec3<S>& v = s.v_air_B_m_s;
    const S behind = positive_part((v.x * at.x() + v.y * at.y()) * (-1.0 / arm));
    s.rotor[i].thrust_N -= c[0] * s.rotor[i].thrust_N * behind / square_root(across2(v) + from * from + 1e-12);
  }
};

// The downwash of rotor_wake_interference between the two rotors of a pair, one number for each kind of pair, of either sign: side by side,
// one behind the other, and across the diagonal. Rotor i flies behind rotor j by b = max(0, -e·v) with e the unit vector from j to i: v_z,i
// += κ 2 v_j b / sqrt(v_xy² + v_j²). On the diagonal b = -(e·v) cos 2(φ - ψ), φ the direction of flight and ψ that of e: both rotors feel
// it, and it turns its sign where the flow runs along the sides. v_j is that of rotor j in still air.
struct RotorPairInteraction {
  static constexpr std::string_view kId = "rotor_pair_interaction";
  static constexpr TermParameter kParameters[] = {{"kappa_lateral", "1", -1.0, 1.0, 0.3, 0.0},
                                                  {"kappa_longitudinal", "1", -1.0, 1.0, 0.3, 0.0},
                                                  {"kappa_diagonal", "1", -1.0, 1.0, 0.3, 0.0}};
  // A pair stands side by side, or one behind the other, when its line is within 22.5 degrees of y, of x.
  static constexpr double kWithin = 0.9238795325112867;

  template <class S>
  static void inflow(const S* c, LoadState<S>& s, std::size_t i) {
    const Vec3<S>& v = s.v_air_B_m_s;
    const S edgewise2 = across2(v);
    for (std::size_t j = 0; j < kRotors; ++j) {
      if (j == i) continue;
      const Eigen::Vector3d apart = s.geometry.rotors[i].position_m - s.geometry.rotors[j].position_m;
      const double length = std::sqrt(apart.x() * apart.x() + apart.y() * apart.y());
      if (length <= 0.0) continue;
      const double ex = apart.x() / length, ey = apart.y() / length;
      const S along = ex * v.x + ey * v.y;
      S behind;
      if (std::fabs(ey) > kWithin) {
        behind = c[0] * positive_part(-along);
      } else if (std::fabs(ex) > kWithin) {
        behind = c[1] * positive_part(-along);
      } else {
        behind = c[2] * along * (1.0 - 2.0 * along * along / (edgewise2 + 1e-12));
      }
      const S wake = still_flow_m(s) * magnitude(s.omega_rad_s[j]);
      s.rotor[i].v_air_B_m_s.z += 2.0 * wake * behind / square_root(edgewise2 + wake * wake + 1e-12);
    }
  }
};

// Loss among neighbours, gone once edgewise flight has carried the wakes away.
struct HoverInterference {
  static constexpr std::string_view kId = "hover_interference";
  static constexpr TermParameter kParameters[] = {{"loss", "1", 0.0, 0.1, 0.03, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    RotorLoad<S>& r = s.rotor[i];
    r.thrust_N -= c[0] * r.thrust_N * wake_below(r);
  }
};

// In descent the flow through the disk is more than eq. (2) has it, because part of the own wake comes back: T_i -= k 2ρA v_z², at most
// k T_i. k in units of (v_z / v_h)²: 0.17 for the curve of measured inflow in Johnson, NASA TP-2005-213477, up to 0.8 v_h.
struct DescentInflow {
  static constexpr std::string_view kId = "descent_inflow";
  static constexpr TermParameter kParameters[] = {{"loss", "1", 0.0, 0.5, 0.1, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    RotorLoad<S>& r = s.rotor[i];
    const S fall = momentum_kg_m(s.geometry) * squared(positive_part(-r.v_air_B_m_s.z));
    const S most = positive_part(r.thrust_N);
    r.thrust_N -= c[0] * (value_of(fall) < value_of(most) ? fall : most);
  }
};

// Descent into the own wake: bounds of the ring state after Johnson, NASA TP-2005-213477, in units of v_h = sqrt(T / 2ρA): from 0.3 to
// 1.7 of descent, up to 0.95 across; smooth in between.
struct VortexRingLoss {
  static constexpr std::string_view kId = "vortex_ring_loss";
  static constexpr TermParameter kParameters[] = {{"loss", "1", 0.0, 0.4, 0.15, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    RotorLoad<S>& r = s.rotor[i];
    if (value_of(r.thrust_N) <= 0.0) return;
    const S v_h2 = r.thrust_N * (1.0 / momentum_kg_m(s.geometry));
    const S u2 = squared(r.v_air_B_m_s.z / square_root(v_h2) + 1.0) * (1.0 / 0.49);
    const S m = across2(r.v_air_B_m_s) / v_h2 * (1.0 / 0.9025);
    if (value_of(u2) >= 1.0 || value_of(m) >= 1.0) return;
    r.thrust_N -= c[0] * r.thrust_N * squared(1.0 - u2) * squared(1.0 - m) * (1.0 + 2.0 * m);
  }
};

}  // namespace rotorloop::host
