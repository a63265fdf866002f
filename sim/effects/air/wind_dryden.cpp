// Turbulence after Dryden: three first-order (Gauss-Markov) components of the wind along, across and up, with the low-altitude
// lengths L_u = h / (0.177 + 0.000823 h)^1.2 in feet (MIL-F-8785C), L_u / 2 across and h / 2 up (MIL-HDBK-1797), seen frozen at the
// mean airspeed. Lateral and
// vertical components of the full form are of second order; the first-order form has the same variance and length.
// Exact discretisation: the variance is right from the first sample and at any step. The same gust reaches all rotors: eddies
// smaller than the vehicle (0.2 m) are beyond this model.
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "host/base/random.hpp"
#include "sim/effects/air/air_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class WindDryden final : public Effect {
 public:
  explicit WindDryden(const EffectValues& v) : sigma_m_s_(v[0]), airspeed_m_s_(v[1]), height_m_(v[2]) {
    const SinCos towards = sincos_exact(v[3] * std::numbers::pi / 180.0);
    along_ = {towards.cos, towards.sin, 0.0};
    across_ = {-towards.sin, towards.cos, 0.0};
  }
  void prepare(PlantSetup& setup) override {
    constexpr double kFoot_m = 0.3048;
    const double h_ft = height_m_ / kFoot_m;
    const double length_u_m = kFoot_m * h_ft / exp_exact(1.2 * log_exact(0.177 + 0.000823 * h_ft));
    const double lengths_m[3] = {length_u_m, 0.5 * length_u_m, 0.5 * height_m_};  // L_v = L_u / 2, L_w = h / 2 as in MIL-HDBK-1797
    const double ratio_w = exp_exact(-0.4 * log_exact(0.177 + 0.000823 * h_ft));  // sigma_u / sigma_w
    step_s_ = static_cast<double>(setup.body.step_ns) * 1e-9;
    noise_ = RandomStream(setup.seed, kModule);
    for (int i = 0; i < 3; ++i) {
      keep_[i] = exp_exact(-step_s_ * airspeed_m_s_ / lengths_m[i]);
      const double sigma = i == 2 ? sigma_m_s_ / ratio_w : sigma_m_s_;
      drive_[i] = sigma * std::sqrt(1.0 - keep_[i] * keep_[i]);
      gust_[i] = sigma * noise_.gaussian(static_cast<std::uint64_t>(i));
    }
  }
  void air(const Eigen::Vector3d&, double, Air& air) const override {
    air.wind_W_m_s += gust_[0] * along_ + gust_[1] * across_ + Eigen::Vector3d(0.0, 0.0, gust_[2]);
  }
  void advance(const BodyMotion&, double) override {
    ++sample_;
    for (int i = 0; i < 3; ++i) gust_[i] = keep_[i] * gust_[i] + drive_[i] * noise_.gaussian(3 * sample_ + static_cast<std::uint64_t>(i));
  }

 private:
  static constexpr std::uint64_t kModule = 7001;
  double sigma_m_s_, airspeed_m_s_, height_m_;
  Eigen::Vector3d along_, across_;
  double step_s_ = 0.0;
  RandomStream noise_{0, kModule};
  double keep_[3]{}, drive_[3]{}, gust_[3]{};
  std::uint64_t sample_ = 0;
};

constexpr EffectOption kWindDrydenOptions[]{
    {"airspeed_m_s", "m/s", 0.5, 50.0, 5.0}, {"height_m", "m", 1.0, 300.0, 5.0}, {"towards_deg", "deg", -360.0, 360.0, 0.0}};

}  // namespace

const EffectInfo kWindDryden{
    .id = "wind_dryden", .parameter = {"sigma_m_s", "m/s", 0.0, 5.0, 0.0}, .options = kWindDrydenOptions, .make = make_effect<WindDryden>};

}  // namespace rotorloop::sim
