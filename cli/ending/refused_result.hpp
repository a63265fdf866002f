// A command that was asked for a report and has no result says so there: result.json, report.html and JUnit with the verdict, the errors
// and the next step, instead of an empty folder or the result of an earlier call.
#pragma once
#include <filesystem>
#include <string>

#include "bench/render/outcome.hpp"
#include "cli/ending/stop_signals.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"

namespace rotorloop::cli {

struct ResultPlaces {
  std::string command;                            // "identify"
  std::filesystem::path report = {}, junit = {};  // empty: not asked for
  bool json = false;                              // on stdout
};

render::Outcome refused_outcome(const Error& error);
render::Outcome interrupted_outcome(const StopSignals& stop);

void report_unfinished(const ResultPlaces& places, const render::Outcome& outcome, const RunClock& clock);

}  // namespace rotorloop::cli
