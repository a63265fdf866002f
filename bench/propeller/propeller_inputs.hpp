// What a fit of a propeller starts from, whoever names the files: where polars are, which sections, rows that were measured together.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/propeller/geometry.hpp"
#include "bench/propeller/measured.hpp"

namespace rotorloop::propeller {

constexpr double kLeastThrust = 0.01;  // C_T; below, a relative error says nothing

// Lift and drag: one section all along the blade, or two with a blend between.
struct SectionChoice {
  std::string inner, outer;                 // outer empty: one section
  double blend_from = 0.0, blend_to = 0.0;  // of the radius
  std::string reason;
};

struct PropellerInputs {
  std::filesystem::path data;                                // what ROTORLOOP_DATA names
  std::filesystem::path shipped_polars = "vehicles/polars";  // NAME.toml
  std::string section;                                       // for all propellers, in place of their own; empty: their own
  double fit_rpm = 0.0;                                      // fit the sweep nearest to it; 0: sweep_to_fit()
  double stall_drag = 0.0;                                   // sim::Blade
};

// A set of rows measured in one go.
struct MeasuredSet {
  std::string label;  // "static", "J 5039 rpm"
  std::vector<MeasuredRow> rows;
  bool fitted = false;  // every second row goes into the fit
  bool judged = true;
};

}  // namespace rotorloop::propeller
