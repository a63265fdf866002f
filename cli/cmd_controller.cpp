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
  CLI::App* group =
      app.add_subcommand("controller", "run one controller as a program; rotorloop hil --controller starts these commands by itself");
  group->require_subcommand(1);
  CLI::App* c = group->add_subcommand("library", "run a controller from a shared library (host/control/controller_abi.h)");
  auto library = std::make_shared<std::filesystem::path>();
  c->add_option("LIBRARY", *library, "the .so file")->required()->check(CLI::ExistingFile);
  c->footer("Reads and writes one JSON object per line: docs/controller.md.\nExample:\n  rotorloop controller library ./my_controller.so");
  c->callback([library, &exit_code] { exit_code = hil::serve_library(*library); });

  struct Betaflight {
    bool print_config = false;
    std::filesystem::path vehicle, gains;
  };
  auto o = std::make_shared<Betaflight>();
  CLI::App* b =
      group->add_subcommand("betaflight", "run Betaflight's simulator program; the environment variable ROTORLOOP_BETAFLIGHT has its path");
  auto* print =
      b->add_flag("--print-config", o->print_config, "print the configuration made from a vehicle file and gains, and fly nothing");
  b->add_option("--vehicle", o->vehicle, "vehicle file, with --print-config")->check(CLI::ExistingFile)->needs(print);
  b->add_option("--gains", o->gains, "gains file, with --print-config")->check(CLI::ExistingFile)->needs(print);
  b->footer(
      "Reads and writes one JSON object per line: docs/controller.md.\nExample:\n"
      "  rotorloop controller betaflight --print-config --vehicle vehicles/calibrated.toml --gains gains.toml");
  b->callback([o, &exit_code] {
    if (!o->print_config) {
      exit_code = hil::serve_betaflight();
      return;
    }
    if (o->vehicle.empty() || o->gains.empty())
      throw Error({"--print-config", "needs a vehicle and its gains", "", "add --vehicle FILE and --gains FILE"});
    fmt::print("{}", hil::betaflight_config_of(o->vehicle, o->gains));
  });

  CLI::App* a = group->add_subcommand("ardupilot",
                                      "run ArduCopter's simulator program (JSON backend); the environment variable ROTORLOOP_ARDUPILOT has "
                                      "its path; not tested with ArduCopter yet");
  auto print_parameters = std::make_shared<bool>(false);
  a->add_flag("--print-parameters", *print_parameters, "print the parameters that it is started with, and fly nothing");
  a->footer(
      "Written from the documented packets. Tested with a stand-in program, not with ArduCopter itself.\n"
      "Reads and writes one JSON object per line: docs/controller.md.\nExample:\n  rotorloop controller ardupilot --print-parameters");
  a->callback([print_parameters, &exit_code] {
    if (*print_parameters) return fmt::print("{}", hil::ardupilot_parameters());
    exit_code = hil::serve_ardupilot();
  });

  CLI::App* p =
      group->add_subcommand("px4",
                            "run a program or script that starts PX4 with its MAVLink simulator interface; the environment variable "
                            "ROTORLOOP_PX4 has its path; not tested with PX4 yet");
  p->footer(
      "Written from the documented messages. Tested with a stand-in program, not with PX4 itself.\n"
      "Reads and writes one JSON object per line: docs/controller.md.\n"
      "Example:\n  ROTORLOOP_PX4=./start_px4.sh rotorloop hil scenarios/betaflight.toml --controller px4");
  p->callback([&exit_code] { exit_code = hil::serve_px4(); });
  group->footer("Example:\n  rotorloop hil scenarios/paper.toml --controller ./my_controller.so\nrotorloop --help lists the exit codes.");
}

}  // namespace rotorloop::cli
