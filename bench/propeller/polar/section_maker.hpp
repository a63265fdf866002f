// Polars of any section: kept ones, else from XFOIL, else, for NACA digits, the nearest shipped section, and always said which.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "bench/propeller/polar/section_sweeps.hpp"
#include "bench/propeller/propeller_inputs.hpp"

namespace rotorloop::propeller {

struct SectionMakerOptions {
  SweepSettings settings;
  std::filesystem::path shipped_polars;              // NAME.toml: what stands in without XFOIL; NAME.dat: coordinates
  std::filesystem::path cache;                       // empty: nothing is kept
  std::function<void(const std::string&)> progress;  // a line for each Reynolds number
};

// NACA digits, a path of a .dat file, or the name of one in `shipped_polars`.
class SectionMaker {
 public:
  explicit SectionMaker(SectionMakerOptions options) : o_(std::move(options)) {}
  // Without running anything: would make() give this section's own polars?
  bool can_make(const std::string& section) const;
  // Throws Error (usage) for a section that is none of the above, for damaged coordinates, and for coordinates without XFOIL.
  SectionPolars make(const std::string& section) const;

 private:
  SectionShape shape(const std::string& section) const;
  SectionPolars stand_in(const SectionShape& s) const;

  SectionMakerOptions o_;
};

}  // namespace rotorloop::propeller
