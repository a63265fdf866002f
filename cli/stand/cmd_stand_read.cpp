// `rotorloop stand read`: values of instruments on one bus, with their rates, failures and time stamps: what a stand will get.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/stand/instruments/poller.hpp"
#include "bench/stand/instruments/port_clock.hpp"
#include "bench/stand/instruments/port_link.hpp"
#include "bench/stand/instruments/profile_text.hpp"
#include "cli/ending/stop_signals.hpp"
#include "cli/stand/bus_commands.hpp"
#include "cli/stand/device_argument.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

struct ReadArguments {
  std::string port;
  std::vector<std::string> profiles;
  int baud = 0;
  double for_s = 2.0;
  bool json = false;
};

std::vector<modbus::PolledDevice> polled_devices(const std::vector<DeviceArgument>& devices, bool tcp, int baud) {
  std::vector<modbus::PolledDevice> out;
  const modbus::SerialFormat format = modbus::serial_format(devices.front().profile, baud);
  for (const DeviceArgument& d : devices)
    out.push_back({d.name,
                   d.profile,
                   static_cast<std::uint8_t>(d.slave),
                   {},
                   tcp ? modbus::tcp_timing(d.profile) : modbus::rtu_timing(d.profile, format)});
  return out;
}

nlohmann::ordered_json device_json(const modbus::Poller& poller, std::size_t d, const std::vector<std::optional<modbus::Sample>>& newest) {
  const auto& device = poller.devices()[d];
  const auto& s = poller.statistics(d);
  nlohmann::ordered_json j{{"device", device.name},    {"title", device.profile.title()},
                           {"slave", device.slave},    {"evidence", device.profile.evidence},
                           {"exchanges", s.exchanges}, {"failed", s.failed()}};
  for (std::size_t f = 1; f < s.failures.size(); ++f)
    if (s.failures[f]) j["failures"][modbus::name(static_cast<modbus::Failure>(f))] = s.failures[f];
  if (const auto answered = s.exchanges - s.failed())
    j["round_trip_ms"] = 1e-6 * static_cast<double>(s.round_trip_sum_ns) / static_cast<double>(answered);
  j["channels"] = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < newest.size(); ++c) {
    if (!newest[c] || newest[c]->value.quality == modbus::Quality::absent) continue;
    const auto& channel = device.profile.channels[c];
    nlohmann::ordered_json k{
        {"name", channel.name}, {"quality", modbus::name(newest[c]->value.quality)}, {"unit", channel.unit}, {"raw", newest[c]->value.raw}};
    if (newest[c]->value.quality == modbus::Quality::good) k["value"] = newest[c]->value.value;
    k["rate_Hz"] = s.channels[c].rate_Hz();
    k["time_uncertainty_ms"] = 1e-6 * static_cast<double>(newest[c]->uncertainty_ns);
    j["channels"].push_back(k);
  }
  return j;
}

void print_device(const nlohmann::ordered_json& j) {
  fmt::print("{} ({}), slave {}, evidence {}: {} exchanges, {} failed", j["device"].get<std::string>(), j["title"].get<std::string>(),
             j["slave"].get<int>(), j["evidence"].get<std::string>(), j["exchanges"].get<std::uint64_t>(),
             j["failed"].get<std::uint64_t>());
  if (j.contains("failures"))
    for (const auto& [what, n] : j["failures"].items()) fmt::print(", {} {}", n.get<std::uint64_t>(), what);
  if (j.contains("round_trip_ms")) fmt::print(", round trip {:.2f} ms", j["round_trip_ms"].get<double>());
  fmt::print("\n");
  for (const auto& k : j["channels"])
    fmt::print("  {:<18} {:>14} {:<6} {:>7.1f} Hz  ± {:.2f} ms{}\n", k["name"].get<std::string>(),
               k.contains("value") ? fmt::format("{:.6g}", k["value"].get<double>()) : "-", k["unit"].get<std::string>(),
               k["rate_Hz"].get<double>(), k["time_uncertainty_ms"].get<double>(),
               k.contains("value") ? "" : "  " + k["quality"].get<std::string>());
}

