// A load on a string under the body: a point mass with its own motion, pulled by an elastic string that cannot push, with gravity
// and drag against the air around the vehicle. It swings with the frequency of a pendulum, higher by the recoil of the body: sqrt(g / L (1
// + m / M)). The load has a sub-stepped integrator of its own. Over the next step the body feels the mean pull that the load felt over the
// last one: half a millisecond late, but what one gains the other loses, so momentum is kept exactly.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "host/base/constants.hpp"
#include "sim/effects/body/air_density.hpp"
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class SlungLoad final : public Effect {
 public:
  explicit SlungLoad(const EffectValues& v)
      : mass_kg_(v[0]), length_m_(v[1]), attach_B_m_(0.0, 0.0, v[2]), drag_N_s2_m2_(v[3]), damping_ratio_(v[4]) {
    // As stiff as the step allows with a wide margin: 200 rad/s against the body held fast; it stretches by g / 200^2 = 0.25 mm.
    stiffness_N_m_ = mass_kg_ * kString_rad_s * kString_rad_s;
    damping_N_s_m_ = 2.0 * damping_ratio_ * mass_kg_ * kString_rad_s;
  }
  void prepare(PlantSetup& setup) override {
    gravity_m_s2_ = setup.body.gravity_m_s2;
    attach_B_m_ -= setup.body.com_offset_m;
    ground_z_m_ = setup.body.ground_z_m;
  }

  void body_loads(const BodyMotion& m, Wrench& w) const override {
    if (mass_kg_ == 0.0 || !hanging_) return;
    const Eigen::Vector3d pull_B_N = m.R_WB.transpose() * pull_W_N_;
    w.force_B_N += pull_B_N;
    w.moment_B_N_m += attach_B_m_.cross(pull_B_N);
  }

  void advance(const BodyMotion& m, double dt_s) override {
    if (mass_kg_ == 0.0) return;
    const Eigen::Vector3d a = attach_point(m), va = attach_velocity(m);
    if (!hanging_) {  // starts at rest under the body
      const double stretch_m = mass_kg_ * gravity_m_s2_ / stiffness_N_m_;
      p_W_m_ = a - Eigen::Vector3d(0.0, 0.0, length_m_ + stretch_m);
      v_W_m_s_ = va;
      pull_W_N_ = {0.0, 0.0, -mass_kg_ * gravity_m_s2_};
      hanging_ = true;
      return;
    }
    const Eigen::Vector3d wind_W_m_s = m.v_W_m_s - m.R_WB * m.v_air_B_m_s;
    const double drag_N_s2_m2 = density_ratio(m) * drag_N_s2_m2_;
    // Semi-implicit Euler in sub-steps; the point of attachment moves on at its velocity, ending at `a`.
    const double h = dt_s / kSubSteps;
    pull_W_N_.setZero();
    for (int k = 1; k <= kSubSteps; ++k) {
      const Eigen::Vector3d at = a - (kSubSteps - k) * h * va;
      const Eigen::Vector3d on_body = string_pull_W_N(at, va, p_W_m_, v_W_m_s_);
      pull_W_N_ += on_body / kSubSteps;
      const Eigen::Vector3d v_air_W_m_s = v_W_m_s_ - wind_W_m_s;
      Eigen::Vector3d force = -on_body - drag_N_s2_m2 * v_air_W_m_s.norm() * v_air_W_m_s;
      force.z() -= mass_kg_ * gravity_m_s2_;
      v_W_m_s_ += (h / mass_kg_) * force;
      p_W_m_ += h * v_W_m_s_;
      if (p_W_m_.z() < ground_z_m_) {  // lies on the ground
        p_W_m_.z() = ground_z_m_;
        v_W_m_s_.setZero();
      }
    }
  }

 private:
  Eigen::Vector3d attach_point(const BodyMotion& m) const { return m.p_W_m + m.R_WB * attach_B_m_; }
  Eigen::Vector3d attach_velocity(const BodyMotion& m) const { return m.v_W_m_s + m.R_WB * m.w_B_rad_s.cross(attach_B_m_); }
  // On the body; the load feels the opposite.
  Eigen::Vector3d string_pull_W_N(const Eigen::Vector3d& attach, const Eigen::Vector3d& v_attach, const Eigen::Vector3d& load,
                                  const Eigen::Vector3d& v_load) const {
    const Eigen::Vector3d line = load - attach;
    const double length = line.norm();
    if (length <= length_m_) return Eigen::Vector3d::Zero();
    const Eigen::Vector3d along = line / length;
    const double tension_N = stiffness_N_m_ * (length - length_m_) + damping_N_s_m_ * along.dot(v_load - v_attach);
    return std::max(0.0, tension_N) * along;
  }

  static constexpr double kString_rad_s = 200.0;
  static constexpr int kSubSteps = 4;
  double mass_kg_, length_m_;
  Eigen::Vector3d attach_B_m_;  // from the geometric centre, after prepare() from the centre of mass
  double drag_N_s2_m2_, damping_ratio_;
  double stiffness_N_m_ = 0.0, damping_N_s_m_ = 0.0;
  double gravity_m_s2_ = kGravity_m_s2, ground_z_m_ = 0.0;
  bool hanging_ = false;
  Eigen::Vector3d p_W_m_ = Eigen::Vector3d::Zero(), v_W_m_s_ = Eigen::Vector3d::Zero();  // of the load
  Eigen::Vector3d pull_W_N_ = Eigen::Vector3d::Zero();                                   // on the body
};

// The body feels the pull half a millisecond late, which feeds a string that rings against a free body: below 0.02 of damping the
// heaviest load would shake the reference vehicle apart.
constexpr double kLeastDamping = 0.1;
constexpr EffectOption kSlungLoadOptions[]{{"length_m", "m", 0.1, 5.0, 0.5},
                                           {"attach_z_m", "m", -0.2, 0.2, -0.03},
                                           {"drag_N_s2_m2", "N s^2/m^2", 0.0, 0.1, 0.001},
                                           {"string_damping", "1", kLeastDamping, 1.0, 0.3}};

}  // namespace

const EffectInfo kSlungLoad{
    .id = "slung_load", .parameter = {"mass_kg", "kg", 0.0, 0.3, 0.0}, .options = kSlungLoadOptions, .make = make_effect<SlungLoad>};

}  // namespace rotorloop::sim
