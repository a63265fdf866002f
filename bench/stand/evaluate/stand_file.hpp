// A thrust stand's file as points in SI units, whoever wrote it: rotor speeds with thrust, torque and what else was measured.
// Nothing is judged here; stand_checks.hpp does.
#pragma once
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/stand/evaluate/stand_mapping.hpp"
#include "bench/stand/run_folder.hpp"
#include "bench/sysid/log/column_table.hpp"

namespace rotorloop::stand {

struct StandPoint {
  double t_s = kNotMeasured;
  std::size_t row = 0;  // of the file, from 1, below the header; the first one of a mean
  std::array<double, 4> omega_rad_s{kNotMeasured, kNotMeasured, kNotMeasured, kNotMeasured};
  double thrust_N = kNotMeasured;  // of all rotors on the stand together
  double torque_N_m = kNotMeasured;
  double voltage_V = kNotMeasured, current_A = kNotMeasured;
  double airspeed_m_s = kNotMeasured;  // axial, against the thrust
  double command = kNotMeasured;
};

struct StandRecord {
  std::string name;              // of the file, without folder
  std::string motor, propeller;  // from the file's name; empty when the mapping does not say
  std::size_t rotors = 1;        // on the stand
  bool means = false;            // points are means over time: speed rested
  double diameter_m = kNotMeasured;
  double air_density_kg_m3 = 1.2;
  bool density_given = false;  // else a guess
  std::vector<StandPoint> points;
  std::size_t rows = 0;            // of the file
  std::vector<std::string> notes;  // what was left out while reading, in words
};

// Σ ω² over the rotors of the stand, (rad/s)².
double sum_omega_squared(const StandRecord& r, const StandPoint& p);

// Throws Error: usage for a mapping that does not fit the file, data_quality for a damaged file.
StandRecord read_stand_file(const std::filesystem::path& path, const StandMapping& mapping);
// The same of columns that were read already; a mapping with a joined file is refused.
StandRecord stand_record(const log::ColumnTable& file, const std::filesystem::path& path, const StandMapping& mapping);

}  // namespace rotorloop::stand
