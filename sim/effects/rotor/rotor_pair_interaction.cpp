// Each rotor's wake is swept back over its neighbours, and how much of it a neighbour meets depends on how the two stand: side by side, one
// behind the other, or across the diagonal. Wind tunnels see the three differ in size and, on the diagonal, in sign with the direction of
// flight, which rotor_wake_interference, one law for what flies behind the middle of the vehicle, cannot say.
// Of a neighbour with induced velocity v_j (of the step before) the rotor meets
//   kappa 2 v_j sin(chi_j) b,   sin(chi_j) = |v_xy| / sqrt(v_xy^2 + v_j^2): skew of the neighbour's wake
// with b the cosine of the angle between the line from the rotor to the neighbour and the direction of flight; 0 for a neighbour that flies
// behind, but on the diagonal, where both count: there times the cosine of twice that angle.
#include <algorithm>
#include <array>
#include <cmath>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorPairInteraction final : public Effect {
 public:
  explicit RotorPairInteraction(const EffectValues& v) : beside_(v[0]), in_line_(v[1]), across_(v[2]) {}

  void prepare(PlantSetup& setup) override {
    for (std::size_t i = 0; i < kAirframeRotors; ++i) hub_m_[i] = setup.body.rotors[i].hub_m.head<2>();
  }

  void rotor_condition(const RotorSite& s, RotorCondition& c) const override {
    const Eigen::Vector2d v_xy_m_s = s.body->v_air_B_m_s.head<2>();
    const double speed_m_s = v_xy_m_s.norm();
    if (speed_m_s <= 0.0) return;
    for (std::size_t j = 0; j < kAirframeRotors; ++j) {
      if (j == s.index) continue;
      const Eigen::Vector2d to_neighbour = (hub_m_[j] - hub_m_[s.index]).normalized();
      const double ahead = to_neighbour.dot(v_xy_m_s) / speed_m_s, own_m_s = induced_m_s_[j];
      const double sin_skew = speed_m_s / std::sqrt(speed_m_s * speed_m_s + own_m_s * own_m_s);
      c.v_R_m_s.z() += 2.0 * own_m_s * sin_skew * share(to_neighbour, ahead);
    }
  }
  void rotor_loads(const RotorSite& s, RotorLoads&) override { induced_m_s_[s.index] = std::max(s.bare.induced_m_s, 0.0); }

 private:
  // Lines up to 22.5 degrees from an axis of the body belong to that axis.
  double share(const Eigen::Vector2d& to_neighbour, double ahead) const {
    constexpr double kTan22p5 = 0.41421356237309503;
    const double x = std::fabs(to_neighbour.x()), y = std::fabs(to_neighbour.y());
    if (x < kTan22p5 * y) return beside_ * std::max(0.0, ahead);
    if (y < kTan22p5 * x) return in_line_ * std::max(0.0, ahead);
    const double cos_twice = ahead * ahead - (1.0 - ahead * ahead);
    return across_ * ahead * cos_twice;
  }

  double beside_, in_line_, across_;
  std::array<Eigen::Vector2d, kAirframeRotors> hub_m_{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                                      Eigen::Vector2d::Zero()};
  std::array<double, kAirframeRotors> induced_m_s_{};
};

constexpr EffectOption kRotorPairInteractionOptions[]{{"kappa_longitudinal", "1", -1.0, 1.0, 0.0}, {"kappa_diagonal", "1", -1.0, 1.0, 0.0}};

}  // namespace

const EffectInfo kRotorPairInteraction{.id = "rotor_pair_interaction",
                                       .parameter = {"kappa_lateral", "1", -1.0, 1.0, 0.0},
                                       .options = kRotorPairInteractionOptions,
                                       .make = make_effect<RotorPairInteraction>};

}  // namespace rotorloop::sim
