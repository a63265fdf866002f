// Loads after a second writing of eq. (1)-(5) (bisection for the induced velocity, no code shared with the product), so that a formula
// wrong in the product cannot agree with itself.
#pragma once
#include <array>
#include <cmath>

#include "bench/hil/calibrate/load_point.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::calibrate {

struct Truth {
  double k1 = 2.4e-6, k2 = -9e-5, c_q = 2.2e-8, c_dh = 0.017, c_dxy = 0.006, c_dz = 0.02;
  double com_x = 0.0, com_y = 0.0;
};
inline constexpr double kRadius_m = 0.0635, kDensity_kg_m3 = 1.2;

inline double thrust_N(const Truth& t, double w, double v_z, double v_xy) {
  const double q = 2.0 * kDensity_kg_m3 * 3.14159265358979 * kRadius_m * kRadius_m;
  const auto surplus = [&](double v_i) { return t.k1 * w * w + t.k2 * w * (v_z + v_i) - q * v_i * std::hypot(v_z + v_i, v_xy); };
  double low = 0.0, high = 60.0;
  for (int k = 0; k < 200; ++k) (surplus(0.5 * (low + high)) > 0 ? low : high) = 0.5 * (low + high);
  return t.k1 * w * w + t.k2 * w * (v_z + 0.5 * (low + high));
}

inline host::VehicleModel geometry() {
  host::VehicleModel m;
  m.mass_kg = 0.682;
  m.rotors = {host::RotorMount{{0.0885, -0.0885, 0}, -1}, host::RotorMount{{-0.0885, 0.0885, 0}, -1},
              host::RotorMount{{0.0885, 0.0885, 0}, 1}, host::RotorMount{{-0.0885, -0.0885, 0}, 1}};
  m.thrust.radius_m = kRadius_m;
  m.thrust.air_density_kg_m3 = kDensity_kg_m3;
  return m;
}

inline LoadPoint point(const Truth& t, const Eigen::Vector3d& v, const std::array<double, 4>& w) {
  LoadPoint p{.v_B_m_s = v, .omega_rad_s = w};
  const auto square = [](double x) { return x * std::fabs(x); };
  double total = 0.0;
  const std::array<double, 4> reaction{-1, -1, 1, 1};
  const std::array<double, 4> x{0.0885, -0.0885, 0.0885, -0.0885}, y{-0.0885, 0.0885, 0.0885, -0.0885};
  for (std::size_t i = 0; i < 4; ++i) {
    const double thrust = w[i] > 0 ? thrust_N(t, w[i], v.z(), std::hypot(v.x(), v.y())) : 0.0;
    total += thrust;
    p.torque_B_N_m.x() += (y[i] - t.com_y) * thrust;
    p.torque_B_N_m.y() -= (x[i] - t.com_x) * thrust;
    p.torque_B_N_m.z() += reaction[i] * t.c_q * w[i] * w[i];
  }
  p.force_B_N = {-t.c_dh * total * v.x() - t.c_dxy * square(v.x()), -t.c_dh * total * v.y() - t.c_dxy * square(v.y()),
                 total - t.c_dz * square(v.z())};
  return p;
}

}  // namespace rotorloop::calibrate
