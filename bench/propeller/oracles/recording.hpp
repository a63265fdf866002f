// Reading a recording: JSON with errors that name the file. Internal to this room.
#pragma once
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/propeller/oracles/oracles.hpp"
#include "host/base/error.hpp"

namespace rotorloop::propeller {

// Calls `use` with the parsed file; whatever nlohmann finds wrong on the way becomes an Error that names the file.
template <class Use>
auto with_recording(const std::filesystem::path& data, const std::string& name, Use use) {
  const auto file = data / "propellers" / "golden_vectors" / name;
  const std::string remedy = "take the file again from where the data folder's PROVENANCE.md says";
  std::ifstream in(file);
  if (!in) throw Error({file.generic_string(), "cannot be opened", "the data folder is incomplete", remedy});
  try {
    return use(nlohmann::json::parse(in));
  } catch (const nlohmann::json::exception& e) {
    throw Error({file.generic_string(), e.what(), "the file is cut off or of another version", remedy});
  }
}

inline double relative(double ours, double recorded, double scale) { return (ours - recorded) / std::fabs(scale); }

// The worst of several comparisons, kept as one row.
struct Worst {
  double recorded = 0.0, ours = 0.0, deviation = 0.0;
  int count = 0;
  void add(double our_value, double recorded_value, double scale) {
    const double d = relative(our_value, recorded_value, scale);
    if (count++ == 0 || !(std::fabs(d) <= std::fabs(deviation))) *this = {recorded_value, our_value, d, count};
  }
  OracleRow row(std::string source, std::string condition, std::string quantity, double limit, std::string note = "") const {
    return {std::move(source), std::move(condition), std::move(quantity), recorded, ours, deviation, limit, std::move(note)};
  }
};

}  // namespace rotorloop::propeller
