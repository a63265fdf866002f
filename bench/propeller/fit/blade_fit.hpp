// The four-scalar fit for any propeller: the protocol of ../validation.hpp on files instead of a catalogue.
#pragma once
#include "bench/propeller/fit/propeller_files.hpp"
#include "bench/propeller/validation.hpp"

namespace rotorloop::propeller {

struct BladeFit {
  std::string title;
  bool fitted = false;  // false: there are no measurements, and the blade is the geometry's own
  // What is beyond the limits on held-out rows: static C_T 4 % and C_P 7.5 %, all others 10 and 12 % (../validation.hpp).
  std::vector<std::string> misses;
  bool static_within = true;                   // none of these is of a static table
  int sweeps_held_out = 0, sweeps_within = 0;  // held out whole; the other rows of the fitted sweep are among the misses alone
  SectionChoice section;
  std::vector<PropellerResult> result;  // one, where it is fitted
  std::size_t best = 0;                 // geometry of the smaller misfit
  sim::Blade blade;
  double inertia_kg_m2 = 0.0;
  bool inertia_estimated = false;               // of a solid nylon blade of this plan form
  std::map<std::string, SectionPolars> polars;  // of the sections taken
  std::vector<std::string> remarks;
};

// Fits where a static table with at least four rows is there. Throws Error as its parts do.
BladeFit fit_any_blade(const PropellerFiles& files, const PropellerInputs& inputs, const std::string& title);

// Measured, the static tables within their limits and at least two thirds of the sweeps held out whole within theirs. "fitted", with the
// sweeps beyond their limits where there are some, or "unfitted: " and why not.
bool holds(const BladeFit& f);
std::string verdict_text(const BladeFit& f);

std::string blade_fit_text(const BladeFit& fit);

}  // namespace rotorloop::propeller
