// `rotorloop stand run`: turns a motor on a stand through a sequence and writes the run folder.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>

#include "cli/bus/live_options.hpp"
#include "cli/ending/stop_signals.hpp"
#include "cli/stand/bus_commands.hpp"
#include "cli/stand/device_argument.hpp"
#include "cli/stand/stand_run_options.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

struct RunArguments {
  StandRunOptions run;
  VirtualOptions virtual_run;
  std::string bus = "mcast:0";
  int tool_id = 126;
  bool yes = false, dry_run = false, in_virtual_time = false;
};

// Nothing is armed before a person has named what will turn.
void ask_a_person(const modbus::StandSetup& setup) {
  if (::isatty(STDIN_FILENO) != 1)
    throw Error({"--yes", "the propeller would turn, and standard input is no terminal to ask for confirmation", "",
                 "give --yes only when nobody is near the stand"},
                ExitCode::safety);
  fmt::print(stderr,
             "The propeller will turn. Nobody in its plane, stand bolted down, supply switch in reach?\nType the propeller's name to arm, "
             "\"{}\": ",
             setup.propeller.name);
  std::string typed;
  std::getline(std::cin, typed);
  if (typed != setup.propeller.name)
    throw Error({"", fmt::format("\"{}\" is not the propeller's name: nothing was armed", typed), "",
                 "type it as the stand file has it, or give --yes"},
                ExitCode::safety);
}

// A person changes what stands behind the rotor, with the motor disarmed, and presses Enter.
std::function<bool(char)> asked_configurations() {
  return [now = 'A', told = 'A'](char wanted) mutable {
    if (wanted == now) return true;
    if (told != wanted)
      fmt::print(stderr, "disarmed: make configuration {} ({}), then press Enter\n", wanted,
                 wanted == 'A' ? "bare stand" : "with what is to be tested behind the rotor");
    told = wanted;
    pollfd in{STDIN_FILENO, POLLIN, 0};
    if (::poll(&in, 1, 0) <= 0) return false;
    std::string line;
    if (!std::getline(std::cin, line)) return false;
    now = wanted;
    return true;
  };
}

int run_on_ports(RunArguments& o, const modbus::StandSetup& setup, const stand_run::Plan& plan) {
  if (!o.yes) ask_a_person(setup);
  std::optional<StopSignals> stop(std::in_place);
  LiveOptions live;
  const auto bus = open_recorded(live, o.bus, "--bus");
  tools::ToolNodeConfig config;
  config.node_id = static_cast<std::uint8_t>(o.tool_id);
  config.stop = [&stop] { return stop->asked(); };
  o.run.session.configured = asked_configurations();
  int by_signal = 0;
  RunScreen screen(o.run, 0.0);
  stand_run::RunObserver observer = screen.observer;
  observer.on_turn = [&](stand_run::Session& session, double now_s) {
    screen.observer.on_turn(session, now_s);
    if (session.done() || !stop->asked()) return;
    by_signal = stop->exit_code();
    session.ask_stop(stop->name());
    stop.emplace();  // listens for the second one
  };
  const auto summary = stand_run::run_on_ports(setup, plan, o.run, *bus, config, observer);
  if (!summary) return stop->exit_code();
  const int code = print_end(o.run, *summary);
  return by_signal != 0 ? by_signal : code;
}

int stand_run(RunArguments& o) {
  const modbus::StandSetup setup = modbus::read_stand_setup(o.run.setup, profile_path);
  const stand_run::Plan plan = stand_run::plan_of(o.run, setup);
  if (o.dry_run) {
    const stand_run::Prediction predicted = stand_run::predict(setup, plan, o.run.session.settle_s, o.run.supply_V);
    fmt::print("{}", o.run.json ? stand_run::prediction_json(setup, plan, predicted) : stand_run::prediction_text(setup, plan, predicted));
    return predicted.exceeded.empty() ? 0 : to_int(ExitCode::safety);
  }
  if (o.run.out.empty()) throw Error({"-o", "no folder for the run", "", "give a new folder, or --dry-run to see the plan alone"});
  stand_run::refuse_unsafe(setup, plan, o.run);
  for (const std::string& note : setup.notes)
    if (!o.run.quiet) fmt::print(stderr, "note: {}\n", note);
  const bool shaken = std::any_of(setup.axes.begin(), setup.axes.end(),
                                  [](const modbus::BoundChannel& a) { return a.axis == modbus::StandAxis::vibration; });
  if (!o.run.quiet && !shaken) fmt::print(stderr, "note: the limit vibration_m_s2 is watched by nothing: no axis is vibration\n");
  return o.in_virtual_time ? run_virtually(o.run, o.virtual_run, setup, plan) : run_on_ports(o, setup, plan);
}

}  // namespace

void add_stand_run(CLI::App& stand, int& exit_code) {
  auto o = std::make_shared<RunArguments>();
  CLI::App* c = stand.add_subcommand("run", "run a motor on the stand through a sequence of speeds and write the run folder");
  c->add_option("SETUP", o->run.setup, "stand file")->required();
  add_sequence_options(*c, o->run);
  c->add_flag("--dry-run", o->dry_run, "print the plan with predicted thrust, torque, current, duration and exceeded ranges; arms nothing");
  c->add_flag("--live", o->run.live, "serve a page with plots, limits and a stop button for a browser of this machine; prints its address");
  c->add_option("--port", o->run.live_port, "TCP port of the page; 0: a free port")->capture_default_str();
  c->add_flag("--yes", o->yes, "arm without asking; only when nobody is near the stand");
  c->add_option("--bus", o->bus, kBusHelp)->capture_default_str();
  c->add_option("--tool-id", o->tool_id, "node id of this program, 126 or 127")->check(CLI::Range(1, 127))->capture_default_str();
  c->add_option("--listen", o->run.listen_s, "time to wait for the ESC to announce itself, s")
      ->check(CLI::Range(0.5, 60.0))
      ->capture_default_str();
  c->add_flag("--virtual", o->in_virtual_time, "simulate the run in virtual time: instruments emulated, ESC simulated; opens no port");
  add_virtual_options(*c, o->virtual_run);
  c->footer(
      "The motor stops and is disarmed at the end, at a limit, and at Ctrl-C (it ramps down; a second Ctrl-C stops it at once). If this\n"
      "program is killed, the ESC stops the motor after its cmd_timeout_ms (250 ms). The page of --live is reachable from this machine "
      "only\n"
      "(127.0.0.1). Its address contains the token for the stop button. The run continues when the page is closed.\n"
      "For accurate R and K_v of the motor use --commission: estimates from a run alone are off by 6 % and 1 %. The rotor then moves by "
      "one\n"
      "electrical turn, and the parameters of the ESC are not changed.\n"
      "Examples:\n"
      "  rotorloop stand run my_stand.toml --rpm 3000,9000 --dry-run\n"
      "  rotorloop stand run my_stand.toml --rpm 3000,9000 --sequence staircase,step -o runs/p003\n"
      "  rotorloop stand run devices/virtual/stand.toml --virtual --sequence abab --repeats 4 -o runs/strut\n"
      "  rotorloop stand run devices/virtual/stand.toml --virtual --live -o runs/seen\n"
      "Exit codes: 0 done; 2 bad arguments or files; 3 a port, the bus or an instrument failed; 4 a limit ended the run, or it was not "
      "safe\n"
      "to arm; 5 the calibration has expired, or more than 20 % of the steps did not settle; 130, 143 interrupted.");
  c->callback([o, &exit_code] { exit_code = stand_run(*o); });
}

}  // namespace rotorloop::cli
