// `rotorloop bus replay` and `rotorloop bus bridge`: what puts frames on a bus.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/bus/bus_commands.hpp"
#include "cli/bus/live_options.hpp"
#include "host/base/error.hpp"
#include "host/bus/bus_log.hpp"
#include "host/bus/live/open_bus.hpp"
#include "host/tools/bridge.hpp"
#include "host/tools/replay.hpp"

namespace rotorloop::cli {
namespace {

struct ReplayArguments {
  std::string file, bus, interface;
  tools::ReplayOptions options;
  LiveOptions live;
};

// Frames of one interface alone, when the recording has several and one was named.
void choose_interface(BusLog& log, const ReplayArguments& o) {
  if (o.interface.empty()) return;
  const auto found = std::find(log.interfaces.begin(), log.interfaces.end(), o.interface);
  if (found == log.interfaces.end())
    throw Error({"--interface", fmt::format("{} has no interface \"{}\"", o.file, o.interface), "",
                 fmt::format("use one that it has: {}", fmt::join(log.interfaces, ", "))});
  const auto index = static_cast<std::uint16_t>(found - log.interfaces.begin());
  std::erase_if(log.frames, [&](const LoggedFrame& f) { return f.interface != index; });
}

// A recording has the frames of its own program when it sent them, and those of others by their stamp, which is from before it read them.
// More disorder than a frame can wait for its bus is no single recording.
void put_in_order(BusLog& log, const ReplayArguments& o) {
  constexpr std::int64_t kMostDisorder_ns = 100'000'000;
  std::int64_t newest_ns = INT64_MIN;
  for (const LoggedFrame& f : log.frames) {
    newest_ns = std::max(newest_ns, f.time_ns);
    if (newest_ns - f.time_ns > kMostDisorder_ns)
      throw Error({o.file,
                   fmt::format("frame {}{} is {:.3f} ms older than one before it, beyond the {} ms that are put in order",
                               &f - log.frames.data() + 1, o.interface.empty() ? "" : " of " + o.interface,
                               1e-6 * static_cast<double>(newest_ns - f.time_ns), kMostDisorder_ns / 1'000'000),
                   "several recordings were joined", "sort the lines by their time stamp"});
  }
  std::stable_sort(log.frames.begin(), log.frames.end(), [](const LoggedFrame& a, const LoggedFrame& b) { return a.time_ns < b.time_ns; });
}

int replay(const ReplayArguments& o) {
  if (!(o.options.pace >= 0.01 && o.options.pace <= 1000.0))
    throw Error({"--pace", fmt::format("{} is out of range: 0.01 to 1000", o.options.pace), "", "1 is as recorded, 2 twice as fast"});
  check_live_options(o.live);
  BusLog log = read_bus_log(o.file);
  choose_interface(log, o);
  for (const std::string& note : log.notes) fmt::print(stderr, "{}: {}\n", o.file, note);
  if (log.skipped_remote + log.skipped_error > 0)
    fmt::print(stderr, "{}: passed over: {} remote frames, {} error reports\n", o.file, log.skipped_remote, log.skipped_error);
  if (log.frames.empty()) throw Error({o.file, "holds no frame that can be sent", "", "give another recording"});
  put_in_order(log, o);
  const auto bus = open_bus(o.bus, "bus");
  tools::Replay player(log, o.options, bus->now_ns());
  TimedBus* const alone = bus.get();
  const LiveEnd end = run_live({&alone, 1}, o.live, [&] {
    while (bus->receive_any()) {
    }
    return player.step(*bus);
  });
  const tools::ReplayCounters& c = player.counters();
  fmt::print("{} frames sent, {} not taken by the bus, latest {:.1f} ms late\n", c.sent, c.refused,
             static_cast<double>(c.latest_ns) * 1e-6);
  if (c.commands_left_out > 0)
    fmt::print("{} commands left out (set-points, arming): --with-commands sends them, and motors turn\n", c.commands_left_out);
  tell_losses(*bus);
  // Ctrl-C cuts a replay, whatever --for says.
  return end.by_signal ? to_int(ExitCode::interrupted) : 0;
}

struct BridgeArguments {
  std::vector<std::string> buses;
  LiveOptions live;
};

int bridge(const BridgeArguments& o) {
  check_live_options(o.live);
  if (o.buses.size() < 2)
    throw Error({"bus", "a bridge needs two buses or more", "", "for example: rotorloop bus bridge mcast:0 slcan:/dev/ttyACM0"});
  for (std::size_t i = 0; i < o.buses.size(); ++i) {
    if (std::count(o.buses.begin(), o.buses.end(), o.buses[i]) > 1)
      throw Error({"bus", "\"" + o.buses[i] + "\" stands there twice: frames would go round for ever", "", "name each bus once"});
  }
  std::vector<std::unique_ptr<TimedBus>> owned;
  std::vector<TimedBus*> buses;
  for (const std::string& name : o.buses) {
    // Whatever passes the bridge is seen by the first bus, so that one recording has it all.
    owned.push_back(owned.empty() ? open_recorded(o.live, name, "bus") : open_live(o.live, name, "bus"));
    buses.push_back(owned.back().get());
    if (const std::string device = buses.back()->device_for_programs(); !device.empty())
      fmt::print(stderr, "{}: give {} to the program as its serial adapter\n", buses.back()->name(), device);
  }
  tools::Bridge joined(buses);
  fmt::print(stderr, "bridge up\n");
  const LiveEnd end = run_live(buses, o.live, [&]() -> std::optional<std::int64_t> {
    joined.forward();
    return INT64_MAX;
  });
  finish_recording(*buses[0]);
  for (std::size_t i = 0; i < buses.size(); ++i) {
    const tools::BridgeCounters& c = joined.counters()[i];
    fmt::print("{}: {} frames taken from it, {} given to it, {} not taken by it\n", buses[i]->name(), c.taken, c.given, c.refused);
    tell_losses(*buses[i]);
  }
  return end.exit_code;
}

}  // namespace

void add_bus_replay(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<ReplayArguments>();
  CLI::App* c = group.add_subcommand("replay", "send the frames of a recording again, with their timing");
  c->add_option("recording", o->file, "recording: text of candump -L, or pcap")->required();
  c->add_option("bus", o->bus, kBusHelp)->required();
  c->add_option("--interface", o->interface, "send only the frames of this interface in the recording");
  c->add_option("--pace", o->options.pace, "speed factor: 2 is twice as fast as recorded")->capture_default_str();
  c->add_flag("--with-commands", o->options.with_commands, "also send set-points and arming: motors on the bus will turn");
  c->footer(
      "Without --with-commands no set-points and no arming are sent: a recorded flight would turn the motors on the bus.\n"
      "Example:\n  rotorloop bus replay run/horizontal/pd_ff/1/esc_bus.log mcast:0");
  c->callback([o, &exit_code] { exit_code = replay(*o); });
}

void add_bus_bridge(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<BridgeArguments>();
  CLI::App* c = group.add_subcommand("bridge", "connect buses: each frame of one bus is sent to all others");
  c->add_option("buses", o->buses, kBusHelp)->required();
  add_live_options(*c, o->live);
  c->footer(
      "Examples:\n"
      "  rotorloop bus bridge mcast:0 slcan:/dev/ttyACM0        # real ESCs and a SITL on one bus\n"
      "  rotorloop bus bridge mcast:0 slcan-server:/tmp/slcan0  # a program that supports only serial adapters\n"
      "Run only one bridge between two buses: two of them send the same frames in an endless loop.");
  c->callback([o, &exit_code] { exit_code = bridge(*o); });
}

}  // namespace rotorloop::cli
