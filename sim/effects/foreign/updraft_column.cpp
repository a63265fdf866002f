// Warm air that rises over a spot on the ground: a column that stands still in space, w = speed exp(-(r / radius)²) upwards. Neither a
// steady wind nor turbulence: it is met at a place, by one rotor before the other.
#include "host/base/elementary.hpp"
#include "sim/effects/foreign/foreign_list.hpp"

namespace rotorloop::sim {
namespace {

void updraft_column(const EffectValues& v, const Eigen::Vector3d& p_W_m, double, Air& air) {
  const double speed_m_s = v[0], x_m = v[1], y_m = v[2], radius_m = v[3];
  const double x = (p_W_m.x() - x_m) / radius_m, y = (p_W_m.y() - y_m) / radius_m;
  air.wind_W_m_s.z() += speed_m_s * exp_exact(-(x * x + y * y));
}

constexpr EffectOption kForeignUpdraftColumnOptions[]{
    {"x_m", "m", -100.0, 100.0, 4.0}, {"y_m", "m", -100.0, 100.0, 1.0}, {"radius_m", "m", 0.1, 50.0, 1.5}};

}  // namespace

const EffectInfo kForeignUpdraftColumn{.id = "foreign_updraft_column",
                                       .parameter = {"speed_m_s", "m/s", -10.0, 10.0, 0.0},
                                       .options = kForeignUpdraftColumnOptions,
                                       .make = effect_of<updraft_column>};

}  // namespace rotorloop::sim
