// Constants and factors of units that more than one room needs. Firmware and protocols are single precision and have their own.
#pragma once
#include <numbers>

namespace rotorloop {

inline constexpr double kGravity_m_s2 = 9.80665;  // standard gravity, CGPM 1901; also the "g" of accelerometers and thrust stands
inline constexpr double kRad_s_per_rpm = std::numbers::pi / 30.0, kRpm_per_rad_s = 30.0 / std::numbers::pi;
inline constexpr double kRad_per_deg = std::numbers::pi / 180.0, kDeg_per_rad = 180.0 / std::numbers::pi;

}  // namespace rotorloop
