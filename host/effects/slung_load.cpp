#include "host/effects/slung_load.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace rotorloop::host {
namespace {

using Vec = Vec3<double>;
using Swing = std::array<double, 4>;  // x, y of d and of its rate

constexpr double kLowest = 0.94;  // of |(d_x, d_y)|: 70° from the vertical

Vec to_world(const Vec& v_B, const std::array<Vec, 3>& world_B) {
  return {dot(world_B[0], v_B), dot(world_B[1], v_B), dot(world_B[2], v_B)};
}

// Of a point of the body that is `arm_B` from the centre of mass.
Vec hook_velocity_W(const LoadState<double>& s, const Vec& arm_B) {
  return to_world(s.in.v_B_m_s + cross(s.in.rates_B_rad_s, arm_B), s.in.world_B);
}

}  // namespace

void SlungLoad::advance(const double* c, const MemoryStep& step, double* memory) {
  const double length = c[1], damping = 2.0 * c[2] * std::sqrt(kGravity_m_s2 / length), drag = c[3];
  const LoadState<double>& s = step.from;
  const Vec arm{-s.parameters.com_x_m, -s.parameters.com_y_m, c[4] - s.geometry.com_z_m};
  const Vec& w = s.in.rates_B_rad_s;
  const Vec hook_W =
      step.acceleration_W_m_s2 + to_world(cross(step.angular_acceleration_B_rad_s2, arm) + cross(w, cross(w, arm)), s.in.world_B);
  const Vec v_W = scaled(0.5, hook_velocity_W(s, arm) + hook_velocity_W(step.to, arm));
  const Vec fall{-hook_W.x, -hook_W.y, -kGravity_m_s2 - hook_W.z};

  const auto slope = [&](const Swing& q) {
    const double out2 = std::min(q[0] * q[0] + q[1] * q[1], kLowest * kLowest);
    const Vec d{q[0], q[1], -std::sqrt(1.0 - out2)};
    const Vec rate{q[2], q[3], -(d.x * q[2] + d.y * q[3]) / d.z};
    const Vec v = v_W + scaled(length, rate);
    const Vec f = fall - scaled(drag * std::sqrt(dot(v, v)), v);
    const double along = dot(f, d), swing2 = dot(rate, rate);
    return Swing{q[2], q[3], (f.x - along * d.x) / length - swing2 * d.x - damping * q[2],
                 (f.y - along * d.y) / length - swing2 * d.y - damping * q[3]};
  };
  const auto ahead = [](const Swing& q, double h, const Swing& k) {
    return Swing{q[0] + h * k[0], q[1] + h * k[1], q[2] + h * k[2], q[3] + h * k[3]};
  };
  const double h = step.dt_s;
  const Swing q{memory[0], memory[1], memory[2], memory[3]};
  const Swing k1 = slope(q), k2 = slope(ahead(q, 0.5 * h, k1)), k3 = slope(ahead(q, 0.5 * h, k2)), k4 = slope(ahead(q, h, k3));
  for (std::size_t i = 0; i < 4; ++i) memory[i] = q[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
  // Higher than this the string is slack or wound up: the load is held there, and what carried it outwards is lost.
  const double out = std::sqrt(memory[0] * memory[0] + memory[1] * memory[1]);
  if (out > kLowest) {
    const double x = memory[0] / out, y = memory[1] / out, outward = std::max(0.0, x * memory[2] + y * memory[3]);
    memory[0] = kLowest * x;
    memory[1] = kLowest * y;
    memory[2] -= outward * x;
    memory[3] -= outward * y;
  }
}

}  // namespace rotorloop::host
