// From the numbers of the fit to those of the loads (host/effects), for any scalar of theirs.
#pragma once
#include "bench/sysid/estimate/model/body_state.hpp"
#include "bench/sysid/estimate/model/parameters.hpp"
#include "bench/sysid/estimate/model/rotor_input_sample.hpp"
#include "host/effects/loads.hpp"

namespace rotorloop::estimate {

template <class S>
host::LoadParameters<S> load_parameters(const ModelValues& v) {
  host::LoadParameters<S> p;
  p.k1_N_s2 = S(v[kK1]);
  p.k2_N_s2_m = S(v[kK2]);
  p.c_q_N_m_s2 = S(v[kCq]);
  p.com_x_m = S(v[kComX]);
  p.com_y_m = S(v[kComY]);
  p.c_dh_s_m = S(v[kCdh]);
  p.c_dxy_N_s2_m2 = S(v[kCdxy]);
  p.c_dz_N_s2_m2 = S(v[kCdz]);
  return p;
}

// `world_B`: R_WB transposed; `v_B`: velocity in body axes.
template <class S>
host::LoadInput<S> load_input(const BodyState& x, const Eigen::Matrix3d& world_B, const Eigen::Vector3d& v_B, const RotorInputSample& u,
                              double t_s) {
  host::LoadInput<S> in;
  const auto vec = [](const auto& v) { return host::Vec3<S>{S(v[0]), S(v[1]), S(v[2])}; };
  in.v_B_m_s = vec(v_B);
  in.rates_B_rad_s = vec(x.w_B_rad_s);
  for (int i = 0; i < 3; ++i) in.world_B[static_cast<std::size_t>(i)] = vec(world_B.col(i));
  in.p_W_m = vec(x.p_W_m);
  for (std::size_t r = 0; r < 4; ++r) {
    in.omega_rad_s[r] = S(u.omega_rad_s[r]);
    in.omega_dot_rad_s2[r] = S(u.omega_dot_rad_s2[r]);
  }
  in.t_s = t_s;
  in.battery_V = u.battery_V;
  return in;
}

// Directions of PlaceDual, the first six also of MotionDual: velocity in body axes, body rates, attitude, place.
inline constexpr int kDirVelocity = 0, kDirRates = 3, kDirAttitude = 6, kDirPlace = 9;

template <class S>
void seed_motion(host::LoadInput<S>& in) {
  const auto seed = [](host::Vec3<S>& v, int first) {
    v.x.d[static_cast<std::size_t>(first)] = v.y.d[static_cast<std::size_t>(first) + 1] = v.z.d[static_cast<std::size_t>(first) + 2] = 1.0;
  };
  seed(in.v_B_m_s, kDirVelocity);
  seed(in.rates_B_rad_s, kDirRates);
  if constexpr (std::is_same_v<S, host::PlaceDual>) {
    seed(in.p_W_m, kDirPlace);
    // Turning the body by δφ turns a world axis e, seen from the body, by e x δφ.
    for (auto& e : in.world_B) {
      const double x = e.x.a, y = e.y.a, z = e.z.a;
      constexpr std::size_t a = kDirAttitude;
      e.x.d[a + 1] = -z;
      e.x.d[a + 2] = y;
      e.y.d[a] = z;
      e.y.d[a + 2] = -x;
      e.z.d[a] = -y;
      e.z.d[a + 1] = x;
    }
  }
}

}  // namespace rotorloop::estimate
