// `rotorloop esc-sim`: one ESC in a process of its own on a live bus, in real time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "bench/live/esc_process.hpp"
#include "cli/bus/live_options.hpp"
#include "cli/commands.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

struct EscSimArguments {
  std::string bus, node_id, unique_id;
  int esc_index = 0;
  std::filesystem::path plant = "vehicles/reference_plant.toml";
  double pace = 1.0;
  bool no_arming = false;
  LiveOptions live;
};

int number_in(const std::string& option, const std::string& text, int min, int max, const std::string& remedy) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < min || value > max)
    throw Error({option, fmt::format("\"{}\" is out of range: {} to {}", text, min, max), "", remedy});
  return value;
}

std::array<std::uint8_t, 16> unique_id(const EscSimArguments& o) {
  if (o.unique_id.empty()) return live::default_unique_id(static_cast<std::uint8_t>(o.esc_index));
  std::array<std::uint8_t, 16> id{};
  const std::string remedy = "give 32 hexadecimal digits, for example 0102030405060708090a0b0c0d0e0f10";
  if (o.unique_id.size() != 32) throw Error({"--unique-id", fmt::format("{} characters", o.unique_id.size()), "", remedy});
  for (std::size_t i = 0; i < 16; ++i) {
    const char* at = o.unique_id.data() + 2 * i;
    if (std::from_chars(at, at + 2, id[i], 16).ptr != at + 2) throw Error({"--unique-id", "\"" + o.unique_id + "\" is not hexadecimal", "", remedy});
  }
  return id;
}

int esc_sim(const EscSimArguments& o) {
  check_live_options(o.live);
  if (!(o.pace >= 0.01 && o.pace <= 10.0))
    throw Error({"--pace", fmt::format("{} is out of range: 0.01 to 10", o.pace), "", "1 is real time; 0.1 is ten times slower, for a slow machine or a debugger"});
  live::EscProcessConfig config;
  config.plant = o.plant;
  config.node_id = static_cast<std::uint8_t>(number_in("--node-id", o.node_id, 1, 125, "126 and 127 are for tools"));
  if (o.esc_index < 0 || o.esc_index > 15)
    throw Error({"--esc-index", fmt::format("{} is out of range: 0 to 15", o.esc_index), "", "count ESCs from 0, as the autopilot's motor outputs"});
  config.esc_index = static_cast<std::uint8_t>(o.esc_index);
  config.unique_id = unique_id(o);
  config.require_arming = !o.no_arming;
  config.pace = o.pace;
  const auto bus = open_recorded(o.live, o.bus, "--bus");
  live::EscProcess esc(config, *bus);
  TimedBus* const alone = bus.get();
  bool told = false;
  const LiveEnd end = run_live({&alone, 1}, o.live, [&]() -> std::optional<std::int64_t> {
    esc.advance();
    if (!told && esc.operational()) {
      told = true;
      fmt::print("operational: node {}, esc_index {}, {}, {:.2f} V\n", o.node_id, o.esc_index, bus->name(), esc.battery_V());
    }
    return esc.next_ns();
  });
  const firmware::CommandCounters& c = esc.node().command_counters();
  fmt::print(stderr, "commands: {} raw, {} rpm, {} fast; {} not armed; time-outs: {} commands, {} fast\n", c.raw_commands, c.rpm_commands,
             c.fast_setpoints, c.not_armed, c.command_timeouts, c.fast_timeouts);
  if (esc.time_lost_ns() > 0)
    fmt::print(stderr, "the machine was too slow: the ESC's clock fell {:.1f} ms behind; use --pace below 1\n", static_cast<double>(esc.time_lost_ns()) * 1e-6);
  tell_losses(*bus);
  finish_recording(*bus);
  return end.exit_code;
}

}  // namespace

void add_esc_sim(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<EscSimArguments>();
  CLI::App* c = app.add_subcommand("esc-sim", "one ESC with motor, propeller and battery on a bus that other programs join, in real time");
  c->add_option("--bus", o->bus, kBusHelp)->required();
  c->add_option("--node-id", o->node_id, "DroneCAN node id, 1 to 125")->required();
  c->add_option("--esc-index", o->esc_index, "position in command arrays, from 0")->required();
  c->add_option("--unique-id", o->unique_id, "32 hexadecimal digits; without it one that follows from the index");
  c->add_option("--plant", o->plant, "plant file: motor, propeller and battery are those of its first rotor")->capture_default_str();
  c->add_option("--pace", o->pace, "seconds of the ESC per second")->capture_default_str();
  c->add_flag("--no-arming", o->no_arming, "turn without ArmingStatus, for controllers that never send one");
  add_live_options(*c, o->live);
  c->footer(
      "The firmware is the one that `rotorloop hil` flies. It turns only when armed and while commands are fresh (250 ms).\n"
      "Example, four ESCs and who is there:\n"
      "  for i in 0 1 2 3; do rotorloop esc-sim --bus mcast:0 --node-id $((21 + i)) --esc-index $i & done\n"
      "  rotorloop bus dump mcast:0\n"
      "Prints one line when it is operational; Ctrl-C ends it.");
  c->callback([o, &exit_code] { exit_code = esc_sim(*o); });
}

}  // namespace rotorloop::cli
