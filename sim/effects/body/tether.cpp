// A line from the centre of mass to a fixed point: an elastic cord that pulls beyond its slack length, with some damping along
// itself, and never pushes. A cable to a power supply or a safety line is one.
#include <algorithm>
#include <cmath>

#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void tether(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const double stiffness_N_m = v[0], damping_N_s_m = v[1], slack_m = v[5];
  const Eigen::Vector3d anchor_W_m(v[2], v[3], v[4]);
  if (stiffness_N_m == 0.0) return;
  const Eigen::Vector3d line_W_m = anchor_W_m - m.p_W_m;
  const double length_m = line_W_m.norm();
  if (length_m <= slack_m || length_m == 0.0) return;
  const Eigen::Vector3d along_W = line_W_m / length_m;
  const double lengthening_m_s = -along_W.dot(m.v_W_m_s);
  const double pull_N = std::max(0.0, stiffness_N_m * (length_m - slack_m) + damping_N_s_m * lengthening_m_s);
  w.force_B_N += m.R_WB.transpose() * (pull_N * along_W);
}

constexpr EffectOption kTetherOptions[]{{"damping_N_s_m", "N s/m", 0.0, 5.0, 0.05},
                                        {"anchor_x_m", "m", -100.0, 100.0, 0.0},
                                        {"anchor_y_m", "m", -100.0, 100.0, 0.0},
                                        {"anchor_z_m", "m", -100.0, 100.0, 0.0},
                                        {"slack_m", "m", 0.0, 100.0, 0.5}};

}  // namespace

const EffectInfo kTether{
    .id = "tether", .parameter = {"stiffness_N_m", "N/m", 0.0, 20.0, 0.0}, .options = kTetherOptions, .make = effect_of<tether>};

}  // namespace rotorloop::sim
