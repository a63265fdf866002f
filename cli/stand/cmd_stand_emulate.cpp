// `rotorloop stand emulate`: instruments that are not there, on a pseudo-terminal or on TCP, from the profiles that the master reads by.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/stand/instruments/poll_plan.hpp"
#include "bench/stand/instruments/port_clock.hpp"
#include "bench/stand/instruments/port_server.hpp"
#include "bench/stand/instruments/signals.hpp"
#include "cli/ending/stop_signals.hpp"
#include "cli/stand/bus_commands.hpp"
#include "cli/stand/device_argument.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

struct EmulateArguments {
  std::vector<std::string> profiles, constants, sines;
  std::filesystem::path rtu, table;
  int tcp = -1, baud = 0;
  double for_s = 0.0;
  bool json = false;
};

std::vector<modbus::Signal> emulated_signals(const EmulateArguments& o) {
  std::vector<modbus::Signal> all;
  for (const std::string& text : o.constants) all.push_back(modbus::constant_signal(text, "--set"));
  for (const std::string& text : o.sines) all.push_back(modbus::sine_signal(text, "--sine"));
  if (!o.table.empty())
    for (modbus::Signal& s : modbus::table_signals(o.table)) all.push_back(std::move(s));
  return all;
}

// The signals of one device; all others stay in `left`.
std::vector<modbus::Signal> signals_of(const DeviceArgument& d, bool alone, std::vector<modbus::Signal>& left) {
  std::vector<modbus::Signal> mine, others;
  for (modbus::Signal& s : left) (s.device == d.name || (s.device.empty() && alone) ? mine : others).push_back(std::move(s));
  left = std::move(others);
  return mine;
}

std::vector<modbus::ServedDevice> served_devices(const EmulateArguments& o, const std::vector<DeviceArgument>& devices) {
  std::vector<modbus::Signal> left = emulated_signals(o);
  std::vector<modbus::ServedDevice> out;
  const std::int64_t start_ns = modbus::port_clock_ns();
  for (const DeviceArgument& d : devices) {
    auto device = std::make_shared<modbus::SlaveDevice>(d.profile);
    const auto mine = signals_of(d, devices.size() == 1, left);
    const auto apply = [mine, start_ns](modbus::SlaveDevice& s, std::int64_t now_ns) {
      for (const modbus::Signal& signal : mine) s.set(signal.channel, signal.at(static_cast<double>(now_ns - start_ns) * 1e-9));
    };
    apply(*device, start_ns);  // a mistake in a name or range is said now
    for (const modbus::Signal& s : mine) {
      for (const double end : {s.mean - std::abs(s.amplitude), s.mean + std::abs(s.amplitude)})
        if (s.time_s.empty()) device->set(s.channel, end);
      for (const double v : s.value) device->set(s.channel, v);
    }
    device->on_sample = apply;
    out.push_back({static_cast<std::uint8_t>(d.slave), device, static_cast<std::int64_t>(d.profile.turnaround_ms * 1e6)});
  }
  if (!left.empty())
    throw Error({"--set",
                 fmt::format("\"{}{}{}\" is of no device here", left[0].device, left[0].device.empty() ? "" : ".", left[0].channel), "",
                 "with several devices name the device too, such as laumas_tlb.net=2.5"});
  return out;
}

int emulate(const EmulateArguments& o) {
  if (o.rtu.empty() == (o.tcp < 0)) throw Error({"", "neither or both of --rtu and --tcp", "", "give one of them"});
  const auto devices = device_arguments(o.profiles);
  const auto served = served_devices(o, devices);
  const modbus::SerialFormat format = modbus::serial_format(devices.front().profile, o.baud);
  const auto server = o.tcp < 0 ? modbus::serve_rtu(o.rtu, format) : modbus::serve_tcp(o.tcp);
  const StopSignals signals;
  for (const DeviceArgument& d : devices)
    if (o.json)
      fmt::print("{}\n", nlohmann::ordered_json{{"event", "answers"},
                                                {"device", d.name},
                                                {"at", server->where()},
                                                {"format", o.tcp < 0 ? nlohmann::ordered_json(modbus::text(format)) : nullptr},
                                                {"slave", d.slave}}
                             .dump());
    else
      fmt::print("{} answers at {}{} as slave {}\n", d.name, server->where(), o.tcp < 0 ? ", " + modbus::text(format) : "", d.slave);
  std::fflush(stdout);
  fmt::print(stderr, "emulated instruments, no hardware. Ctrl-C ends.\n");
  const std::int64_t until = o.for_s > 0.0 ? modbus::port_clock_ns() + std::llround(o.for_s * 1e9) : std::int64_t{1} << 62;
  server->serve(served, *signals.flag(), until);
  const auto& n = server->counts();
  if (o.json)
    fmt::print("{}\n",
               nlohmann::ordered_json{
                   {"event", "end"}, {"requests", n.requests}, {"answered", n.answered}, {"refused", n.refused}, {"damaged", n.damaged}}
                   .dump());
  fmt::print(stderr, "{} requests: {} answered, {} refused; {} damaged frames ignored\n", n.requests, n.answered, n.refused, n.damaged);
  return 0;
}

}  // namespace

void add_stand_emulate(CLI::App& stand, int& exit_code) {
  auto o = std::make_shared<EmulateArguments>();
  CLI::App* c = stand.add_subcommand("emulate", "emulate instruments from their profiles, on a pseudo-terminal or on TCP of this machine");
  c->add_option("PROFILE", o->profiles, "PROFILE[@ADDRESS]: name of an included profile, or a profile file")->required();
  c->add_option("--rtu", o->rtu, "path of a new pseudo-terminal, or a serial port; bytes are sent at the baud rate of the first profile");
  c->add_option("--tcp", o->tcp, "TCP port on 127.0.0.1; 0: a free port")->check(CLI::Range(0, 65535));
  c->add_option("--baud", o->baud, "baud rate of --rtu, in place of the first one in the profile")->check(CLI::Range(1200, 921600));
  c->add_option("--set", o->constants, "[DEVICE.]CHANNEL=VALUE: constant value, in the unit of the channel")->allow_extra_args(false);
  c->add_option("--sine", o->sines, "[DEVICE.]CHANNEL=MEAN,AMPLITUDE,PERIOD: sine, in the unit of the channel, period in s")
      ->allow_extra_args(false);
  c->add_option("--file", o->table, "CSV file with t_s and one column per channel; starts again at its end");
  c->add_option("--for", o->for_s, "time to run, s; default: until Ctrl-C")->check(CLI::Range(0.01, 1e6));
  c->add_flag("--json", o->json, "one JSON object per line on stdout: address of each device, and counters at the end");
  c->footer(
      "Example:\n  rotorloop stand emulate laumas_tlb@1 ato_torque@2 --rtu bus --sine laumas_tlb.net=10,5,4\n"
      "  rotorloop stand read rtu:bus laumas_tlb@1 ato_torque@2\n"
      "Exit codes: 0 done; 2 a bad profile, value or path; 3 the port cannot be opened.");
  c->callback([o, &exit_code] { exit_code = emulate(*o); });
}

}  // namespace rotorloop::cli
