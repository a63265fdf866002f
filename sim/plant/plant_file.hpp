// What is true in a simulation, as plant.toml says: body, rotors, battery, air, sensors, effects. Only sim/ reads it.
// Motor files are read along; blade files are named here and read by the rotor room.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/base/toml_file.hpp"
#include "sim/airframe/airframe.hpp"
#include "sim/effects/effect_set.hpp"
#include "sim/plant/motor_file.hpp"
#include "sim/plant/plant_esc.hpp"
#include "sim/sensor/imu.hpp"
#include "sim/sensor/pose.hpp"

namespace rotorloop::sim {

struct PlantBody {
  double mass_kg = 0.0;
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();  // elements of the matrix: products carry their minus sign
  Eigen::Vector3d com_offset_m = Eigen::Vector3d::Zero();   // from the geometric centre
  double drag_xy_N_s2_m2 = 0.0;                             // at the density of [air]
  double drag_z_N_s2_m2 = 0.0;
};

struct PlantRotor {
  Eigen::Vector3d hub_m = Eigen::Vector3d::Zero();  // from the geometric centre
  int spin = 1;                                     // +1: counter-clockwise seen from above
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();
  std::filesystem::path blade_path;  // resolved against the plant file's folder; not opened here
  std::filesystem::path motor_path;
  MotorFile motor;
};

struct PlantBattery {
  int cells = 0;
  double capacity_Ah = 0.0;
  double state_of_charge = 0.0;  // 0 to 1
  double resistance_ohm = 0.0;   // whole pack and wiring
};

struct PlantEffect {
  std::string id;         // one of builtin_effects()
  EffectValues values{};  // its parameter (0 where the drive gives it) and options
};

struct PlantFile {
  std::filesystem::path path;
  std::string name;
  PlantBody body;
  std::array<PlantRotor, kAirframeRotors> rotors;
  PlantBattery battery;
  PlantEsc esc;
  std::vector<PlantDriveFault> drive_faults;
  double density_kg_m3 = 0.0;
  ImuConfig imu;
  PoseConfig pose;
  std::vector<PlantEffect> effects;
};

// Throws Error with file, line, key, value, unit, range and remedy.
PlantFile read_plant(const std::filesystem::path& path);
PlantFile read_plant(const TomlFile& file);

// The effects of a plant, switched on.
EffectSet effect_set(const PlantFile& plant);

// The airframe of a plant. `blade_inertia_kg_m2`: all blades of one rotor about its shaft, from the blade file.
AirframeConfig airframe_config(const PlantFile& plant, const std::array<double, kAirframeRotors>& blade_inertia_kg_m2);

}  // namespace rotorloop::sim
