// What the wake of a rotor ahead costs the one behind in thrust, at the same speed and torque: each wake is a tube of the disk's width that
// drifts back with the flight V and sinks with the front rotor's induced velocity v_f, over the way D to the hub behind by D v_f / V.
// The rotor behind loses
//   loss (1 - y / 2R)+ / (1 + (D v_f / (V 2R))^2)
// of its thrust to each rotor ahead: y is how far the two tracks lie apart, so the first factor is the width that both share; the
// second is half where the wake passes a diameter below the hub, and nothing in hover. At most all of the thrust goes. v_f is that of
// the step before. rotor_wake_interference is the same cause as extra inflow, which the blades turn into less thrust themselves.
// Size: as there, Sun, de Visser, Chu 2019.
#include <algorithm>
#include <array>
#include <cmath>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/rotor/rotor.hpp"

namespace rotorloop::sim {
namespace {

class RotorWakeThrustLoss final : public Effect {
 public:
  explicit RotorWakeThrustLoss(const EffectValues& v) : loss_(v[0]) {}

  void prepare(PlantSetup& setup) override {
    for (std::size_t i = 0; i < kAirframeRotors; ++i) hub_m_[i] = setup.body.rotors[i].hub_m.head<2>();
  }

  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    loads.force_R_N.z() *= 1.0 - std::min(1.0, loss_ * in_wakes(s));
    induced_m_s_[s.index] = std::max(s.bare.induced_m_s, 0.0);
  }

 private:
  double in_wakes(const RotorSite& s) const {
    const Eigen::Vector2d v_xy_m_s = s.body->v_air_B_m_s.head<2>();
    const double speed_m_s = v_xy_m_s.norm(), width_m = 2.0 * s.rotor->radius_m();
    if (speed_m_s <= 0.0) return 0.0;
    double sum = 0.0;
    for (std::size_t j = 0; j < kAirframeRotors; ++j) {
      const Eigen::Vector2d to_front = hub_m_[j] - hub_m_[s.index];
      const double way_m = to_front.dot(v_xy_m_s) / speed_m_s;
      if (way_m <= 0.0) continue;
      const double apart_m = std::sqrt(std::max(0.0, to_front.squaredNorm() - way_m * way_m));
      const double sunk = way_m * induced_m_s_[j] / (speed_m_s * width_m);
      sum += std::max(0.0, 1.0 - apart_m / width_m) / (1.0 + sunk * sunk);
    }
    return sum;
  }

  double loss_;
  std::array<Eigen::Vector2d, kAirframeRotors> hub_m_{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                                      Eigen::Vector2d::Zero()};
  std::array<double, kAirframeRotors> induced_m_s_{};
};

}  // namespace

const EffectInfo kRotorWakeThrustLoss{
    .id = "rotor_wake_thrust_loss", .parameter = {"loss", "1", 0.0, 0.5, 0.0}, .options = {}, .make = make_effect<RotorWakeThrustLoss>};

}  // namespace rotorloop::sim
