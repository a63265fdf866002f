#include "bench/hil/calibrate/blade_hover.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "host/base/error.hpp"
#include "sim/rotor/bem.hpp"
#include "sim/rotor/rotor.hpp"

namespace rotorloop::calibrate {
namespace {

constexpr double kTipMost_m_s = 204.0;  // Mach 0.6: the polars know no compressibility
constexpr int kHalvings = 50;
constexpr double kPitchAt = 0.75;

sim::RotorLoads still_air(const sim::Rotor& rotor, double omega_rad_s, double density_kg_m3) {
  sim::RotorCondition c;
  c.omega_rad_s = omega_rad_s;
  c.density_kg_m3 = density_kg_m3;
  sim::RotorWarmStart cold;
  return sim::solve_rotor(rotor, c, cold);
}

}  // namespace

BladeHover blade_hover(const sim::Blade& blade, double thrust_N, double density_kg_m3) {
  const sim::Rotor rotor(blade);
  double low = 0.0, high = kTipMost_m_s / blade.radius_m;
  if (const double most = still_air(rotor, high, density_kg_m3).force_R_N.z(); !(most > thrust_N))
    throw Error({"", fmt::format("hover asks each rotor for {:.3g} N; this blade gives {:.3g} N at Mach 0.6 of its tip", thrust_N, most),
                 "", "check --mass-kg, or give a larger propeller"});
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (still_air(rotor, middle, density_kg_m3).force_R_N.z() < thrust_N ? low : high) = middle;
  }
  const sim::RotorLoads loads = still_air(rotor, high, density_kg_m3);
  const double square = high * high;
  return {high, loads.force_R_N.z() / square, loads.shaft_torque_N_m / square, high * blade.radius_m, high * loads.shaft_torque_N_m};
}

double blade_pitch_m(const sim::Blade& blade) {
  const double r = kPitchAt * blade.radius_m;
  for (std::size_t i = 1; i < blade.stations.size(); ++i) {
    const auto &a = blade.stations[i - 1], &b = blade.stations[i];
    if (b.r_m < r) continue;
    const double twist_deg = a.twist_deg + (r - a.r_m) / (b.r_m - a.r_m) * (b.twist_deg - a.twist_deg) + blade.pitch_offset_deg;
    return 2.0 * std::numbers::pi * r * std::tan(twist_deg * std::numbers::pi / 180.0);
  }
  return 0.0;
}

}  // namespace rotorloop::calibrate
