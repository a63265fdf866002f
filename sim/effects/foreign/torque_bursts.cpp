// A battery that is loose in its tray and strikes it now and then: bursts of torque at random moments about a random axis across the
// thrust, half a sine long, each with its size between half and all of torque_N_m. Nothing in the motion predicts them.
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "host/base/random.hpp"
#include "sim/effects/foreign/foreign_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

constexpr std::uint64_t kBurstModule = 7101;
constexpr double kEvery_s = 1.5;  // one burst within each such span, at a random moment of it
constexpr std::uint64_t kNumbers = 3;

class TorqueBursts final : public Effect {
 public:
  explicit TorqueBursts(const EffectValues& v) : torque_N_m_(v[0]), length_s_(v[1]) {}
  void prepare(PlantSetup& setup) override { random_ = RandomStream(setup.seed, kBurstModule); }
  void body_loads(const BodyMotion& m, Wrench& w) const override {
    const double span = std::floor(m.time_s / kEvery_s);
    const auto n = static_cast<std::uint64_t>(span) * kNumbers;
    const double start_s = span * kEvery_s + random_.uniform(n) * (kEvery_s - length_s_);
    const double tau = (m.time_s - start_s) / length_s_;
    if (tau <= 0.0 || tau >= 1.0) return;
    const double size_N_m = torque_N_m_ * (0.5 + 0.5 * random_.uniform(n + 1)) * sin_exact(std::numbers::pi * tau);
    const SinCos axis = sincos_exact(2.0 * std::numbers::pi * random_.uniform(n + 2));
    w.moment_B_N_m += size_N_m * Eigen::Vector3d(axis.cos, axis.sin, 0.0);
  }

 private:
  double torque_N_m_, length_s_;
  RandomStream random_{0, kBurstModule};
};

constexpr EffectOption kForeignTorqueBurstsOptions[]{{"length_s", "s", 0.02, 1.0, 0.2}};

}  // namespace

const EffectInfo kForeignTorqueBursts{.id = "foreign_torque_bursts",
                                      .parameter = {"torque_N_m", "N m", 0.0, 0.2, 0.0},
                                      .options = kForeignTorqueBurstsOptions,
                                      .make = make_effect<TorqueBursts>};

}  // namespace rotorloop::sim