// What a device that gave no value did instead: silence, a refusal and a damaged answer have different remedies.
ErrorText silence_of(const std::string& port, const std::vector<DeviceArgument>& devices, const modbus::Poller& poller, bool hears_itself) {
  ErrorText e{port, "", "", "check address and rate at the device, then: rotorloop stand probe"};
  for (std::size_t d = 0; d < devices.size(); ++d) {
    const auto& s = poller.statistics(d);
    if (s.exchanges != s.failed()) continue;
    const auto most = static_cast<modbus::Failure>(std::max_element(s.failures.begin(), s.failures.end()) - s.failures.begin());
    e.what += fmt::format("{}{} from {} ({} of {} exchanges)", e.what.empty() ? "" : "; ",
                          most == modbus::Failure::exception ? "refusal" : modbus::name(most), devices[d].name,
                          s.failures[static_cast<std::size_t>(most)], s.exchanges);
    if (most == modbus::Failure::exception) {
      e.what += fmt::format(": {}, code {}", modbus::exception_text(s.last_exception), s.last_exception);
      e.likely = "a register, a number of registers or a function that this device does not have";
      e.remedy = "compare addr, fc and type of the profile with the device's manual; the line, address and rate are right";
    } else if (most == modbus::Failure::timeout || most == modbus::Failure::disconnected) {
      if (e.likely.empty()) e.likely = "another address or rate, no supply, or A and B exchanged";
    } else if (most == modbus::Failure::incomplete) {
      if (e.likely.empty())
        e.likely = "an adapter that holds bytes back (its latency timer) longer than byte_timeout_ms of the profile, or a disturbed line";
    } else if (e.likely.empty()) {
      e.likely = "another rate or parity, a device of another address, or a disturbed line";
    }
  }
  if (hears_itself) e.what += "; the adapter hears its own requests, which are passed over";
  return e;
}

int read_bus(const ReadArguments& o) {
  const auto devices = device_arguments(o.profiles);
  const modbus::PortName port = modbus::parse_port(o.port, "PORT");
  modbus::PortLink link(port, modbus::serial_format(devices.front().profile, o.baud));
  modbus::Exchanger bus(link, port.tcp ? modbus::Exchanger::Framing::tcp : modbus::Exchanger::Framing::rtu);
  modbus::Poller poller(bus, polled_devices(devices, port.tcp, o.baud), {.slow_divider = 4});
  std::vector<std::vector<std::optional<modbus::Sample>>> newest;
  for (const DeviceArgument& d : devices) newest.emplace_back(d.profile.channels.size());
  poller.on_sample = [&](const modbus::Sample& s) { newest[s.device][s.channel] = s; };
  const StopSignals signals;
  const std::int64_t end = modbus::port_clock_ns() + std::llround(o.for_s * 1e9);
  while (modbus::port_clock_ns() < end && !signals.asked()) poller.step();
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  bool silent = false;
  for (std::size_t d = 0; d < devices.size(); ++d) {
    all.push_back(device_json(poller, d, newest[d]));
    if (!o.json) print_device(all.back());
    silent |= poller.statistics(d).exchanges == poller.statistics(d).failed();
  }
  if (o.json) fmt::print("{}\n", all.dump(1));
  if (!port.tcp && !link.low_latency() && !o.json)
    fmt::print(
        stderr,
        "note: the port has no low-latency setting; USB adapters may hold bytes for 16 ms (/sys/bus/usb-serial/devices/*/latency_timer)\n");
  if (silent) throw Error(silence_of(o.port, devices, poller, bus.hears_itself()), ExitCode::device);
  return signals.asked() ? signals.exit_code() : 0;
}

}  // namespace

void add_stand_read(CLI::App& stand, int& exit_code) {
  auto o = std::make_shared<ReadArguments>();
  CLI::App* c = stand.add_subcommand("read", "read the instruments on one bus: values, sample rates, errors");
  c->add_option("PORT", o->port, "rtu:/dev/ttyUSB0 or tcp:HOST[:502]")->required();
  c->add_option("PROFILE", o->profiles, "PROFILE[@ADDRESS]: name of an included profile, or a profile file")->required();
  c->add_option("--baud", o->baud, "baud rate, in place of the first one in the first profile")->check(CLI::Range(1200, 921600));
  c->add_option("--for", o->for_s, "time to read, s")->check(CLI::Range(0.05, 86400.0))->capture_default_str();
  c->add_flag("--json", o->json, "one JSON document on stdout");
  c->footer(
      "Example:\n  rotorloop stand read rtu:/dev/ttyUSB0 laumas_tlb@1 ato_torque@2\n"
      "Exit codes: 0 done; 2 bad arguments or profile; 3 the port cannot be opened, or a device does not answer; 130, 143 interrupted.");
  c->callback([o, &exit_code] { exit_code = read_bus(*o); });
}

}  // namespace rotorloop::cli
