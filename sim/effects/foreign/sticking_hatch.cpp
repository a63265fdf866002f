// A hatch that the wind tears open and that sticks: it opens at open_m_s of airspeed and falls shut below a quarter of it. While open it
// drags on one side, so the same speed has two loads, by what came before: no function of the present motion describes it.
#include <Eigen/Geometry>

#include "sim/effects/body/air_density.hpp"
#include "sim/effects/foreign/foreign_list.hpp"

namespace rotorloop::sim {
namespace {

const Eigen::Vector3d kHatch_B_m{0.03, 0.05, 0.02};  // from the centre of mass

class StickingHatch final : public Effect {
 public:
  explicit StickingHatch(const EffectValues& v) : drag_N_s2_m2_(v[0]), open_m_s_(v[1]) {}
  void body_loads(const BodyMotion& m, Wrench& w) const override {
    if (!open_) return;
    const Eigen::Vector3d drag_B_N = -drag_N_s2_m2_ * density_ratio(m) * m.v_air_B_m_s.norm() * m.v_air_B_m_s;
    w.force_B_N += drag_B_N;
    w.moment_B_N_m += kHatch_B_m.cross(drag_B_N);
  }
  void advance(const BodyMotion& m, double) override {
    const double speed_m_s = m.v_air_B_m_s.norm();
    if (speed_m_s > open_m_s_) open_ = true;
    if (speed_m_s < 0.25 * open_m_s_) open_ = false;
  }

 private:
  double drag_N_s2_m2_, open_m_s_;
  bool open_ = false;
};

constexpr EffectOption kForeignStickingHatchOptions[]{{"open_m_s", "m/s", 0.1, 50.0, 5.0}};

}  // namespace

const EffectInfo kForeignStickingHatch{.id = "foreign_sticking_hatch",
                                       .parameter = {"drag_N_s2_m2", "N s^2/m^2", 0.0, 0.1, 0.0},
                                       .options = kForeignStickingHatchOptions,
                                       .make = make_effect<StickingHatch>};

}  // namespace rotorloop::sim
