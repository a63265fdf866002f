// `rotorloop-studies oracles`: recorded results of other programs against ours, each in that program's own conventions.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "bench/propeller/oracles/oracles.hpp"
#include "cli/rotor/measured_data.hpp"
#include "cli/studies/studies.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {

void add_oracles(CLI::App& app, int& exit_code) {
  CLI::App* c =
      app.add_subcommand("oracles", "recorded results of QPROP, agilicious, JSBSim and RotorPy against ours, in their conventions");
  c->footer(
      "Needs the recordings: ROTORLOOP_DATA names the folder that holds propellers/. docs/acceptance/rotor_oracles.md discusses every "
      "figure.\n"
      "Exit code 0: all limits met; 6: a limit missed; 5: data missing; 2: an argument is wrong.");
  c->callback([&exit_code] {
    const auto rows = propeller::rotor_oracles(measured_data_folder());
    fmt::print("{}", propeller::oracle_table(rows));
    const bool met = std::all_of(rows.begin(), rows.end(), [](const propeller::OracleRow& r) { return r.met(); });
    fmt::print("\n{}\n", met ? "all limits met" : "a limit is missed");
    exit_code = to_int(met ? ExitCode::ok : ExitCode::verdict);
  });
}

}  // namespace rotorloop::cli
