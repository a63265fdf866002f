// A rotor whose mass is not centred on its shaft pulls the hub round with m e omega^2, in the disk plane, once per turn: 150 Hz
// at hover speed. A missing piece of blade also costs thrust (thrust_loss). Balance grade G 6.3 of ISO 21940-11 (e omega =
// 6.3 mm/s) for a 20 g rotor at 945 rad/s allows 1.3e-7 kg m; 10 mg missing 50 mm from the shaft are 5e-7 kg m and 0.45 N.
// The angle is integrated with the rotor's own speed; at 2 kHz a turn has some 13 steps in hover and seven at 17 000 RPM.
// Source: centripetal force.
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/effects/rotor/one_rotor.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorImbalance final : public Effect {
 public:
  explicit RotorImbalance(const EffectValues& v) : unbalance_kg_m_(v[0]), rotor_(v[1]), thrust_loss_(v[2]) {}

  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    if (!is_rotor(s, rotor_)) return;
    omega_rad_s_ = s.condition.omega_rad_s;
    omega_dot_rad_s2_ = s.omega_dot_rad_s2;
    const double force_N = unbalance_kg_m_ * omega_rad_s_ * omega_rad_s_;
    const SinCos angle = sincos_exact(angle_rad_);
    loads.force_R_N.x() += force_N * angle.cos;
    loads.force_R_N.y() += s.condition.spin * force_N * angle.sin;
    loads.force_R_N.z() *= 1.0 - thrust_loss_;
  }
  void advance(const BodyMotion&, double dt_s) override {
    angle_rad_ += dt_s * (omega_rad_s_ + 0.5 * dt_s * omega_dot_rad_s2_);
    angle_rad_ -= 2.0 * std::numbers::pi * std::floor(angle_rad_ / (2.0 * std::numbers::pi));
  }

 private:
  double unbalance_kg_m_, rotor_, thrust_loss_;
  double omega_rad_s_ = 0.0, omega_dot_rad_s2_ = 0.0;
  double angle_rad_ = 0.0;  // of the heavy side, from x of the disk plane, in the sense of rotation
};

constexpr EffectOption kRotorImbalanceOptions[] = {kRotorNumber, {"thrust_loss", "1", 0.0, 0.5, 0.0}};

}  // namespace

const EffectInfo kRotorImbalance{.id = "rotor_imbalance",
                                 .parameter = {"unbalance_kg_m", "kg m", 0.0, 1e-5, 0.0},
                                 .options = kRotorImbalanceOptions,
                                 .make = make_effect<RotorImbalance>};

}  // namespace rotorloop::sim
