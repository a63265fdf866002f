// Mass and geometry other than the vehicle file says. Products of inertia are not here: their torque needs the angular acceleration,
// so they are parameters of the fit itself (body.inertia.xy, xz, yz).
#pragma once
#include "host/effects/flight_time.hpp"
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

// m = m_0 (1 + rate t), t since the start of the flight: fuel that is burnt, a tank that is emptied. The fit divides by m_0; what leaves
// the vehicle takes no momentum with it, and inertia and centre of mass stay.
struct MassDrift : FlightTime {
  static constexpr std::string_view kId = "mass_drift";
  static constexpr TermParameter kParameters[] = {{"rate_1_s", "1/s", -0.01, 0.01, 1.5e-3, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.force_B_N = scaled(1.0 / share_in_time(c[0], s.memory[0]), s.force_B_N);
  }
};

// A load fixed to the body: mass and its first moment about the nominal centre of mass. The same forces accelerate more mass, about a
// centre of mass that moves towards the load, and turn more inertia (parallel axes, once the mass is there to divide by). The fit
// divides by the nominal mass and inertia, hence the factors. The place of the pose sensor counts from the centre of mass as well.
struct PayloadMass {
  static constexpr std::string_view kId = "payload_mass";
  // A moment without mass is com_offset: it does not matter by itself.
  static constexpr TermParameter kParameters[] = {{"mass_kg", "kg", 0.0, 0.5, 0.05, 0.0},
                                                  {"moment_x_kg_m", "kg m", -0.25, 0.25, 0.5, 0.0},
                                                  {"moment_y_kg_m", "kg m", -0.25, 0.25, 0.5, 0.0},
                                                  {"moment_z_kg_m", "kg m", -0.25, 0.25, 0.5, 0.0}};
  static constexpr double kLeast_kg = 1e-3;  // below it the place says nothing

  template <class S>
  static Vec3<S> shift_m(const S* c, double mass_kg) {
    const S per_mass = 1.0 / (mass_kg + c[0]);
    return {c[1] * per_mass, c[2] * per_mass, c[3] * per_mass};
  }

  template <class S>
  static void inflow(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].arm_B_m -= shift_m(c, s.geometry.mass_kg);
  }

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const double mass = s.geometry.mass_kg;
    const S factor = mass / (mass + c[0]);
    s.force_B_N = scaled(factor, s.force_B_N);
    if (value_of(c[0]) < kLeast_kg) return;
    const S per_mass = factor / c[0];
    const auto about = [&](const S& torque, double inertia, const S& a, const S& b) {
      return inertia > 0.0 ? torque * (inertia / (inertia + per_mass * (a * a + b * b))) : torque;
    };
    s.torque_B_N_m = {about(s.torque_B_N_m.x, s.geometry.inertia_kg_m2[0], c[2], c[3]),
                      about(s.torque_B_N_m.y, s.geometry.inertia_kg_m2[1], c[3], c[1]),
                      about(s.torque_B_N_m.z, s.geometry.inertia_kg_m2[2], c[1], c[2])};
  }

  template <class S>
  static void reading(const S* c, ReadingState<S>& r) {
    const Vec3<S> back = shift_m(c, r.mass_kg);
    const auto to_world = [&](const Vec3<S>& v) {
      return Vec3<S>{dot(r.in.world_B[0], v), dot(r.in.world_B[1], v), dot(r.in.world_B[2], v)};
    };
    r.position_W_m -= to_world(back);
    r.velocity_W_m_s -= to_world(cross(r.in.rates_B_rad_s, back));
  }
};

// Shafts askew, as far as four nearly equal thrusts determine it: a common lean towards x and y, and a common twist, each shaft leaning
// along its circle about the centre so that thrust turns the body left. One motor askew by an angle gives a quarter of it in each.
struct RotorTilt {
  static constexpr std::string_view kId = "rotor_tilt";
  static constexpr TermParameter kParameters[] = {
      {"lean_x_rad", "rad", -0.1, 0.1, 4e-3, 0.0},
      {"lean_y_rad", "rad", -0.1, 0.1, 4e-3, 0.0},
      {"twist_rad", "rad", -0.1, 0.1, 4e-3, 0.0}};  // a quarter of a degree: one motor askew by one

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
