// One rotor gives less (or more) thrust than its twins at the same speed: a chipped blade loses about 4 %, a blade of another
// batch a few. From `from_s` on, so that a flight can be broken half way. `torque_share` says how far the torque goes with it: a
// blade of less pitch or span takes less torque (share near 1), one with a bad surface or a blocked wake does not (0).
// Source: blade-element theory, thrust in proportion to blade area and lift coefficient.
#include "sim/effects/rotor/one_rotor.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class WeakRotor final : public Effect {
 public:
  explicit WeakRotor(const EffectValues& v) : epsilon_(v[0]), rotor_(v[1]), from_s_(v[2]), torque_share_(v[3]) {}
  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    if (!is_rotor(s, rotor_) || s.body->time_s < from_s_) return;
    loads.force_R_N.z() *= 1.0 + epsilon_;
    scale_torque(loads, 1.0 + torque_share_ * epsilon_);
  }

 private:
  double epsilon_, rotor_, from_s_, torque_share_;
};

constexpr EffectOption kOptions[] = {kRotorNumber, {"from_s", "s", 0.0, 1e4, 0.0}, {"torque_share", "1", 0.0, 1.0, 0.0}};

}  // namespace

const EffectInfo kWeakRotor{
    .id = "weak_rotor", .parameter = {"epsilon", "1", -0.5, 0.1, 0.0}, .options = kOptions, .make = make_effect<WeakRotor>};

}  // namespace rotorloop::sim
