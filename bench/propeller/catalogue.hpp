// The measured propellers that the BEM rotor model is validated on: files of the data folder, sections, which sweeps count. All
// choices stand here or follow from a rule; validation.hpp has the protocol.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/propeller/geometry.hpp"
#include "bench/propeller/measured.hpp"
#include "sim/rotor/blade.hpp"

namespace rotorloop::propeller {

constexpr double kLeastThrust = 0.01;  // C_T; below, a relative error says nothing

struct SweepFile {
  std::string file;
  double rpm;
  bool judged = true;  // false: printed only
};

// Lift and drag: one section all along the blade, or two with a blend between.
struct SectionChoice {
  std::string inner, outer;                 // outer empty: one section
  double blend_from = 0.0, blend_to = 0.0;  // of the radius
  std::string reason;
};

struct CataloguedPropeller {
  std::string key;  // folder below propellers/ of the data folder
  std::string title;
  double diameter_m;  // nominal: what the database made its coefficients with
  int blades;
  std::string mould, uiuc_geometry;  // files; empty: none
  std::string static_rows;           // file
  std::vector<SweepFile> sweeps;
  bool judged;  // false: printed only
  SectionChoice section;
};

const std::vector<CataloguedPropeller>& propeller_catalogue();

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

// The blade as one source describes it, nothing fitted.
struct GeometryChoice {
  std::string source;  // "mould" or "photo"
  sim::Blade blade;
};

struct MeasuredPropeller {
  CataloguedPropeller entry;
  std::vector<GeometryChoice> geometries;
  std::vector<MeasuredSet> sets;  // the static one first
};

// Reads and checks everything. Throws Error: data_quality for files that the folder lacks, usage for files that are wrong.
// A section is looked for among the data folder's polars (NAME_Re*.txt), then among the shipped ones.
MeasuredPropeller read_measured_propeller(const PropellerInputs& inputs, const CataloguedPropeller& entry);

// The sweep that is fitted: of those that reach zero thrust (a row below kLeastThrust), where pitch shows apart from all else, the
// one whose rotor speed is nearest to the mean of all sweeps, so that the others lie on both sides of it in Reynolds number.
// Index into `sets`, or 0 when none does. With `fit_rpm` > 0 the sweep nearest to that speed instead, whatever it reaches.
std::size_t sweep_to_fit(const std::vector<MeasuredSet>& sets, double fit_rpm = 0.0);

}  // namespace rotorloop::propeller
