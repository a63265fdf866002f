// `rotorloop bus`: what buses there are, who talks on them, recordings and bridges. Here the group, `list` and `bench`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/hil/live/bus_bench.hpp"
#include "cli/bus/bus_commands.hpp"
#include "cli/bus/live_options.hpp"
#include "cli/commands.hpp"
#include "host/base/error.hpp"
#include "host/bus/bus_name.hpp"
#include "host/bus/live/multicast_bus.hpp"
#include "host/bus/live/open_bus.hpp"
#include "host/bus/live/socketcan/can_interfaces.hpp"

namespace rotorloop::cli {
namespace {

using Json = nlohmann::ordered_json;

// What is there to be used, for a backend that this build has.
std::vector<std::string> present(BusBackend backend) {
  std::vector<std::string> found;
  if (backend == BusBackend::slcan) {
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator("/dev", none)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("ttyACM") || name.starts_with("ttyUSB")) found.push_back("slcan:/dev/" + name);
    }
  }
  if (backend == BusBackend::socketcan)
    for (const CanInterface& i : can_interfaces()) found.push_back("socketcan:" + i.name + ", " + words(i));
  return found;
}

// Why mcast: cannot be used here; empty when it can.
std::string multicast_trouble() {
  try {
    const MulticastBus bus(0);
    return {};
  } catch (const Error& e) {
    return e.text().what + "; " + e.text().remedy;
  }
}

int list(bool json) {
  Json document = Json::array();
  for (const BusBackendInfo& b : bus_backends()) {
    Json row{{"backend", b.prefix}, {"rest", b.rest}, {"built_in", b.built_in}, {"present", present(b.backend)}};
    if (b.backend == BusBackend::multicast) row["trouble"] = multicast_trouble();
    document.push_back(row);
  }
  if (json) {
    fmt::print("{}\n", document.dump(2));
    return 0;
  }
  fmt::print("{:<14} {:<11} {}\n", "bus", "this build", "behind the colon");
  for (const Json& row : document) {
    fmt::print("{:<14} {:<11} {}\n", row["backend"].get<std::string>() + ":", row["built_in"].get<bool>() ? "yes" : "no",
               row["rest"].get<std::string>());
    for (const Json& name : row["present"]) fmt::print("{:<26} found: {}\n", "", name.get<std::string>());
    if (const std::string trouble = row.value("trouble", ""); !trouble.empty()) fmt::print("{:<26} not usable now: {}\n", "", trouble);
  }
  return 0;
}

struct BenchArguments {
  std::string bus = "virtual:";
  live::BusBenchOptions options;
  bool json = false;
};

live::BusBenchResult measure(const BenchArguments& o) {
  // A negative number arrives here as a huge one: without an upper limit it would be a run without an end.
  static constexpr std::uint64_t kMost = 1'000'000'000;
  const auto within = [](const char* option, std::uint64_t value, std::uint64_t least) {
    if (value < least || value > kMost)
      throw Error({option, fmt::format("{} frames are out of range: {} to {}", static_cast<std::int64_t>(value), least, kMost), "",
                   "100000 frames take some seconds"});
  };
  within("--frames", o.options.frames, 1);
  within("--round-trips", o.options.round_trips, 0);
  within("--burst", o.options.burst, 1);
  const BusName name = parse_bus_name(o.bus, "bus");
  switch (name.backend) {
    case BusBackend::virtual_bus:
      return live::bench_virtual_bus(o.options);
    case BusBackend::multicast:
    case BusBackend::socketcan: {
      const auto a = open_bus(o.bus, "bus"), b = open_bus(o.bus, "bus");
      return live::bench_live_bus(*a, *b, o.options);
    }
    default:
      break;
  }
  throw Error({"bus", "\"" + o.bus + "\" has no second end in this program", "", "measure virtual:, mcast:0 or socketcan:vcan0"});
}

