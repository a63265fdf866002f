// What a diagnosis is made of: flights, and how they are looked at.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/decision_rules.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/identify/wrench_score.hpp"
#include "bench/sysid/log/check/checked_flight.hpp"

namespace rotorloop::diagnose {

struct DiagnoseOptions {
  identify::IdentifyOptions identify;
  Criteria criteria;
  std::vector<std::string> without;             // effects that are not considered
  std::vector<const host::Term*> library = {};  // candidates beside those of host/effects: a user's own
  bool priors = true;                           // uncertainties of the vehicle file (not of guesses) are priors of the fits
  double block_s = 0.5;        // length of the blocks whose scatter gives robust errors; to be longer than residuals stay correlated
  int max_effects = 6;         // added at most
  int refit_iterations = 200;  // of one refit, in all its fits; what takes more is not judged, and the result says so
  std::size_t placebos = 100;
  std::uint64_t seed = 1;            // of the placebos
  identify::WrenchBand wrench_band;  // of force and torque on held-out flights
};

struct FlightsToDiagnose {
  std::vector<identify::FlightToFit> fitted;
  std::vector<identify::FlightToFit> held_out = {};         // no part in the choice
  std::vector<std::vector<log::LogFinding>> findings = {};  // of the checks, of each fitted flight; empty where no checks were made
  std::vector<log::CheckedFlight> refused = {};             // by the checks: a fault of the log, and no part of anything
  std::array<std::string, 4> rotor_columns = {};            // what the logs call the speed of each rotor; empty: as we do
};

struct DiagnoseProgress {
  std::string part;   // "baseline fit", "screening 44 effects", "refit with rotor_inertia_reaction"
  double done = 0.0;  // share of the work expected, 0 to 1
};

}  // namespace rotorloop::diagnose
