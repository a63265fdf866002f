// What the loads of a moment are reckoned from, and the steps on their way (loads.hpp), for any scalar: double for flying and
// predicting, Dual<N> for fitting. A load comes about in the order of LoadState's members; a term acts on one or more of them.
// Body axes B at the centre of mass, x forward, y left, z up; SI units throughout.
#pragma once
#include <array>
#include <cstddef>
#include <limits>

#include "host/effects/dual.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::host {

template <class S>
struct Vec3 {
  S x{}, y{}, z{};
  Vec3& operator+=(const Vec3& o) {
    x += o.x;
    y += o.y;
    z += o.z;
    return *this;
  }
  Vec3& operator-=(const Vec3& o) {
    x -= o.x;
    y -= o.y;
    z -= o.z;
    return *this;
  }
  friend Vec3 operator+(Vec3 a, const Vec3& b) { return a += b; }
  friend Vec3 operator-(Vec3 a, const Vec3& b) { return a -= b; }
};
template <class A, class S>
Vec3<S> scaled(const A& a, const Vec3<S>& v) {
  return {a * v.x, a * v.y, a * v.z};
}
template <class S>
S dot(const Vec3<S>& a, const Vec3<S>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class S>
Vec3<S> cross(const Vec3<S>& a, const Vec3<S>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// The parameters of eq. (1)-(5) that can be estimated, and those that are measured on the ground.
template <class S>
struct LoadParameters {
  S k1_N_s2{}, k2_N_s2_m{};
  S c_q_N_m_s2{};
  S com_x_m{}, com_y_m{};  // centre of mass from the geometric centre (Δx, Δy)
  S c_dh_s_m{}, c_dxy_N_s2_m2{}, c_dz_N_s2_m2{};
};
inline constexpr int kLoadParameters = 8;

struct LoadGeometry {
  std::array<RotorMount, kRotors> rotors{};
  double com_z_m = 0.0;
  double radius_m = 0.0, air_density_kg_m3 = 0.0;
  AdvanceModel advance;  // c_q(J), known from a stand
  double mass_kg = 0.0;
  std::array<double, 3> inertia_kg_m2{};                         // about x, y, z, nominal
  double ground_z_m = 0.0;                                       // in the log's world; for the effects of the ground
  double ceiling_z_m = std::numeric_limits<double>::infinity();  // of the room; infinite: none is known, and none acts
};

// What a load depends on at one moment.
template <class S>
struct LoadInput {
  Vec3<S> v_B_m_s;  // centre of mass over ground
  Vec3<S> rates_B_rad_s;
  std::array<Vec3<S>, 3> world_B{};  // the world's x, y, z axes in body axes (columns of R transposed)
  Vec3<S> p_W_m;
  std::array<S, kRotors> omega_rad_s{}, omega_dot_rad_s2{};
  double t_s = 0.0, battery_V = 0.0;
};

template <class S>
struct RotorLoad {
  Vec3<S> arm_B_m;      // hub from the centre of mass
  Vec3<S> v_air_B_m_s;  // hub relative to the air
  S through_m_s{};      // flow through the disk, v_z + v_i
  S thrust_N{};         // along +z
  S torque_N_m{};       // aerodynamic, > 0; acts on the body about z with the sign `reaction`
  S drag_N_s_m{};       // force in the disk plane over the hub's velocity there, beside eq. (4)
};

template <class S>
struct LoadState {
  const LoadInput<S>& in;
  const LoadParameters<S>& parameters;
  const LoadGeometry& geometry;
  std::array<S, kRotors> omega_rad_s, omega_dot_rad_s2;  // terms of the speed sensor act here
  Vec3<S> v_air_B_m_s;                                   // centre of mass relative to the air: wind acts here
  std::array<RotorLoad<S>, kRotors> rotor{};             // inflow terms act on v_air, thrust and torque terms on the loads
  S thrust_sum_N{};
  Vec3<S> force_B_N, torque_B_N_m;  // the answer, gravity not included
  const S* memory = nullptr;        // of the term whose hook runs (memory.hpp); never null there
  S hub_moment_share{1.0};          // of what rigid blades pass on to their hub
};

// A force in the disk plane of rotor i, in body axes, with its moment.
template <class S>
void push_at_hub(LoadState<S>& s, std::size_t i, const S& x, const S& y) {
  const Vec3<S>& arm = s.rotor[i].arm_B_m;
  s.force_B_N.x += x;
  s.force_B_N.y += y;
  s.torque_B_N_m.x -= arm.z * y;
  s.torque_B_N_m.y += arm.z * x;
  s.torque_B_N_m.z += arm.x * y - arm.y * x;
}

// Velocity of hub i through the air, without what only its inflow feels.
template <class S>
Vec3<S> hub_velocity(const LoadState<S>& s, std::size_t i) {
  return s.v_air_B_m_s + cross(s.in.rates_B_rad_s, s.rotor[i].arm_B_m);
}

// What the terms make sensors read beyond the truth: given what they look at, each adds its part.
template <class S>
struct ReadingState {
  const LoadInput<S>& in;
  Vec3<S> sensor_p_W_m, sensor_v_W_m_s;  // true place and velocity of the pose sensor
  Vec3<S> angular_acceleration_B_rad_s2;
  double mass_kg = 0.0;  // nominal
  // Added to the reading. `turn`: the attitude reads q Exp(turn) where q is the attitude of the body.
  Vec3<S> position_W_m{}, velocity_W_m_s{}, turn_B_rad{}, gyro_B_rad_s{}, accel_B_m_s2{};
  const S* memory = nullptr;        // as in LoadState
  Vec3<S> specific_force_B_m_s2{};  // true, at the place of the inertial sensor
  double since_start_s = 0.0;       // of the flight
};

// The scalars that loads.cpp and term_list.cpp are instantiated for, beside double.
// The motion of the body (velocity, rates) and the parameters of the paper: 14 directions.
using MotionDual = Dual<6 + kLoadParameters>;
// The same with attitude and position, for models with terms: velocity, rates, attitude, position, parameters.
using PlaceDual = Dual<12 + kLoadParameters>;
// Anything else, eight at a time: parameters of terms and of the rotor speed input.
using ExtraDual = Dual<8>;

}  // namespace rotorloop::host
