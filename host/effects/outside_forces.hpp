// Forces that are not of the air: constants in body axes (which stand for what has no law), pulls of lines, and gravity seen in a frame
// that does not stand upright.
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

struct BodyForceBias {
  static constexpr std::string_view kId = "body_force_bias";
  static constexpr TermParameter kParameters[] = {
      {"x_N", "N", -0.3, 0.3, 0.1, 0.0}, {"y_N", "N", -0.3, 0.3, 0.1, 0.0}, {"z_N", "N", -0.3, 0.3, 0.1, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.force_B_N += Vec3<S>{c[0], c[1], c[2]};
  }
};

struct BodyTorqueBias {
  static constexpr std::string_view kId = "body_torque_bias";
  static constexpr TermParameter kParameters[] = {
      {"x_N_m", "N m", -0.02, 0.02, 5e-3, 0.0}, {"y_N_m", "N m", -0.02, 0.02, 5e-3, 0.0}, {"z_N_m", "N m", -0.02, 0.02, 5e-3, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.torque_B_N_m += Vec3<S>{c[0], c[1], c[2]};
  }
};

// A taut tether, linear about the world's origin: F = f_0 - k p - d v, with f_0 = k times the place where it pulls nothing.
struct Tether {
  static constexpr std::string_view kId = "tether";
  static constexpr TermParameter kParameters[] = {{"stiffness_N_m", "N/m", 0.0, 20.0, 0.2, 0.0},
                                                  {"damping_N_s_m", "N s/m", 0.0, 1.0, 0.5, 0.0},  // alone it is linear_drag
                                                  {"pull_x_N", "N", -5.0, 5.0, 0.2, 0.0},
                                                  {"pull_y_N", "N", -5.0, 5.0, 0.2, 0.0},
                                                  {"pull_z_N", "N", -5.0, 5.0, 0.2, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const Vec3<S>& p = s.in.p_W_m;
    push_in_world(s, Vec3<S>{c[2] - c[0] * p.x, c[3] - c[0] * p.y, c[4] - c[0] * p.z});
    s.force_B_N -= scaled(c[1], s.in.v_B_m_s);
  }
};

// Constant in the world and level: a line drawn off to the side under a steady tension. What it would have upwards belongs to the mass.
struct WorldForce {
  static constexpr std::string_view kId = "world_force";
  static constexpr TermParameter kParameters[] = {{"x_N", "N", -2.0, 2.0, 0.1, 0.0}, {"y_N", "N", -2.0, 2.0, 0.1, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    push_in_world(s, Vec3<S>{c[0], c[1], S(0.0)});
  }
};

// F = -k z e_z of the world: the further up, the more cable hangs from the vehicle. Straight on below the ground's height as well, where
// a log with its zero elsewhere may fly: a shift of z is a constant, and belongs to the mass.
struct HeightPull {
  static constexpr std::string_view kId = "height_pull";
  static constexpr TermParameter kParameters[] = {{"k_N_m", "N/m", 0.0, 2.0, 0.05, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    push_in_world(s, Vec3<S>{S(0.0), S(0.0), c[0] * (s.geometry.ground_z_m - s.in.p_W_m.z)});
  }
};

// The log's world is turned by a small angle about its x and y: gravity then has parts along them.
struct GravityTilt {
  static constexpr std::string_view kId = "gravity_tilt";
  static constexpr TermParameter kParameters[] = {{"about_y_rad", "rad", -0.05, 0.05, 0.01, 0.0},
                                                  {"about_x_rad", "rad", -0.05, 0.05, 0.01, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const double weight = s.geometry.mass_kg * kGravity_m_s2;
    push_in_world(s, Vec3<S>{c[0] * -weight, c[1] * weight, S(0.0)});
  }
};

}  // namespace rotorloop::host
