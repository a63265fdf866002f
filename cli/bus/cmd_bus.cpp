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
#include "host/bus/live/gs_usb/usb_tree.hpp"
#include "host/bus/live/multicast_bus.hpp"
#include "host/bus/live/open_bus.hpp"
#include "host/bus/live/socketcan/interface_info.hpp"
#include "host/bus/live/socketcan/socketcan_port.hpp"

namespace rotorloop::cli {
namespace {

using Json = nlohmann::ordered_json;
using gs_usb::UsbAdapter;

// What is there to be used, for a backend that this build has.
std::vector<std::string> present(BusBackend backend, const std::vector<CanInterface>& interfaces, const std::vector<UsbAdapter>& adapters) {
  std::vector<std::string> found;
  if (backend == BusBackend::gs_usb) {
    for (const UsbAdapter& a : adapters) found.push_back("gsusb:" + a.name());
  }
  if (backend == BusBackend::socketcan) {
    for (const CanInterface& link : interfaces) found.push_back("socketcan:" + link.name);
  }
  if (backend == BusBackend::slcan) {
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator("/dev", none)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("ttyACM") || name.starts_with("ttyUSB")) found.push_back("slcan:/dev/" + name);
    }
  }
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

// Why CAN sockets cannot be used here; empty when they can.
std::string socketcan_trouble() {
  const int reason = can_socket_trouble();
  return reason == 0 ? ""
                     : socket_refusal({.interface = "can0", .bit_rate_Hz = {}, .data_rate_Hz = {}}, "no CAN sockets", reason).text().what;
}

Json interface_json(const CanInterface& link) {
  Json j{{"name", link.name}, {"kind", link.kind}, {"state", link.state_text()}, {"fd", link.fd()}};
  if (link.bit_rate_Hz) j["bit_rate_Hz"] = *link.bit_rate_Hz;
  if (link.data_rate_Hz) j["data_rate_Hz"] = *link.data_rate_Hz;
  return j;
}

// "can, up, 500000 bit/s, CAN FD at 2000000 bit/s"
std::string interface_text(const CanInterface& link) {
  std::string text = link.kind.empty() ? link.state_text() : link.kind + ", " + link.state_text();
  if (link.bit_rate_Hz) text += fmt::format(", {} bit/s", *link.bit_rate_Hz);
  if (link.fd()) text += link.data_rate_Hz ? fmt::format(", CAN FD at {} bit/s", *link.data_rate_Hz) : ", CAN FD";
  return text;
}

Json adapter_json(const UsbAdapter& a) {
  return {{"serial", a.serial},         {"port", a.path}, {"product", a.product_name}, {"driver", a.driver},
          {"interfaces", a.interfaces}, {"up", a.up},     {"used_by", a.user_text()},  {"programs", programs_with(a)}};
}

// "candleLight USB to CAN adapter, port 1-1.2, used by: kernel driver gs_usb: can0 (up)"
std::string adapter_text(const UsbAdapter& a) {
  const std::string programs = a.driver == "usbfs" ? programs_with(a) : "";
  return fmt::format("{}, port {}, used by: {}{}", a.product_name.empty() ? "no name" : a.product_name, a.path, a.user_text(),
                     programs.empty() ? "" : ", " + programs);
}

int list(bool json) {
  Json document = Json::array();
  const std::vector<CanInterface> interfaces = can_interfaces();
  const std::vector<UsbAdapter> adapters = gs_usb::plugged_in();
  for (const BusBackendInfo& b : bus_backends()) {
    Json row{{"backend", b.prefix}, {"rest", b.rest}, {"built_in", b.built_in}, {"present", present(b.backend, interfaces, adapters)}};
    if (b.backend == BusBackend::socketcan) {
      row["interfaces"] = Json::array();
      for (const CanInterface& link : interfaces) row["interfaces"].push_back(interface_json(link));
      row["trouble"] = socketcan_trouble();
    }
    if (b.backend == BusBackend::gs_usb) {
      row["adapters"] = Json::array();
      for (const UsbAdapter& a : adapters) row["adapters"].push_back(adapter_json(a));
    }
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
    const bool links = row.contains("interfaces") || row.contains("adapters");
    for (const UsbAdapter& a : row.contains("adapters") ? adapters : std::vector<UsbAdapter>{})
      fmt::print("{:<26} found: gsusb:{} ({})\n", "", a.name(), adapter_text(a));
    for (const CanInterface& link : row.contains("interfaces") ? interfaces : std::vector<CanInterface>{})
      fmt::print("{:<26} found: socketcan:{} ({})\n", "", link.name, interface_text(link));
    for (const Json& name : links ? Json::array() : row["present"]) fmt::print("{:<26} found: {}\n", "", name.get<std::string>());
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
    case BusBackend::socketcan:
    case BusBackend::multicast: {
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
  CLI::App* c = group.add_subcommand("bench", "measure the time per frame on a bus of this machine, and count lost frames");
  c->add_option("bus", o->bus, "virtual: (the simulated bus), mcast:N or socketcan:INTERFACE")->capture_default_str();
  c->add_option("--frames", o->options.frames, "number of frames sent in one direction")->capture_default_str();
  c->add_option("--round-trips", o->options.round_trips, "number of frames sent and answered, one at a time")->capture_default_str();
  c->add_option("--burst", o->options.burst, "number of frames sent before the receiver reads; a large number fills its buffer")
      ->capture_default_str();
  c->add_flag("--json", o->json, "one JSON document instead of text");
  c->footer(
      "Examples:\n"
      "  rotorloop bus bench                        # the simulated bus\n"
      "  rotorloop bus bench mcast:9 --burst 20000  # how many frames the receive buffer holds\n"
      "Exit code 6: frames were lost without being counted, or arrived damaged.");
  c->callback([o, &exit_code] { exit_code = bench(*o); });
}

}  // namespace

void add_bus(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("bus", "CAN buses of this machine: monitor, record, replay, bridge, measure");
  group->require_subcommand(1);
  {
    auto json = std::make_shared<bool>(false);
    CLI::App* c =
        group->add_subcommand("list", "list the kinds of bus, and the adapters and CAN interfaces found, with state and bit rates");
    c->add_flag("--json", *json, "one JSON document instead of a table");
    c->footer(
        "All commands name a bus BACKEND:REST. Programs on one machine use mcast:0, as ArduPilot's SITL, pydronecan and the DroneCAN GUI\n"
        "tool do. slcan-server:PATH is a virtual serial adapter for programs that support only serial adapters.\n"
        "Example:\n  rotorloop bus list");
    c->callback([json, &exit_code] { exit_code = list(*json); });
  }
  add_bus_dump(*group, exit_code);
  add_bus_stat(*group, exit_code);
  add_bus_replay(*group, exit_code);
  add_bus_bridge(*group, exit_code);
  add_bus_adapter(*group, exit_code);
  add_bench(*group, exit_code);
  group->footer("Examples:\n  rotorloop bus list\n  rotorloop bus dump mcast:0\nrotorloop --help lists the exit codes.");
}

}  // namespace rotorloop::cli
