// The vortex ring builds up and sheds itself: inside the ring state thrust wanders, T (1 + sigma b n(t)), each rotor for itself.
// n is a first-order Gauss-Markov process of unit variance and correlation time tau; b is the ring bump of vortex_ring_loss.
// Size and time are for the user to set: no public measurement of a 5-inch rotor is known, and tau = 0.1 s (15 revolutions in
// hover) is a guess. Source of the bounds and of the fact: Johnson, NASA TP-2005-213477.
#include <array>
#include <cmath>
#include <cstdint>

#include "host/base/elementary.hpp"
#include "host/base/random.hpp"
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/wake.hpp"

namespace rotorloop::sim {
namespace {

constexpr std::uint64_t kRandomModule = 7017;

class VortexRingFluctuation final : public Effect {
 public:
  explicit VortexRingFluctuation(const EffectValues& v) : sigma_(v[0]), tau_s_(v[1]) { draw(0.0); }

  void prepare(PlantSetup& setup) override {
    random_ = RandomStream(setup.seed, kRandomModule);
    draw(0.0);
  }
  void rotor_loads(const RotorSite& s, RotorLoads& loads) override { loads.force_R_N.z() *= 1.0 + sigma_ * ring_state(s) * n_[s.index]; }
  void advance(const BodyMotion&, double dt_s) override {
    ++step_;
    draw(exp_exact(-dt_s / tau_s_));
  }

 private:
  // The next value of every rotor; `kept` of the last one remains. Variance 1 throughout.
  void draw(double kept) {
    const double fresh = std::sqrt(1.0 - kept * kept);
    for (std::uint64_t i = 0; i < kAirframeRotors; ++i) n_[i] = kept * n_[i] + fresh * random_.gaussian(kAirframeRotors * step_ + i);
  }

  double sigma_, tau_s_;
  RandomStream random_{0, kRandomModule};
  std::uint64_t step_ = 0;
  std::array<double, kAirframeRotors> n_{};
};

constexpr EffectOption kVortexRingFluctuationOptions[]{{"tau_s", "s", 0.005, 2.0, 0.1}};

}  // namespace

const EffectInfo kVortexRingFluctuation{.id = "vortex_ring_fluctuation",
                                        .parameter = {"sigma", "1", 0.0, 0.3, 0.0},
                                        .options = kVortexRingFluctuationOptions,
                                        .make = make_effect<VortexRingFluctuation>};

}  // namespace rotorloop::sim
