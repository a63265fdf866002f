// The whole diagnosis: fit with the priors of the vehicle file, screen every effect against what is left, refit with each that could
// be it, add the best, screen again; at the end take out what the others made needless. Then what separates a class, what the residuals
// say by themselves, and the error on flights held out. Nothing here prints or reads files: all that a program decides and shows is in
// the value returned.
#pragma once
#include <functional>

#include "bench/sysid/diagnose/diagnose_options.hpp"
#include "bench/sysid/diagnose/diagnosis.hpp"

namespace rotorloop::diagnose {

// `flights`, `vehicle`: as identify() takes them; the vehicle's effects belong in options.identify.terms. Terms of `library` must outlive
// the run. Stopped by options.identify.fit.stop, it returns what it has, with the verdict `incomplete`. Verdict, effects with values (SI)
// and evidence: diagnosis.hpp. Throws like identify().
DiagnosisRun diagnose(const FlightsToDiagnose& flights, const host::VehicleFile& vehicle, const DiagnoseOptions& options,
                      const std::function<void(const DiagnoseProgress&)>& progress = {});

}  // namespace rotorloop::diagnose
