// `rotorloop controller`: programs that a run starts as controllers; they speak the handshake of docs/controller.md.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "bench/hil/controllers/ardupilot_bridge.hpp"
#include "bench/hil/controllers/betaflight_bridge.hpp"
#include "bench/hil/controllers/library_host.hpp"
#include "bench/hil/controllers/px4_bridge.hpp"
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

  CLI::App* a = group->add_subcommand(
      "ardupilot", "ArduCopter's simulator program (JSON backend), found by the environment variable ROTORLOOP_ARDUPILOT; not run here");
  auto print_parameters = std::make_shared<bool>(false);
  a->add_flag("--print-parameters", *print_parameters, "print the parameters that it is started with, and fly nothing");
  a->footer(
      "Built from the documented packets and tried with a stand-in for the program alone.\nOne JSON object a line on standard input and "
      "output: docs/controller.md.");
  a->callback([print_parameters, &exit_code] {
    if (*print_parameters) return fmt::print("{}", hil::ardupilot_parameters());
    exit_code = hil::serve_ardupilot();
  });

  CLI::App* p = group->add_subcommand("px4",
                                      "a program or script that starts PX4 with its MAVLink simulator interface, found by the environment "
                                      "variable ROTORLOOP_PX4; not run here");
  p->footer(
      "Built from the documented messages and tried with a stand-in for the program alone.\nOne JSON object a line on standard input and "
      "output: docs/controller.md.");
  p->callback([&exit_code] { exit_code = hil::serve_px4(); });
}

}  // namespace rotorloop::cli
