// A line from the centre of mass to a fixed point: an elastic cord that pulls beyond its slack length, with some damping along
// itself, and never pushes. A cable to a power supply or a safety line is one.
#include <algorithm>
#include <cmath>

#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

class Tether final : public Effect {
 public:
  explicit Tether(const EffectValues& v) : stiffness_N_m_(v[0]), damping_N_s_m_(v[1]), anchor_W_m_(v[2], v[3], v[4]), slack_m_(v[5]) {}
  void body_loads(const BodyMotion& m, Wrench& w) const override {
    if (stiffness_N_m_ == 0.0) return;
    const Eigen::Vector3d line_W_m = anchor_W_m_ - m.p_W_m;
    const double length_m = line_W_m.norm();
    if (length_m <= slack_m_ || length_m == 0.0) return;
    const Eigen::Vector3d along_W = line_W_m / length_m;
    const double lengthening_m_s = -along_W.dot(m.v_W_m_s);
    const double pull_N = std::max(0.0, stiffness_N_m_ * (length_m - slack_m_) + damping_N_s_m_ * lengthening_m_s);
    w.force_B_N += m.R_WB.transpose() * (pull_N * along_W);
  }

 private:
  double stiffness_N_m_, damping_N_s_m_;
  Eigen::Vector3d anchor_W_m_;
  double slack_m_;
};

constexpr EffectOption kOptions[]{{"damping_N_s_m", "N s/m", 0.0, 5.0, 0.05},
                                  {"anchor_x_m", "m", -100.0, 100.0, 0.0},
                                  {"anchor_y_m", "m", -100.0, 100.0, 0.0},
                                  {"anchor_z_m", "m", -100.0, 100.0, 0.0},
                                  {"slack_m", "m", 0.0, 100.0, 0.5}};

}  // namespace

const EffectInfo kTether{
    .id = "tether", .parameter = {"stiffness_N_m", "N/m", 0.0, 20.0, 0.0}, .options = kOptions, .make = make_effect<Tether>};

}  // namespace rotorloop::sim
