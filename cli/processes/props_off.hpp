// Before a flight controller commands motors that may be of metal: the question about propellers, and a ceiling of their speed.
#pragma once
#include <string>

namespace CLI {
class App;
}

namespace rotorloop::cli {

inline constexpr double kCeiling_rpm = 3000.0;  // until raised

struct PropsOff {
  bool props_off = false;
  double max_rpm = kCeiling_rpm;
};
void add_props_off(CLI::App& command, PropsOff& options);

// mcast: and the virtual interfaces of Linux carry simulated ESCs; whatever else may end at a motor. What a bridge leads to is not seen.
bool may_have_motors(const std::string& bus);

// No ceiling on a bus of simulated ESCs. On others the question is asked on the terminal; without one only --props-off answers it. Throws
// Error when it is not answered.
double checked_ceiling_rad_s(const PropsOff& options, const std::string& esc_bus);

}  // namespace rotorloop::cli
