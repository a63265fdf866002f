// In forward flight the wakes of the front rotors pass under and into the rear ones, which then meet more downwash, thrust less
// and pitch the nose up. The extra axial velocity at a rotor is
//   kappa * 2 v_front * a * sin(chi),   a = max(0, -r . v_xy / |v_xy|),   sin(chi) = |v_xy| / sqrt(v_xy^2 + v_front^2)
// 2 v_front: speed of the developed wake of the rotors that fly ahead; a: how far behind the middle of the vehicle the rotor flies
// (r: unit vector from the middle to its hub); chi: skew of the wake, which falls straight down in hover and reaches nobody.
// The blades turn it into thrust, torque and in-plane force. v_front is that of the step before (the wake needs 40 steps to
// arrive; that delay is left out).
// Source: Sun, de Visser, Chu 2019 (wind-tunnel C_m of a quadrotor); size there 19 to 57 mN m scaled to this vehicle at 8.5 m/s.
#include <algorithm>
#include <array>
#include <cmath>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorWakeInterference final : public Effect {
 public:
  explicit RotorWakeInterference(const EffectValues& v) : kappa_(v[0]) {}

  void prepare(PlantSetup& setup) override {
    Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();
    for (const RotorMount& r : setup.body.rotors) middle_m += r.hub_m.head<2>() / kAirframeRotors;
    for (std::size_t i = 0; i < kAirframeRotors; ++i) outward_[i] = (setup.body.rotors[i].hub_m.head<2>() - middle_m).normalized();
  }

  void rotor_condition(const RotorSite& s, RotorCondition& c) const override {
    const Eigen::Vector2d v_xy_m_s = s.body->v_air_B_m_s.head<2>();
    const double speed_m_s = v_xy_m_s.norm();
    if (speed_m_s <= 0.0) return;
    const Eigen::Vector2d ahead = v_xy_m_s / speed_m_s;
    const double behind = std::max(0.0, -outward_[s.index].dot(ahead)), front_m_s = front_induced_m_s(ahead);
    const double sin_skew = speed_m_s / std::sqrt(speed_m_s * speed_m_s + front_m_s * front_m_s);
    c.v_R_m_s.z() += kappa_ * 2.0 * front_m_s * behind * sin_skew;
  }
  void rotor_loads(const RotorSite& s, RotorLoads&) override { induced_m_s_[s.index] = std::max(s.bare.induced_m_s, 0.0); }

 private:
  // Mean over the rotors ahead of the middle, by how far ahead they fly.
  double front_induced_m_s(const Eigen::Vector2d& ahead) const {
    double sum = 0.0, weights = 0.0;
    for (std::size_t i = 0; i < kAirframeRotors; ++i) {
      const double weight = std::max(0.0, outward_[i].dot(ahead));
      sum += weight * induced_m_s_[i];
      weights += weight;
    }
    return weights > 0.0 ? sum / weights : 0.0;
  }

  double kappa_;
  std::array<Eigen::Vector2d, kAirframeRotors> outward_{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                                        Eigen::Vector2d::Zero()};
  std::array<double, kAirframeRotors> induced_m_s_{};
};

}  // namespace

const EffectInfo kRotorWakeInterference{
    .id = "rotor_wake_interference", .parameter = {"kappa", "1", 0.0, 1.0, 0.0}, .options = {}, .make = make_effect<RotorWakeInterference>};

}  // namespace rotorloop::sim
