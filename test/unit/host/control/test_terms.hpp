// Terms made for the tests of the controller: each acts through one hook, and the vehicle that a test flies or computes by hand
// has the same effect in equations of its own.
#pragma once
#include "host/effects/term.hpp"
#include "host/effects/vehicle_terms.hpp"

namespace rotorloop::test {

using host::kRotors;
using host::LoadState;
using host::TermParameter;

struct ThrustScale {  // T_i = scale T
  static constexpr std::string_view kId = "test_thrust_scale";
  static constexpr TermParameter kParameters[] = {{"scale", "1", 0.1, 5.0, 0.1, 1.0}};
  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N *= c[0];
  }
};

struct ThrustGrowth {  // T_i = T (1 + growth (ω/940 - 1)): c_t that grows with speed
  static constexpr std::string_view kId = "test_thrust_growth";
  static constexpr TermParameter kParameters[] = {{"growth", "1", -1.0, 1.0, 0.2, 0.0}};
  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N *= 1.0 + c[0] * (s.omega_rad_s[i] / 940.0 - 1.0);
  }
};

struct WeakThird {  // rotor 3 gives (1 + epsilon) of its thrust
  static constexpr std::string_view kId = "test_weak_third";
  static constexpr TermParameter kParameters[] = {{"epsilon", "1", -0.5, 0.5, 0.1, 0.0}};
  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    if (i == 2) s.rotor[i].thrust_N *= 1.0 + c[0];
  }
};

struct RearDownwash {  // rotors 2 and 4 climb faster than they fly, by kappa |v_x|
  static constexpr std::string_view kId = "test_rear_downwash";
  static constexpr TermParameter kParameters[] = {{"kappa", "1", 0.0, 1.0, 0.1, 0.0}};
  template <class S>
  static void inflow(const S* c, LoadState<S>& s, std::size_t i) {
    if (i % 2 == 1) s.rotor[i].v_air_B_m_s.z += c[0] * host::magnitude(s.v_air_B_m_s.x);
  }
};

struct Push {  // force along x of the body, torque about its y
  static constexpr std::string_view kId = "test_push";
  static constexpr TermParameter kParameters[] = {{"x_N", "N", -100.0, 100.0, 0.1, 0.0}, {"about_y_N_m", "N m", -100.0, 100.0, 0.01, 0.0}};
  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.force_B_N.x += c[0];
    s.torque_B_N_m.y += c[1];
  }
};

inline constexpr host::Term kThrustScale = host::make_term<ThrustScale>();
inline constexpr host::Term kThrustGrowth = host::make_term<ThrustGrowth>();
inline constexpr host::Term kWeakThird = host::make_term<WeakThird>();
inline constexpr host::Term kRearDownwash = host::make_term<RearDownwash>();
inline constexpr host::Term kPush = host::make_term<Push>();

inline void add(host::VehicleTerms& terms, const host::Term& term, std::initializer_list<double> values) {
  terms.add(term, {values.begin(), values.size()});
}
inline host::VehicleTerms terms_with(const host::Term& term, std::initializer_list<double> values) {
  host::VehicleTerms out;
  add(out, term, values);
  return out;
}

}  // namespace rotorloop::test
