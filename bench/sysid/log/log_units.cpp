#include "bench/sysid/log/log_units.hpp"

#include <algorithm>
#include <array>

#include "host/base/constants.hpp"

namespace rotorloop::log {
namespace {

constexpr std::array kUnits{
    LogUnit{"s", "s", 1.0},
    LogUnit{"ms", "s", 1e-3},
    LogUnit{"us", "s", 1e-6},
    LogUnit{"ns", "s", 1e-9},
    LogUnit{"m", "m", 1.0},
    LogUnit{"cm", "m", 1e-2},
    LogUnit{"mm", "m", 1e-3},
    LogUnit{"m/s", "m/s", 1.0},
    LogUnit{"cm/s", "m/s", 1e-2},
    LogUnit{"mm/s", "m/s", 1e-3},
    LogUnit{"m/s2", "m/s2", 1.0},
    LogUnit{"g", "m/s2", kGravity_m_s2},
    LogUnit{"mg", "m/s2", 1e-3 * kGravity_m_s2},
    LogUnit{"rad/s", "rad/s", 1.0},
    LogUnit{"mrad/s", "rad/s", 1e-3},
    LogUnit{"deg/s", "rad/s", kRad_per_deg},
    LogUnit{"rpm", "rad/s", kRad_s_per_rpm},
    LogUnit{"erpm", "rad/s", kRad_s_per_rpm, true},
    LogUnit{"rad", "rad", 1.0},
    LogUnit{"deg", "rad", kRad_per_deg},
    LogUnit{"V", "V", 1.0},
    LogUnit{"dV", "V", 0.1},
    LogUnit{"cV", "V", 1e-2},
    LogUnit{"mV", "V", 1e-3},
    LogUnit{"A", "A", 1.0},
    LogUnit{"mA", "A", 1e-3},
    LogUnit{"N", "N", 1.0},
    LogUnit{"gf", "N", 1e-3 * kGravity_m_s2},
    LogUnit{"N m", "N m", 1.0},
    LogUnit{"1", "1", 1.0},
    LogUnit{"%", "1", 1e-2},
};

}  // namespace

std::span<const LogUnit> log_units() { return kUnits; }

const LogUnit* find_log_unit(std::string_view name) {
  const auto it = std::find_if(kUnits.begin(), kUnits.end(), [&](const LogUnit& u) { return u.name == name; });
  return it == kUnits.end() ? nullptr : &*it;
}

std::string log_units_of(std::string_view si) {
  std::string names;
  for (const auto& u : kUnits)
    if (u.si == si) names += (names.empty() ? "" : ", ") + std::string(u.name);
  return names;
}

}  // namespace rotorloop::log
