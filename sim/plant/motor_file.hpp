// One motor as its file motors/NAME.toml says: plain numbers for the drive, which is another room.
#pragma once
#include <filesystem>

#include "host/base/toml_file.hpp"

namespace rotorloop::sim {

struct MotorFile {
  double resistance_ohm = 0.0;  // one phase, star equivalent
  double inductance_d_H = 0.0;  // one phase
  double inductance_q_H = 0.0;
  double flux_linkage_Wb = 0.0;  // peak, one phase: back-EMF amplitude of a phase = flux * electrical speed
  int pole_pairs = 0;
  double inertia_kg_m2 = 0.0;  // rotor and bell; the blades come with the blade file
  double static_friction_N_m = 0.0;
  double cogging_N_m = 0.0;  // amplitude
};

// Speed constant that flux linkage and pole pairs stand for, line-to-line as sellers print it:
// Kv = 60 / (sqrt(3) * 2 pi * flux * pole pairs).
double speed_constant_rpm_V(const MotorFile& motor);

// Throws Error with file, line, key, value, unit, range and remedy.
MotorFile read_motor(const std::filesystem::path& path);
MotorFile read_motor(const TomlFile& file);

}  // namespace rotorloop::sim
