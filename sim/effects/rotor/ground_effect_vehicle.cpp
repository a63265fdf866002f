// Near the ground each rotor meets the images of all four, and the fountain of air that rises between them lifts the vehicle:
//   T = T_free / (1 - gain f g),  g = (R / 4z)^2 + sum over the other rotors R^2 z / (2 (d^2 + 4z^2)^1.5)
//                                     + 2 K_b R^2 z / (b^2 + 4z^2)^1.5
// d: to the axis of the other rotor, b: the diagonal, K_b: fountain, measured about 2. f = 1 / (1 + (V / v_i)^2) blows images and
// fountain back alike in edgewise flow, as Cheeseman & Bennett have it for one rotor. 16 / 9 / 6 / 2.6 % at 1 / 2 / 3 / 5 radii.
// z is each rotor's own height and the image of another lies as deep as that one is high: a tilted vehicle is turned upright.
// Source: Sanchez-Cuevas, Heredia, Ollero 2017, Int. J. Aerospace Eng. 1823056. Use it instead of ground_effect_rotor.
#include <algorithm>
#include <array>
#include <cmath>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/wake.hpp"

namespace rotorloop::sim {
namespace {

// R^2 z / (d^2 + 4 z^2)^1.5: the upwash at a rotor of the image of a source at distance d, both at height z.
double image(double R_m, double d_m, double z_m) {
  const double r2 = d_m * d_m + 4.0 * z_m * z_m;
  return R_m * R_m * z_m / (r2 * std::sqrt(r2));
}

class GroundEffectVehicle final : public Effect {
 public:
  explicit GroundEffectVehicle(const EffectValues& v) : gain_(v[0]), fountain_(v[1]) {}

  // Effects that act later may still move the centre of mass or lift all hubs, so only where the hubs are from each other is kept.
  void prepare(PlantSetup& setup) override {
    ground_z_m_ = setup.body.ground_z_m;
    for (std::size_t i = 0; i < kAirframeRotors; ++i) hub_B_m_[i] = setup.body.rotors[i].hub_m;
    for (const Eigen::Vector3d& a : hub_B_m_)
      for (const Eigen::Vector3d& b : hub_B_m_) diagonal_m_ = std::max(diagonal_m_, (a - b).norm());
  }

  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    const double R = s.rotor->radius_m(), z = height_m(s, s.index), own = R / (4.0 * z);
    double g = own * own + 2.0 * fountain_ * image(R, diagonal_m_, z);
    for (std::size_t j = 0; j < kAirframeRotors; ++j)
      if (j != s.index) g += 0.5 * image(R, (hub_B_m_[s.index] - hub_B_m_[j]).norm(), 0.5 * (z + height_m(s, j)));
    loads.force_R_N.z() /= 1.0 - gain_ * wake_below(s) * g;
  }

 private:
  double height_m(const RotorSite& s, std::size_t rotor) const {
    const double z_m = s.hub_W_m.z() + s.body->R_WB.row(2).dot(hub_B_m_[rotor] - hub_B_m_[s.index]) - ground_z_m_;
    return std::max(z_m, 0.5 * s.rotor->radius_m());
  }

  double gain_, fountain_;
  double ground_z_m_ = 0.0, diagonal_m_ = 0.0;
  std::array<Eigen::Vector3d, kAirframeRotors> hub_B_m_{};  // from the geometric centre
};

constexpr EffectOption kGroundEffectVehicleOptions[]{{"fountain", "1", 0.0, 4.0, 2.0}};

}  // namespace

const EffectInfo kGroundEffectVehicle{.id = "ground_effect_vehicle",
                                      .parameter = {"gain", "1", 0.0, 2.0, 0.0},
                                      .options = kGroundEffectVehicleOptions,
                                      .make = make_effect<GroundEffectVehicle>};

}  // namespace rotorloop::sim
