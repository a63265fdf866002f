// The whole diagnosis: fit with the priors of the vehicle file, screen every effect against what is left, refit with each that could
// be it, add the best, screen again; at the end take out what the others made needless. Then what separates a class, what the residuals
// say by themselves, and the error on flights held out. Nothing here prints or reads files: all that a program decides and shows is in
// the value returned.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/diagnosis.hpp"
#include "bench/sysid/diagnose/diagnosis_run.hpp"
#include "bench/sysid/diagnose/examine.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/log/check/checked_flight.hpp"

namespace rotorloop::diagnose {

struct DiagnoseOptions {
  identify::IdentifyOptions identify;
  Criteria criteria;
  std::vector<std::string> without;             // effects that are not considered
  std::vector<const host::Term*> library = {};  // candidates beside those of host/effects: a user's own
  bool priors = true;                           // uncertainties of the vehicle file (not of guesses) are priors of the fits
  double block_s = 0.5;          // length of the blocks whose scatter gives robust errors; to be longer than residuals stay correlated
  int max_effects = 6;           // added at most
  double refit_limit_s = 600.0;  // of wall time, each; what takes longer is not judged, and a remark says so
  std::size_t placebos = 100;
  std::uint64_t seed = 1;            // of the placebos
  identify::WrenchBand wrench_band;  // of force and torque on held-out flights
};

struct FlightsToDiagnose {
  std::vector<identify::FlightToFit> fitted;
  std::vector<identify::FlightToFit> held_out = {};         // no part in the choice
  std::vector<std::vector<log::LogFinding>> findings = {};  // of the checks, of each fitted flight; empty where no checks were made
  std::vector<log::CheckedFlight> refused = {};             // by the checks: a fault of the log, and no part of anything
};

struct DiagnoseProgress {
  std::string part;   // "baseline fit", "screening 44 effects", "refit with rotor_inertia_reaction"
  double done = 0.0;  // share of the work expected, 0 to 1
};

// `flights`, `vehicle`: as identify() takes them; the vehicle's effects belong in options.identify.terms. Terms of `library` must outlive
// the run. Stopped by options.identify.fit.stop, it returns what it has, with the verdict `incomplete`. Verdict, effects with values (SI)
// and evidence: diagnosis.hpp. Throws like identify().
DiagnosisRun diagnose(const FlightsToDiagnose& flights, const host::VehicleFile& vehicle, const DiagnoseOptions& options,
                      const std::function<void(const DiagnoseProgress&)>& progress = {});

// What the residuals of the last model say by themselves: a systematic rest or bursts stand in `remains`, and make it `unexplained` when no
// effect was found. Only where it matters to this vehicle: half a per cent of its weight, or of its weight times the arm of its rotors,
// beyond the noise. `without`: effects on the scatter that are not considered.
void judge_residuals(const ResidualFindings& left, const estimate::ModelValues& vehicle, Diagnosis& diagnosis,
                     const std::vector<std::string>& without = {}, const Criteria& criteria = {});

// Whether the effects that were added are an explanation where something remains: when they leave the larger part of what was missing
// before them (power of residual force and torque beyond noise, each over what matters), the verdict is `unexplained`, and a remark says
// the share.
void judge_explained(const ResidualFindings& before, const ResidualFindings& left, const estimate::ModelValues& vehicle,
                     Diagnosis& diagnosis, const Criteria& criteria = {});

}  // namespace rotorloop::diagnose