int bench(const BenchArguments& o) {
  const live::BusBenchResult r = measure(o);
  const bool lost = r.unexplained > 0 || r.damaged > 0;
  if (o.json) {
    fmt::print("{}\n", Json{{"bus", o.bus},
                            {"sent", r.sent},
                            {"received", r.received},
                            {"dropped_by_sender", r.dropped_by_sender},
                            {"dropped_by_receiver", r.dropped_by_receiver},
                            {"unexplained", r.unexplained},
                            {"damaged", r.damaged},
                            {"out_of_order", r.out_of_order},
                            {"frames_per_s", r.frames_per_s},
                            {"round_trips", r.round_trips},
                            {"round_trips_lost", r.round_trips_lost},
                            {"round_trip_median_us", r.round_trip_median_us},
                            {"round_trip_p99_us", r.round_trip_p99_us},
                            {"round_trip_worst_us", r.round_trip_worst_us},
                            {"virtual_round_trip_us", r.virtual_round_trip_us},
                            {"bits_per_frame", r.bits_per_frame},
                            {"receive_buffer_B", r.receive_buffer_B}}
                           .dump(2));
    return lost ? to_int(ExitCode::verdict) : 0;
  }
  fmt::print("{}: {} frames sent, {} received, {:.0f} frames/s\n", o.bus, r.sent, r.received, r.frames_per_s);
  if (r.bits_per_frame > 0.0) {
    fmt::print("  frame           {:.1f} bits on average, stuff bits and intermission counted\n", r.bits_per_frame);
    fmt::print("  round trip      {:.1f} us of bus time at 1 Mbit/s, computed in {:.2f} us\n", r.virtual_round_trip_us,
               r.round_trip_median_us);
  } else {
    fmt::print("  lost            {} by the sender's queue, {} by the receiver's buffer ({:.1f} MB), {} unexplained\n", r.dropped_by_sender,
               r.dropped_by_receiver, static_cast<double>(r.receive_buffer_B) * 1e-6, r.unexplained);
    fmt::print("  round trip      {:.1f} us median, {:.1f} us 99 %, {:.1f} us worst of {}; {} lost\n", r.round_trip_median_us,
               r.round_trip_p99_us, r.round_trip_worst_us, r.round_trips, r.round_trips_lost);
  }
  if (r.damaged > 0 || r.out_of_order > 0) fmt::print("  wrong           {} damaged, {} out of order\n", r.damaged, r.out_of_order);
  return lost ? to_int(ExitCode::verdict) : 0;
}

void add_bench(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<BenchArguments>();
  CLI::App* c = group.add_subcommand("bench", "what a frame costs on a bus of this machine, and where frames are lost");
  c->add_option("bus", o->bus, "virtual: (the simulated bus), mcast:N or socketcan:INTERFACE")->capture_default_str();
  c->add_option("--frames", o->options.frames, "frames one way")->capture_default_str();
  c->add_option("--round-trips", o->options.round_trips, "frames there and back, one at a time")->capture_default_str();
  c->add_option("--burst", o->options.burst, "frames sent before the receiver reads again; a large one fills its buffer")
      ->capture_default_str();
  c->add_flag("--json", o->json, "one JSON document instead of text");
  c->footer(
      "Examples:\n"
      "  rotorloop bus bench                        # the simulated bus\n"
      "  rotorloop bus bench mcast:9 --burst 20000  # how many frames the system holds\n"
      "Exit code 6: frames are missing that no counter explains, or came damaged.");
  c->callback([o, &exit_code] { exit_code = bench(*o); });
}

}  // namespace

void add_bus(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("bus", "CAN buses of this machine: who talks, recordings, bridges, cost of a frame");
  group->require_subcommand(1);
  {
    auto json = std::make_shared<bool>(false);
    CLI::App* c = group->add_subcommand("list", "buses that can be named, and adapters that are plugged in");
    c->add_flag("--json", *json, "one JSON document instead of a table");
    c->footer(
        "A bus is named BACKEND:REST wherever a command asks for one. Programs on one machine meet on mcast:0, as do ArduPilot's SITL,\n"
        "pydronecan and the DroneCAN GUI tool; slcan-server:PATH makes a serial adapter out of nothing for programs that know only those.\n"
        "Example:\n  rotorloop bus list");
    c->callback([json, &exit_code] { exit_code = list(*json); });
  }
  add_bus_dump(*group, exit_code);
  add_bus_stat(*group, exit_code);
  add_bus_replay(*group, exit_code);
  add_bus_bridge(*group, exit_code);
  add_bench(*group, exit_code);
}

}  // namespace rotorloop::cli
