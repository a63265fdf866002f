// How the columns of a thrust stand's file become quantities: as log_mapping.hpp does it for flights, data instead of code for a new
// kind of stand (docs/files.md, "Stand mapping").
#pragma once
#include <array>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::stand {

enum class StandQuantity { rotor_speed, thrust, torque, voltage, current, airspeed, command };
std::string_view name(StandQuantity q);

struct StandChannel {
  StandQuantity quantity = StandQuantity::thrust;
  bool joined = false;               // its columns are those of the joined file
  std::vector<std::string> columns;  // 1; rotor speeds: one for each rotor on the stand, up to 4
  double to_si = 1.0;                // unit, scale and sign
  std::string where;                 // "file:line", for messages
};

// A second table beside the file, tied to it by the value of a column: the mean of the file's rows at each value of the key.
struct StandJoin {
  std::string file;  // beside the stand file
  std::string key;   // column of that file …
  std::string to;    // … and the column of the stand file with the same values
};

struct StandMapping {
  std::filesystem::path path;
  std::string name;
  char separator = ',';
  std::vector<std::string> header;  // of files that have none; else empty
  std::optional<std::string> time_column;
  double s_per_unit = 1.0;
  std::vector<StandChannel> channels;  // several of one quantity are alternatives, the first that a file has is taken
  std::optional<StandJoin> join;

  // Empty: each row is a steady point. Given: rows are a record in time, made into means of this length, kept where speed rests.
  double average_s = 0.0;
  double slope_max_rad_s2 = std::numeric_limits<double>::infinity();
  double efficiency = 0.0;  // above 0: torque is this share of voltage times current, over rotor speed

  double omega_max_rad_s = std::numeric_limits<double>::infinity();  // rows beyond are left out, as the authors do
  double shaft_power_min_W = 0.0;
  std::optional<double> diameter_m;
  double air_density_kg_m3 = 1.2;
  bool density_given = false;
  // Place and length, in a file's name, of what names its motor and its propeller.
  std::optional<std::array<std::size_t, 2>> motor_in_name, propeller_in_name;
};

// Both throw Error (ExitCode::usage) with file, line, value, range and remedy.
StandMapping read_stand_mapping(const std::filesystem::path& path);
StandMapping parse_stand_mapping(std::string_view text, const std::filesystem::path& name_for_errors);

}  // namespace rotorloop::stand
