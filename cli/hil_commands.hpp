// `rotorloop hil` and what belongs to it. The runner is handed in, so that the command can be tested without flying.
#pragma once
#include <functional>
#include <string>

#include "bench/hil/flight/runner.hpp"
#include "cli/processes/props_off.hpp"

namespace CLI {
class App;
}

namespace rotorloop::cli {

using RunHil = std::function<hil::HilResult(const hil::Scenario&, const hil::RunOptions&, hil::Progress&)>;

// Reads and checks every file that a scenario names; throws Error. Returns lines about the vehicle for --dry-run.
using CheckInputs = std::function<std::string(const hil::Scenario&)>;

// A bench file in place of a scenario: what of the options applies to it.
struct BenchRequest {
  std::string path, out, name;
  bool force = false;
  PropsOff props;
};
using HilBench = std::function<int(const BenchRequest&)>;
int hil_bench(const BenchRequest& request);  // returns the exit code

// hil SCENARIO…, hil BENCH, hil compare, hil report. `exit_code` is set by the callbacks; errors are thrown as Error.
void add_hil(CLI::App& app, int& exit_code, RunHil run, CheckInputs check = {}, HilBench bench = {});

// Each adds itself below `hil`.
void add_hil_compare(CLI::App& hil, int& exit_code);
void add_hil_report(CLI::App& hil, int& exit_code);

}  // namespace rotorloop::cli
