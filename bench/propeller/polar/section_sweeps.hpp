// Polars of a section over the full circle from XFOIL's sweeps (Drela 1989: fixed Reynolds number, Mach 0, free transition), and by what
// rules.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bench/propeller/polar/xfoil_program.hpp"
#include "bench/propeller/xflr5_polar.hpp"
#include "sim/rotor/polar.hpp"

namespace rotorloop::propeller {

struct SweepSettings {
  std::vector<double> reynolds{30e3, 40e3, 60e3, 80e3, 100e3, 150e3, 200e3, 300e3, 500e3};
  double n_crit = 6.0;         // a blade works in the disturbed air of its predecessor; 9 would be a quiet tunnel
  double time_limit_s = 40.0;  // of one sweep; it takes 1 to 2 s, but without traps a diverged one can run for ever
};

// Part of the key of cached polars: raise it when anything below changes what comes out.
constexpr int kRecipeVersion = 1;

// XFOIL's points at one Reynolds number -> a regular grid of half degrees over the branch around zero. It ends at a hole wider than 2
// degrees, and where lift jumps: XFOIL changes to another solution there. Two passes of a binomial filter take out the scatter of a laminar
// separation bubble.
SectionPolar branch_around_zero(const XfoilPoints& points);

struct SectionResult {
  sim::Polar polar;
  std::vector<std::string> remarks;  // Reynolds numbers that were left out, sweeps that hung
  bool hung = false;
};

// One sweep: `XfoilProgram::sweep`, or what a test puts in its place.
using Sweep = std::function<XfoilProgram::Result(const XfoilSweep&)>;

// `said` gets a line for each Reynolds number. Throws Error where none converges.
SectionResult polars_of_sweeps(const std::string& label, const std::string& version, const SweepSettings& settings, const Sweep& sweep,
                               const std::function<void(const std::string&)>& said);

}  // namespace rotorloop::propeller
