// `rotorloop controller`: programs that a run starts as controllers; they speak the handshake of docs/controller.md.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "bench/hil/controller/library_host.hpp"
#include "cli/commands.hpp"

namespace rotorloop::cli {

void add_controller(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("controller", "run a controller for rotorloop hil --controller, which starts these by itself");
  group->require_subcommand(1);
  CLI::App* c = group->add_subcommand("library", "a shared library (host/control/controller_abi.h), in this process");
  auto library = std::make_shared<std::filesystem::path>();
  c->add_option("LIBRARY", *library, "the .so file")->required()->check(CLI::ExistingFile);
  c->footer("One JSON object a line on standard input and output: docs/controller.md.");
  c->callback([library, &exit_code] { exit_code = hil::serve_library(*library); });
}

}  // namespace rotorloop::cli
