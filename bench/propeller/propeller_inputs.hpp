// What a fit of a propeller starts from, whoever names the files: where polars are, which sections, rows that were measured together.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/propeller/geometry.hpp"
#include "bench/propeller/measured.hpp"
#include "sim/rotor/polar.hpp"

namespace rotorloop::propeller {

constexpr double kLeastThrust = 0.01;  // C_T; below, a relative error says nothing

// Lift and drag: one section all along the blade, or two with a blend between.
struct SectionChoice {
  std::string inner, outer;                 // outer empty: one section
  double blend_from = 0.0, blend_to = 0.0;  // of the radius
  std::string reason;
};

// Polars of one section and where they are from.
struct SectionPolars {
  sim::Polar polar;
  std::string kind;  // "measured_data" (XFLR5's files of the data folder), "shipped", "xfoil", "stand_in" (a shipped section for another)
  std::vector<std::string> remarks;  // what a user should know of them
  bool cached = false;               // "xfoil": kept from before
};

struct PropellerInputs {
  std::filesystem::path data;                                // what ROTORLOOP_DATA names
  std::filesystem::path shipped_polars = "vehicles/polars";  // NAME.toml
  std::string section;                                       // for all propellers, in place of their own; empty: their own
  double fit_rpm = 0.0;                                      // fit the sweep nearest to it; 0: sweep_to_fit()
  double stall_drag = 0.0;                                   // sim::Blade
  // Makes polars of sections that no folder has, and of digits and .dat files; empty: they are refused.
  std::function<SectionPolars(const std::string& section)> make_polars;
  std::function<bool(const std::string& section)> can_make_polars;
  std::map<std::string, SectionPolars> ready;  // read or made before
};

// A set of rows measured in one go.
struct MeasuredSet {
  std::string label;  // "static", "J 5039 rpm"
  std::vector<MeasuredRow> rows;
  bool fitted = false;  // every second row goes into the fit
  bool judged = true;
  bool predicted = false;  // by the maker's own model: nothing is fitted to it, and it displaces nothing
};

}  // namespace rotorloop::propeller
