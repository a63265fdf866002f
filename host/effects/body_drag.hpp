// Forces of the air on the airframe beside or instead of eq. (5).
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

struct ParasiticDrag {
  static constexpr std::string_view kId = "parasitic_drag";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 3.0, 0.5, 1.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.force_B_N += scaled(c[0] - 1.0, airframe_drag(s));
  }
};

// Eq. (5) squares each axis for itself, which makes drag at 45 degrees of heading smaller by sqrt 2 than a round body has:
// -c_dxy |v_xy| v_xy with share = 1.
struct DragIsotropy {
  static constexpr std::string_view kId = "drag_isotropy";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 2.0, 0.5, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const Vec3<S>& v = s.v_air_B_m_s;
    const S speed = square_root(across2(v)), k = c[0] * s.parameters.c_dxy_N_s2_m2;
    s.force_B_N.x -= k * v.x * (speed - magnitude(v.x));
    s.force_B_N.y -= k * v.y * (speed - magnitude(v.y));
  }
};

struct LinearDrag {
  static constexpr std::string_view kId = "linear_drag";
  static constexpr TermParameter kParameters[] = {{"d_x_N_s_m", "N s/m", 0.0, 0.5, 0.05, 0.0},
                                                  {"d_y_N_s_m", "N s/m", 0.0, 0.5, 0.05, 0.0},
                                                  {"d_z_N_s_m", "N s/m", 0.0, 0.5, 0.05, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const Vec3<S>& v = s.v_air_B_m_s;
    s.force_B_N -= Vec3<S>{c[0] * v.x, c[1] * v.y, c[2] * v.z};
  }
};

// Eq. (5) acts at (x, y, z) from the centre of mass.
struct DragCentreOffset {
  static constexpr std::string_view kId = "drag_centre_offset";
  static constexpr TermParameter kParameters[] = {
      {"z_m", "m", -0.05, 0.05, 0.02, 0.0}, {"x_m", "m", -0.05, 0.05, 0.02, 0.0}, {"y_m", "m", -0.05, 0.05, 0.02, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.torque_B_N_m += cross(Vec3<S>{c[1], c[2], c[0]}, airframe_drag(s));
  }
};

struct BodyLift {
  static constexpr std::string_view kId = "body_lift";
  static constexpr TermParameter kParameters[] = {{"k_L_N_s2_m2", "N s2/m2", -0.02, 0.02, 2e-3, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.force_B_N.z += c[0] * across2(s.v_air_B_m_s);
  }
};

}  // namespace rotorloop::host
