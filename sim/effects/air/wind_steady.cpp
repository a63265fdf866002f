// A constant wind: everything that flies through the air feels it, and only that. In a level frame it looks like a tilt of
// gravity until the flight turns back on itself.
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/effects/air/air_list.hpp"

namespace rotorloop::sim {
namespace {

class WindSteady final : public Effect {
 public:
  explicit WindSteady(const EffectValues& v) {
    const SinCos towards = sincos_exact(v[1] * std::numbers::pi / 180.0);
    wind_W_m_s_ = {v[0] * towards.cos, v[0] * towards.sin, v[2]};
  }
  void air(const Eigen::Vector3d&, double, Air& air) const override { air.wind_W_m_s += wind_W_m_s_; }

 private:
  Eigen::Vector3d wind_W_m_s_;
};

constexpr EffectOption kWindSteadyOptions[]{{"towards_deg", "deg", -360.0, 360.0, 0.0}, {"up_m_s", "m/s", -10.0, 10.0, 0.0}};

}  // namespace

const EffectInfo kWindSteady{
    .id = "wind_steady", .parameter = {"speed_m_s", "m/s", 0.0, 20.0, 0.0}, .options = kWindSteadyOptions, .make = make_effect<WindSteady>};

}  // namespace rotorloop::sim
