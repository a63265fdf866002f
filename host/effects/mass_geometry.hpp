// Mass and geometry other than the vehicle file says. Products of inertia are not here: their torque needs the angular acceleration,
// so they are parameters of the fit itself (body.inertia.xy, xz, yz).
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// The centre of mass lies further by (dx, dy): hub arms shrink by as much.
struct ComOffset {
  static constexpr std::string_view kId = "com_offset";
  static constexpr TermParameter kParameters[] = {{"dx_m", "m", -0.05, 0.05, 1e-3, 0.0}, {"dy_m", "m", -0.05, 0.05, 1e-3, 0.0}};

  template <class S>
  static void inflow(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].arm_B_m.x -= c[0];
    s.rotor[i].arm_B_m.y -= c[1];
  }
};

// A load at the centre of mass: the same forces accelerate more mass. The fit divides by the believed mass, hence the factor.
struct PayloadMass {
  static constexpr std::string_view kId = "payload_mass";
  static constexpr TermParameter kParameters[] = {{"mass_kg", "kg", 0.0, 0.5, 0.05, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const S factor = s.geometry.mass_kg / (s.geometry.mass_kg + c[0]);
    s.force_B_N = scaled(factor, s.force_B_N);
  }
};

// Shafts askew, as far as four nearly equal thrusts can tell: a common lean towards x and y, and a common twist, each shaft leaning
// along its circle about the centre so that thrust turns the body left. One motor askew by an angle gives a quarter of it in each.
struct RotorTilt {
  static constexpr std::string_view kId = "rotor_tilt";
  static constexpr TermParameter kParameters[] = {
      {"lean_x_rad", "rad", -0.1, 0.1, 0.01, 0.0}, {"lean_y_rad", "rad", -0.1, 0.1, 0.01, 0.0}, {"twist_rad", "rad", -0.1, 0.1, 0.01, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      const auto& at = s.geometry.rotors[i].position_m;
      const double arm = std::sqrt(at.x() * at.x() + at.y() * at.y());
      if (arm <= 0.0) continue;
      const S& thrust = s.rotor[i].thrust_N;
      push_at_hub(s, i, thrust * (c[0] - c[2] * (at.y() / arm)), thrust * (c[1] + c[2] * (at.x() / arm)));
    }
  }
};

}  // namespace rotorloop::host
