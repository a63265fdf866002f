// `rotorloop hil report RUN…`: makes report.html again from the files of a run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "bench/hil/flight/run_report.hpp"
#include "cli/hil_commands.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {

void add_hil_report(CLI::App& hil, int& exit_code) {
  auto* c = hil.add_subcommand("report", "write report.html again from the files of a run");
  auto runs = std::make_shared<std::vector<std::string>>();
  c->add_option("RUN", *runs, "run folders")->required();
  c->footer("Example:\n  rotorloop hil report runs/paper");
  c->callback([runs, &exit_code] {
    for (const auto& run : *runs) fmt::print("{}\n", hil::write_hil_report(run).generic_string());
    exit_code = to_int(ExitCode::ok);
  });
}

}  // namespace rotorloop::cli
