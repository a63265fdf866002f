// gains.toml: one set of gains and thrust limits, frozen for all flights and controller variants of a comparison. Hosts only.
#pragma once
#include <filesystem>
#include <string_view>

#include "host/control/controller.hpp"

namespace rotorloop::host {

struct GainsFile {
  Gains gains;
  ThrustLimits limits;
  double omega_min_rad_s = MixerConfig{}.omega_min_rad_s;
  double omega_max_rad_s = MixerConfig{}.omega_max_rad_s;
};

// Throws Error for ranges, unknown keys, and an attitude loop less than four times as fast as the position loop above it.
GainsFile read_gains(const std::filesystem::path& path);
GainsFile parse_gains(std::string_view text, const std::filesystem::path& name_for_errors);

ControllerConfig controller_config(const GainsFile& file, Variant variant);

}  // namespace rotorloop::host
