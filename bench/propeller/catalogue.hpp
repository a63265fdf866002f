// The measured propellers that the BEM rotor model is validated on: files of the data folder, sections, which sweeps count. All
// choices stand here or follow from a rule; validation.hpp has the protocol.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/propeller/propeller_inputs.hpp"
#include "sim/rotor/blade.hpp"

namespace rotorloop::propeller {

struct SweepFile {
  std::string file;
  double rpm;
  bool judged = true;  // false: printed only
};

// Photo and mould of one propeller differ by up to 2.1 degrees at 0.75 R, either sign.
constexpr double kPhotographedTwist_deg = 3.0;

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
  double pitch_bound_deg = kPhotographedTwist_deg;
};

const std::vector<CataloguedPropeller>& propeller_catalogue();

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
// Index into `sets`, or 0 when none does. With `fit_rpm` > 0 the sweep nearest to that speed instead, whatever it reaches. What was
// predicted and not measured is none of them.
std::size_t sweep_to_fit(const std::vector<MeasuredSet>& sets, double fit_rpm = 0.0);

}  // namespace rotorloop::propeller
