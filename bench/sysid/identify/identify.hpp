// The whole way from logs to an identified vehicle: what the streams allow is freed, start values are made, the paper's stages run
// on the flights that have a role, then one joint fit over all flights. Nothing here prints or reads files.
#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/identify/inertia_check.hpp"
#include "bench/sysid/identify/parameter_choice.hpp"
#include "bench/sysid/identify/stages.hpp"
#include "bench/sysid/identify/start_values.hpp"
#include "bench/sysid/log/flight_set.hpp"

namespace rotorloop::identify {

using log::FlightToFit;

struct IdentifyOptions {
  estimate::GridOptions grid;
  host::TermList terms;
  ParameterSelection wishes;
  estimate::NoiseModel noise;  // start values, or with `fit.noise.rounds` = 0 the values
  // What is known before the joint fit, about its free parameters; gets the vehicle file's values.
  std::function<std::vector<estimate::JointPrior>(const host::VehicleFile&, std::span<const estimate::FreeParameter>,
                                                  const estimate::ModelValues&)>
      priors = {};
  // Where there are priors: a fit with their parameters held comes first (staged_fit.hpp), so that an effect which is no part of the model
  // does not hide behind them.
  bool hold_priors_first = true;
  // Priors count against what the blocks of the flights scatter (robust u), not against what the noise alone says (JointPrior::weight).
  bool priors_against_scatter = false;
  // Inertia and c_q are looked at by bands of frequency and taken from there where a band is surer than the fit or contradicts it; a number
  // that cannot be is held at the nearest that can. A diagnosis asks for neither: it looks for what is missing itself.
  bool keep_possible = false;
  estimate::FitOptions fit;
  Solver solver = own_solver();
};

// Called at every iteration, from the thread that called identify().
struct IdentifyProgress {
  std::string part;  // "stage vertical", "joint fit"
  int part_number = 1, parts = 1;
  estimate::FitProgress fit;
};

// Movable, not copyable: `problem` points into `flights`.
struct Identification {
  std::vector<estimate::GridFlight> flights;  // in the order given
  StartValues start;
  std::vector<StageResult> stages;
  std::vector<StageComparison> comparison;  // stages against the joint fit
  InertiaCheck inertia;                     // where asked for (keep_possible)
  std::vector<estimate::Estimate> wanted;   // what the flights want where that cannot be; `fit` has it held at the nearest that can
  estimate::FitProblem problem;             // of the joint fit; points into `flights`
  estimate::Fit fit;

  Identification() = default;
  Identification(const Identification&) = delete;
  Identification(Identification&&) = default;
  Identification& operator=(const Identification&) = delete;
  Identification& operator=(Identification&&) = default;
};

// No step of the model stays linked from one segment to the next, or outside them.
void cut_between_segments(estimate::GridFlight& flight, const std::vector<log::TimeRange>& segments);

// `flights`: at least one, each as log::check_flight leaves it. `vehicle`: mass and geometry, which are trusted, and start values; its
// [[effect]]s take part only as terms of `options.terms`. The estimates (SI; u, u_robust: standard errors) stand in `fit.estimates`;
// identified_vehicle.hpp makes a vehicle file of them. A fit that did not converge is returned: look at fit.converged.
// Method: the paper's section V in stages, then eq. (10) over all flights together.
// Throws Error (data_quality) for a log that lacks what its stage needs, naming both, and for directions that stay open; Error (usage) for
// wishes that name no parameter.
Identification identify(const std::vector<FlightToFit>& flights, const host::VehicleFile& vehicle, const IdentifyOptions& options,
                        const std::function<void(const IdentifyProgress&)>& progress = {});

}  // namespace rotorloop::identify
