// A load on an elastic string below the centre of mass, as two bodies and a spring: shares nothing with the pendulum of the model.
#pragma once
#include <Eigen/Core>
#include <algorithm>

#include "test/support/model_true_airframe.hpp"

namespace rotorloop::model_true {

struct StringLoad {
  double mass_kg = 0.0, length_m = 0.5;
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero(), v_W_m_s = Eigen::Vector3d::Zero();

  void hang_under(const State& body, const Eigen::Vector3d& aside_m) {
    Eigen::Vector3d line(aside_m.x(), aside_m.y(), 0.0);
    line.z() = -std::sqrt(length_m * length_m - line.squaredNorm());
    p_W_m = body.p_W_m + (1.0 + kGravity_m_s2 / (kString_rad_s * kString_rad_s * length_m)) * line;
    v_W_m_s = body.v_W_m_s;
  }
  // Pull on the body in W, N; moves the load on by one step.
  Eigen::Vector3d pull(const State& body, double step_s) {
    const Eigen::Vector3d line = p_W_m - body.p_W_m, along = line.normalized();
    const double stretch_m = line.norm() - length_m, rate_m_s = along.dot(v_W_m_s - body.v_W_m_s);
    const double tension_N = stretch_m > 0.0 ? mass_kg * std::max(0.0, kString_rad_s * (kString_rad_s * stretch_m + 0.6 * rate_m_s)) : 0.0;
    v_W_m_s += step_s * (Eigen::Vector3d(0, 0, -kGravity_m_s2) - tension_N / mass_kg * along);
    p_W_m += step_s * v_W_m_s;
    return tension_N * along;
  }

  static constexpr double kString_rad_s = 200.0;
};

}  // namespace rotorloop::model_true
