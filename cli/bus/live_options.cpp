#include "cli/bus/live_options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "cli/ending/outputs.hpp"
#include "host/base/error.hpp"
#include "host/bus/live/live_clock.hpp"
#include "host/bus/live/open_bus.hpp"
#include "host/bus/live/waiting_bus.hpp"
#include "host/bus/recorded_bus.hpp"

namespace rotorloop::cli {
namespace {

constexpr std::int64_t kLookForSignals_ns = 100'000'000;  // a signal between two waits is seen after this at the latest

}  // namespace

void add_live_options(CLI::App& c, LiveOptions& o) {
  add_for(c, o, "time to run, s; default: until Ctrl-C");
  c.add_option("--record", o.record, "record all frames to this file: .pcap for Wireshark, otherwise text of candump -L");
  c.add_flag("--wait", o.wait, "wait until the bus exists, and continue when it comes back after a loss");
  add_force(c, o.force);
}

void add_for(CLI::App& c, LiveOptions& o, const char* help) {
  c.add_option_function<double>(
       "--for",
       [&o](double seconds) {
         o.for_s = seconds;
         o.for_given = true;
       },
       help)
      ->type_name("FLOAT");
}

void check_live_options(const LiveOptions& o) {
  if (o.for_given && !(o.for_s > 0.0 && o.for_s <= 1e7))
    throw Error({"--for", fmt::format("{} s is out of range: above 0, to 10000000", o.for_s), "", "leave it out to run until Ctrl-C"});
  check_outputs({{"--record", o.record}}, o.force);
}

LiveEnd run_live(std::span<TimedBus* const> buses, const LiveOptions& o, const std::function<std::optional<std::int64_t>()>& step) {
  const StopSignals stop;
  const std::int64_t end_ns = o.for_s > 0.0 ? live_now_ns() + static_cast<std::int64_t>(o.for_s * 1e9) : INT64_MAX;
  while (!stop.asked()) {
    const auto next_ns = step();
    for (TimedBus* bus : buses) tell_notices(*bus);
    if (!next_ns || live_now_ns() >= end_ns) return {};
    std::fflush(stdout);
    wait_for_any(buses, std::min({*next_ns, end_ns, live_now_ns() + kLookForSignals_ns}));
  }
  return {.by_signal = true, .exit_code = o.for_s > 0.0 ? stop.exit_code() : 0};
}

std::string interface_name(const std::string& bus) {
  const std::size_t colon = std::min(bus.find(':'), bus.size() - 1);
  std::string name = bus.substr(colon + 1, bus.find('@', colon) - colon - 1);
  if (bus.starts_with("gsusb:")) std::replace(name.begin(), name.end(), '/', '.');  // SERIAL/CHANNEL
  name.erase(0, name.rfind('/') + 1);
  if (name.empty() || bus.starts_with("mcast:")) name = bus.substr(0, colon) + name;
  return name.substr(0, kMaxInterfaceName);
}

std::unique_ptr<TimedBus> open_live(const LiveOptions& o, const std::string& bus, const std::string& where) {
  if (!o.wait) return open_bus(bus, where);
  return std::make_unique<WaitingBus>(bus, [bus, where] { return open_bus(bus, where); });
}

std::unique_ptr<TimedBus> open_recorded(const LiveOptions& o, const std::string& bus, const std::string& where) {
  auto opened = open_live(o, bus, where);
  if (o.record.empty()) return opened;
  return std::make_unique<RecordedBus>(std::move(opened), o.record.generic_string(), interface_name(bus));
}

void finish_recording(TimedBus& bus) {
  if (auto* const recorded = dynamic_cast<RecordedBus*>(&bus)) recorded->close_recording();
}

void tell_notices(TimedBus& bus) {
  while (const auto notice = bus.next_notice()) fmt::print(stderr, "{}: {}\n", bus.name(), *notice);
}

void tell_losses(TimedBus& bus) {
  tell_notices(bus);
  const PortCounters c = bus.counters();
  const LinkCounters l = bus.link_counters();
  std::string text;
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, what);
  };
  add(c.dropped_rx, "frames lost as this program was too slow");
  add(c.dropped_tx, "frames not sent as a queue was full or nobody was connected");
  add(l.malformed, "malformed packets passed over");
  add(l.remote, "remote frames passed over");
  add(l.error_reports, "error reports of the bus");
  add(l.refused_by_peer, "frames refused by the adapter");
  add(l.stale, "of the frames not sent had waited 100 ms");
  add(l.fd_refused, "of the frames not sent were CAN FD, which this bus does not carry");
  if (!text.empty()) fmt::print(stderr, "{}: {}\n", bus.name(), text);
}

}  // namespace rotorloop::cli
