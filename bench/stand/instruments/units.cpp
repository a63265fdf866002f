#include "bench/stand/instruments/units.hpp"

#include <array>

#include "host/base/constants.hpp"

namespace rotorloop::modbus {
namespace {

constexpr double kTau = 6.283185307179586;
// Weight indicators show mass; what they measure is force at standard gravity.
constexpr std::array kChannelUnits{
    ChannelUnit{"N", "force", "N", 1.0},
    ChannelUnit{"kN", "force", "N", 1000.0},
    ChannelUnit{"kg", "force", "N", kGravity_m_s2},
    ChannelUnit{"g", "force", "N", kGravity_m_s2 * 1e-3},
    ChannelUnit{"lb", "force", "N", kGravity_m_s2 * 0.45359237},
    ChannelUnit{"N m", "torque", "N m", 1.0},
    ChannelUnit{"mN m", "torque", "N m", 1e-3},
    ChannelUnit{"V", "voltage", "V", 1.0},
    ChannelUnit{"mV", "voltage", "V", 1e-3},
    ChannelUnit{"A", "current", "A", 1.0},
    ChannelUnit{"mA", "current", "A", 1e-3},
    ChannelUnit{"W", "power", "W", 1.0},
    ChannelUnit{"Wh", "energy", "J", 3600.0},
    ChannelUnit{"degC", "temperature", "degC", 1.0},
    ChannelUnit{"Pa", "pressure", "Pa", 1.0},
    ChannelUnit{"hPa", "pressure", "Pa", 100.0},
    ChannelUnit{"%", "humidity", "%", 1.0},
    ChannelUnit{"1/min", "speed", "rad/s", kTau / 60.0},
    ChannelUnit{"Hz", "speed", "rad/s", kTau},
    ChannelUnit{"m/s2", "acceleration", "m/s^2", 1.0},
    ChannelUnit{"g_n", "acceleration", "m/s^2", kGravity_m_s2},  // standard gravity; g is a gram
    ChannelUnit{"1", "", "1", 1.0},
    ChannelUnit{"FS", "", "FS", 1.0},  // a share of full scale, which the stand file names
};

}  // namespace

const ChannelUnit* find_unit(std::string_view name) {
  for (const ChannelUnit& u : kChannelUnits)
    if (u.name == name) return &u;
  return nullptr;
}

std::string units_of(std::string_view quantity) {
  std::string all;
  for (const ChannelUnit& u : kChannelUnits)
    if (u.quantity.empty() || u.quantity == quantity) all += (all.empty() ? "" : ", ") + std::string(u.name);
  return all;
}

}  // namespace rotorloop::modbus
