// `rotorloop hil` and what belongs to it. The runner is handed in, so that the command can be tested without flying.
#pragma once
#include <functional>
#include <string>

#include "bench/hil/flight/runner.hpp"

namespace CLI {
class App;
}

namespace rotorloop::cli {

using RunHil = std::function<hil::HilResult(const hil::Scenario&, const hil::RunOptions&, hil::Progress&)>;

// Reads and checks every file that a scenario names; throws Error. Returns lines about the vehicle for --dry-run.
using CheckInputs = std::function<std::string(const hil::Scenario&)>;

// hil SCENARIO…, hil compare, hil report. `exit_code` is set by the callbacks; errors are thrown as Error.
void add_hil(CLI::App& app, int& exit_code, RunHil run, CheckInputs check = {});

// Each adds itself below `hil`.
void add_hil_compare(CLI::App& hil, int& exit_code);
void add_hil_report(CLI::App& hil, int& exit_code);

}  // namespace rotorloop::cli
