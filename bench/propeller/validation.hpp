// The BEM rotor model against measured propellers. Protocol, the same for all:
//   parameters  pitch offset, lift scale, drag scale, stall delay: four scalars for a propeller and a geometry
//   fitted on   rows 1, 3, 5, … of the static table and of one advance sweep (catalogue.hpp: sweep_to_fit)
//   held out    the other static rows, the other rows of that sweep, all other sweeps
//   error       rms of (model - measured) / measured over the rows with C_T > kLeastThrust, C_T and C_P apart
//   geometry    where mould and photo exist both are fitted; judged is the one with the smaller misfit on the fitted rows
// Every figure is given unfitted and fitted.
#pragma once
#include <string>
#include <vector>

#include "bench/propeller/catalogue.hpp"
#include "host/base/least_squares.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::propeller {

struct Coefficients {
  double ct, cp;
};
// What the solve says for a row, made dimensionless with `diameter_m`.
Coefficients predict(const sim::Rotor& rotor, double diameter_m, const MeasuredRow& row);

// Pitch offset, lift scale, drag scale, stall delay: start and bounds, with their reasons in the source.
std::vector<BoundedParameter> blade_parameters(double pitch_bound_deg = kPhotographedTwist_deg);
sim::Blade with_parameters(sim::Blade blade, const std::vector<double>& values);

// Least squares of the relative errors of C_T and C_P over the rows with C_T > kLeastThrust.
LeastSquaresFit fit_blade(const sim::Blade& blade, double diameter_m, const std::vector<MeasuredRow>& rows,
                          double pitch_bound_deg = kPhotographedTwist_deg);

struct ErrorRms {
  int rows = 0;
  double ct = 0.0, cp = 0.0;  // relative; not-a-number without rows
};
ErrorRms score(const sim::Rotor& rotor, double diameter_m, const std::vector<MeasuredRow>& rows);

enum class Part { fitted, held_out };
// Rows of a set that are fitted (the odd ones of a fitted set) or held out.
std::vector<MeasuredRow> rows_of(const MeasuredSet& set, Part part);

struct SetScore {
  std::string label;
  bool is_static = false, judged = false;
  bool whole = false;  // a sweep of which no row was fitted
  Part part = Part::held_out;
  ErrorRms unfitted, fitted;
};

struct GeometryResult {
  std::string source;
  bool judged = false;
  LeastSquaresFit fit;
  sim::Blade unfitted_blade, fitted_blade;
  std::vector<SetScore> scores;
};

struct PropellerResult {
  MeasuredPropeller propeller;
  std::vector<GeometryResult> geometries;
};
PropellerResult validate(const MeasuredPropeller& propeller);

// Limits on held-out rows, relative.
constexpr double kStaticThrustMost = 0.04, kStaticPowerMost = 0.075;
constexpr double kSweepThrustMost = 0.08, kSweepPowerMost = 0.10;  // on at least kSweepShare of the sweeps not used in a fit
constexpr double kSweepShare = 0.70;
constexpr double kWorstThrustMost = 0.14, kWorstPowerMost = 0.15;  // on every one of them

// On every set of held-out rows that is no static table, for the verdict on one propeller.
constexpr double kVerdictThrustMost = 0.10, kVerdictPowerMost = 0.12;

struct ValidationLimit {
  std::string name;
  double measured, limit;
  bool at_least;  // the limit is a lower one
  bool pass;
};
std::vector<ValidationLimit> judge(const std::vector<PropellerResult>& results);

}  // namespace rotorloop::propeller
