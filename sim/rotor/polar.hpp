// Lift and drag of a blade section: tables over the full circle of angles of attack at several Reynolds numbers, read from
// vehicles/polars/NAME.toml. Made by scripts/make_polars; the solve uses a resampled copy (section_table.hpp).
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::sim {

struct PolarTable {
  double reynolds;         // referred to the chord
  std::vector<double> cl;  // one value per Polar::alpha_deg
  std::vector<double> cd;
};

struct Polar {
  std::string source;
  std::vector<double> alpha_deg;   // strictly increasing, first -180, last 180
  std::vector<PolarTable> tables;  // strictly increasing Reynolds number
};

struct SectionCoefficients {
  double cl;
  double cd;
};

// Throw Error with file, line, key, value, range and remedy (host/base/toml_file.hpp).
Polar read_polar(const std::filesystem::path& path);
Polar parse_polar(std::string_view text, const std::filesystem::path& name_for_errors);

// Linear in angle and in Reynolds number, held constant outside the Reynolds numbers given. alpha in [-180, 180]. This is the
// definition of a polar; the solve's table is checked against it.
SectionCoefficients polar_at(const Polar& polar, double alpha_deg, double reynolds);

}  // namespace rotorloop::sim
