// `rotorloop controller`: programs that a run starts as controllers; they speak the handshake of docs/controller.md.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "bench/hil/controller/betaflight_bridge.hpp"
#include "bench/hil/controller/library_host.hpp"
#include "cli/commands.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {

void add_controller(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("controller", "run a controller for rotorloop hil --controller, which starts these by itself");
  group->require_subcommand(1);
  CLI::App* c = group->add_subcommand("library", "a shared library (host/control/controller_abi.h), in this process");
  auto library = std::make_shared<std::filesystem::path>();
  c->add_option("LIBRARY", *library, "the .so file")->required()->check(CLI::ExistingFile);
  c->footer("One JSON object a line on standard input and output: docs/controller.md.");
  c->callback([library, &exit_code] { exit_code = hil::serve_library(*library); });

  struct Betaflight {
    bool print_config = false;
    std::filesystem::path vehicle, gains;
  };
  auto o = std::make_shared<Betaflight>();
  CLI::App* b =
      group->add_subcommand("betaflight", "Betaflight's simulator program, found by the environment variable ROTORLOOP_BETAFLIGHT");
  auto* print =
      b->add_flag("--print-config", o->print_config, "print the configuration made from a vehicle file and gains, and fly nothing");
  b->add_option("--vehicle", o->vehicle, "vehicle file, with --print-config")->check(CLI::ExistingFile)->needs(print);
  b->add_option("--gains", o->gains, "gains file, with --print-config")->check(CLI::ExistingFile)->needs(print);
  b->footer("One JSON object a line on standard input and output: docs/controller.md.");
  b->callback([o, &exit_code] {
    if (!o->print_config) {
      exit_code = hil::serve_betaflight();
      return;
    }
    if (o->vehicle.empty() || o->gains.empty())
      throw Error({"--print-config", "needs a vehicle and its gains", "", "add --vehicle FILE and --gains FILE"});
    fmt::print("{}", hil::betaflight_config_of(o->vehicle, o->gains));
  });
}

}  // namespace rotorloop::cli
