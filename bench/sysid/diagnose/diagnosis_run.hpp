// `rotorloop diagnose` as a call: files in, all that the command prints and writes out. Every choice of the command for flights with rotor
// speeds is made here; its defaults are the defaults of DiagnosisRequest. diagnose.hpp is the diagnosis alone, without choices.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/identify/identification_run.hpp"
#include "host/effects/user_term.hpp"

namespace rotorloop::diagnose {

struct DiagnosisRequest {
  std::filesystem::path vehicle = {};       // nominal model and priors; its effects are part of the model
  log::FlightPaths flights = {};            // those held out: for the error before and after
  std::filesystem::path library = {};       // file with effects of a user's own, considered too; empty: none
  std::vector<const host::Term*> own = {};  // terms of the caller's own, considered too; they must outlive the result
  std::filesystem::path out = {};           // where the caller writes the vehicle file, for messages; empty: nowhere
  std::vector<std::string> without = {};    // effects that are not considered
  identify::FitRequest fit = {};
  identify::WrenchBand wrench_band = {};  // of force and torque on held-out flights
  int max_effects = 6;                    // added at most
  int refit_iterations = 200;             // of one refit
  std::size_t placebos = 100;
  std::uint64_t seed = 1;  // of the placebos
  bool priors = true;      // what the vehicle file knows counts with its u; else it gives start values alone
};

// What a diagnosis starts from.
struct NominalModel {
  host::EffectCatalogue catalogue;     // with the user's own
  std::optional<host::UserTerms> own;  // of DiagnosisRequest::library
  host::VehicleFile vehicle;
};
// Throws Error for files that cannot be read and for an effect of `without` that the catalogue does not have.
NominalModel read_nominal_model(const DiagnosisRequest& request);

struct DiagnosedFlights {
  NominalModel nominal;    // `run` points to its terms
  log::FlightSet flights;  // its inputs: vehicle file, library, mapping, flights
  DiagnosisRun run;
  std::optional<Error> fault = {};                // the checks refuse every flight: the verdict is faulty, and nothing was fitted
  std::optional<host::VehicleFile> vehicle = {};  // with the effects that were found; none where stopped or faulty
  std::optional<Error> problem = {};              // why `vehicle` is not credible; it must not be written then
};

// What a caller hears of a run, from the thread that called, and how it ends it early.
struct DiagnosisWatch {
  log::ReadingWatch reading = {};
  std::function<void(const DiagnoseProgress&)> progress = {};
  estimate::StopFit stop = {};
};

// Throws Error as read_nominal_model(), read_flight_set() and diagnose() do.
DiagnosedFlights run_diagnosis(const DiagnosisRequest& request, const DiagnosisWatch& watch = {});

}  // namespace rotorloop::diagnose
