// Geometry of one rotor: what vehicles/blades/NAME.toml says, checked. Polars are named in the file and read from ../polars
// beside the blade's folder.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sim/rotor/polar.hpp"
#include "sim/rotor/section_table.hpp"

namespace rotorloop::sim {

// Of a station in a blade file: a tip that comes to a point has this.
inline constexpr double kLeastChord_m = 1e-4;

struct BladeStation {
  double r_m;
  double chord_m;
  double twist_deg;   // chord line against the rotor plane, leading edge up
  std::string polar;  // key of Blade::polars
};

struct Blade {
  int blades = 2;
  double radius_m = 0.0;
  double hub_radius_m = 0.0;         // the lifting part starts here
  double blade_inertia_kg_m2 = 0.0;  // all blades together, about the shaft; the motor adds its own
  // What polars and a photographed blade leave uncertain; the defaults take both as they are, but for the stall delay.
  double stall_delay = kSnelFactor;  // section_table.hpp; 0: the polars as they are
  double stall_drag = 0.0;           // section_table.hpp; share of the drag that comes with delayed stall, 0 to 1
  double drag_scale = 1.0;           // on the polars' drag: XFOIL gives too little below Reynolds number 8e4
  double lift_scale = 1.0;           // on the lift, stall delay included
  double pitch_offset_deg = 0.0;     // added to every station's twist: two measurements of one propeller differ by 2 degrees
  std::vector<BladeStation> stations;
  std::map<std::string, Polar> polars;
  std::vector<std::filesystem::path> polar_files;  // that polars were read from
};

constexpr std::size_t kMinStations = 5;  // fewer cannot show both root and tip of a chord curve

// Throw Error with file, line, key, value, range and remedy.
Blade read_blade(const std::filesystem::path& path);
Blade parse_blade(std::string_view text, const std::filesystem::path& path);  // `path` locates the polars and names the errors

}  // namespace rotorloop::sim
