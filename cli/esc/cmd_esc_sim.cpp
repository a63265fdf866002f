// `rotorloop esc-sim`: one ESC in a process of its own on a live bus, in real time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bench/hil/flight/scenario.hpp"
#include "bench/hil/live/emulated_process.hpp"
#include "bench/hil/live/esc_process.hpp"
#include "bench/hil/live/setpoint_clock.hpp"
#include "cli/bus/live_options.hpp"
#include "cli/commands.hpp"
#include "cli/shipped_files.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

struct EscSimArguments {
  std::string bus, node_id, unique_id;
  int esc_index = 0;
  std::filesystem::path store, bridge_log, elf;
  std::filesystem::path plant = "vehicles/reference_plant.toml";
  std::string pace = "realtime";
  double silence_s = 2.0;
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
  if (o.unique_id.size() != 32)
    throw Error({"--unique-id", fmt::format("\"{}\" has {} characters, not 32", o.unique_id, o.unique_id.size()), "", remedy});
  for (std::size_t i = 0; i < 16; ++i) {
    const char* at = o.unique_id.data() + 2 * i;
    if (std::from_chars(at, at + 2, id[i], 16).ptr != at + 2)
      throw Error({"--unique-id", "\"" + o.unique_id + "\" is not hexadecimal", "", remedy});
  }
  return id;
}

// The button of the board: `kill -USR1 PID`.
volatile std::sig_atomic_t button_pressed = 0;
void on_button_signal(int) { button_pressed = 1; }
// A hand turns its rotor: `kill -USR2 PID`.
volatile std::sig_atomic_t hand_begun = 0;
void on_hand_signal(int) { hand_begun = 1; }
constexpr double kHand_rad_s = 25.0;  // four turns a second
constexpr std::int64_t kHand_ns = 2'000'000'000;

// What a user wants to know of the process, each thing once: on which id it is, that it has started again, that it takes an update.
class Told {
 public:
  Told(const EscSimArguments& o, const TimedBus& bus) : o_(o), bus_(bus) {}
  void tell(const live::EscProcess& esc) {
    if (esc.updating() && !std::exchange(updating_, true)) {
      fmt::print("update: the node reads its image\n");
      std::fflush(stdout);
    }
    if (!esc.operational()) return;
    updating_ = false;
    if (esc.node_id() == 0) {
      if (!std::exchange(asking_, true))
        fmt::print(stderr, "asks for a node id; an autopilot gives one, or: rotorloop esc serve --bus {}\n", o_.bus);
      return;
    }
    if (esc.starts() == starts_ && esc.node_id() == node_id_) return;
    starts_ = esc.starts();
    node_id_ = esc.node_id();
    asking_ = false;
    fmt::print("operational: node {}, esc_index {}, {}, {:.2f} V, firmware {}.{}\n", node_id_,
               esc.esc_index() < 0 ? "none" : std::to_string(esc.esc_index()), bus_.name(), esc.battery_V(), esc.image().major,
               esc.image().minor);
    std::fflush(stdout);
    const bool other =
        (o_.node_id != "auto" && std::to_string(esc.node().parameters().node_id) != o_.node_id) || esc.esc_index() != o_.esc_index;
    if (esc.parameters_stored() && other && !std::exchange(reported_store_, true))
      fmt::print(stderr, "{} holds saved parameters: they go before --node-id and --esc-index\n", o_.store.generic_string());
  }

 private:
  const EscSimArguments& o_;
  const TimedBus& bus_;
  int starts_ = 0;
  std::uint8_t node_id_ = 0;
  bool asking_ = false, updating_ = false, reported_store_ = false;
};

live::EscProcessConfig configuration(const EscSimArguments& o) {
  live::EscProcessConfig config;
  const auto pace = hil::parse_pace(o.pace);
  if (!pace)
    throw Error({"--pace", fmt::format("\"{}\" is out of range: 0.01 to 10, realtime or lockstep", o.pace), "",
                 "1 is real time; 0.1 is ten times slower, for a slow machine or a debugger"});
  if (*pace > 0.0) config.pace = *pace;
  config.plant = o.plant;
  config.node_id = o.node_id == "auto" ? std::uint8_t{0}
                                       : static_cast<std::uint8_t>(number_in("--node-id", o.node_id, 1, 125,
                                                                             "126 and 127 are for tools; auto asks an allocator for one"));
  if (o.esc_index < 0 || o.esc_index > 15)
    throw Error({"--esc-index", fmt::format("{} is out of range: 0 to 15", o.esc_index), "",
                 "count ESCs from 0, as the autopilot's motor outputs"});
  config.esc_index = static_cast<std::uint8_t>(o.esc_index);
  config.unique_id = unique_id(o);
  config.require_arming = !o.no_arming;
  config.store = o.store;
  return config;
}

bool lockstep(const EscSimArguments& o) { return hil::parse_pace(o.pace) == 0.0; }

// Whose time is that of the set-points: moved on by each, and by its own time-outs when the last one has come.
class LockstepEsc {
 public:
  LockstepEsc(const EscSimArguments& o, TimedBus& bus)
      : clock_(bus, static_cast<std::uint8_t>(o.esc_index / 4), static_cast<std::int64_t>(1e9 * o.silence_s)) {}
  TimedBus& bus() { return clock_; }
  std::int64_t advance(live::EscProcess& esc) {
    while (clock_.begin_step()) {
      esc.advance();
      clock_.end_step();
    }
    return clock_.next_ns();
  }
  // No order comes any more: the ESC's time-outs stop its motor.
  void run_down(live::EscProcess& esc) {
    constexpr std::int64_t kSlice_ns = 10'000'000, kRunDown_ns = 1'500'000'000;  // longer than the longest time-out of an order
    for (std::int64_t t_ns = 0; esc.bridge_on() && t_ns < kRunDown_ns; t_ns += kSlice_ns) {
      clock_.run_on(kSlice_ns);
      esc.advance();
    }
  }

 private:
  live::SetpointClock clock_;
};

// One line for each change, whole at once: a reader sees it as soon as it happened.
std::ofstream begun_bridge_log(const EscSimArguments& o) {
  const std::string name = o.bridge_log.generic_string();
  if (std::filesystem::exists(o.bridge_log) && !o.live.force)
    throw Error({name, "is there already", "", "give another name, or --force to replace it"});
  std::ofstream out(o.bridge_log);
  out << "t_s,bridge,since_command_ms\n" << std::flush;
  if (!out) throw Error({name, "cannot be written", "", "give another file with --bridge-log"}, ExitCode::device);
  return out;
}

void tell_lost_time(std::int64_t lost_ns) {
  if (lost_ns > 0)
    fmt::print(stderr, "the machine was too slow: the ESC's clock fell {:.1f} ms behind; use --pace below 1\n",
               static_cast<double>(lost_ns) * 1e-6);
}

void refuse_with_elf(const char* option, bool given) {
  if (given)
    throw Error({option, "cannot be used with --elf", "the program on the emulated chip has an id, a flash and a bridge of its own",
                 "leave one of them out"});
}

// The same as the bytes of its program.
int emulated_esc_sim(const EscSimArguments& o) {
  refuse_with_elf("--store", !o.store.empty());
  refuse_with_elf("--unique-id", !o.unique_id.empty());
  refuse_with_elf("--bridge-log", !o.bridge_log.empty());
  refuse_with_elf("--pace lockstep", lockstep(o));
  const live::EscProcessConfig config = configuration(o);
  const sim::EscProgram program = sim::read_esc_program(o.elf, shipped_or_given("vehicles/boards/b_g431b_esc1.toml"));
  const auto bus = open_recorded(o.live, o.bus, "--bus");
  live::EmulatedEscProcess esc(config, program, *bus);
  TimedBus* const alone = bus.get();
  int reported_id = 0;
  const LiveEnd end = run_live({&alone, 1}, o.live, [&]() -> std::optional<std::int64_t> {
    esc.advance();
    if (esc.node_id() != reported_id) {
      reported_id = esc.node_id();
      fmt::print("on the bus: node {}, {}, {:.2f} V, STM32G431 with {}\n", reported_id, bus->name(), esc.battery_V(), program.text());
      std::fflush(stdout);
    }
    return esc.next_ns();
  });
  if (esc.resets() > 0) fmt::print(stderr, "the chip was reset {} times\n", esc.resets());
  tell_lost_time(esc.time_lost_ns());
  tell_losses(*bus);
  finish_recording(*bus);
  return end.exit_code;
}

int esc_sim(const EscSimArguments& o) {
  check_live_options(o.live);
  if (!o.elf.empty()) return emulated_esc_sim(o);
  const live::EscProcessConfig config = configuration(o);
  const auto bus = open_recorded(o.live, o.bus, "--bus");
  std::optional<LockstepEsc> stepped;
  if (lockstep(o)) stepped.emplace(o, *bus);
  live::EscProcess esc(config, stepped ? stepped->bus() : *bus);
  std::ofstream log;
  if (!o.bridge_log.empty()) {
    log = begun_bridge_log(o);
    esc.on_bridge = [&log](const live::BridgeChange& b) {
      log << fmt::format("{:.6f},{},{:.3f}\n", b.t_s, b.on ? "on" : "off", 1e3 * b.since_command_s) << std::flush;
    };
  }
  TimedBus* const alone = bus.get();
  std::signal(SIGUSR1, on_button_signal);
  std::signal(SIGUSR2, on_hand_signal);
  std::int64_t hand_until_ns = 0;
  Told told(o, *bus);
  const LiveEnd end = run_live({&alone, 1}, o.live, [&]() -> std::optional<std::int64_t> {
    if (button_pressed != 0) {
      button_pressed = 0;
      esc.press_button();
    }
    if (hand_begun != 0) {
      hand_begun = 0;
      hand_until_ns = bus->now_ns() + kHand_ns;
    }
    esc.turn_by_hand(bus->now_ns() < hand_until_ns ? std::optional(kHand_rad_s) : std::nullopt);
    if (!stepped) esc.advance();
    const std::int64_t next_ns = stepped ? stepped->advance(esc) : esc.next_ns();
    told.tell(esc);
    return next_ns;
  });
  if (stepped) stepped->run_down(esc);
  const firmware::CommandCounters& c = esc.node().command_counters();
  fmt::print(stderr, "commands: {} raw, {} rpm, {} fast; {} not armed; time-outs: {} commands, {} fast\n", c.raw_commands, c.rpm_commands,
             c.fast_setpoints, c.not_armed, c.command_timeouts, c.fast_timeouts);
  tell_lost_time(esc.time_lost_ns());
  tell_losses(*bus);
  finish_recording(*bus);
  return end.exit_code;
}

}  // namespace

void add_esc_sim(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<EscSimArguments>();
  CLI::App* c = app.add_subcommand(
      "esc-sim", "simulate one ESC with motor, propeller and battery in real time, on a bus that other programs can join");
  c->add_option("--bus", o->bus, kBusHelp)->required();
  c->add_option("--node-id", o->node_id,
                "DroneCAN node id, 1 to 125, or auto: asks an allocator for one (rotorloop esc serve, an autopilot)")
      ->required();
  c->add_option("--esc-index", o->esc_index, "position in command arrays, from 0")->required();
  c->add_option("--unique-id", o->unique_id, "unique id, 32 hexadecimal digits; default: derived from the index");
  c->add_option(
      "--store", o->store,
      "file for the simulated flash: parameters and firmware survive restart and kill; stored values override --node-id and --esc-index");
  c->add_option(
      "--elf", o->elf,
      "run this program of the B-G431B-ESC1 (scripts/firmware) on an emulated STM32G431, in place of the firmware that is compiled "
      "in; not with --store, --unique-id, --bridge-log");
  c->add_option("--plant", o->plant, "plant file; motor, propeller and battery of its first rotor are used")->capture_default_str();
  c->add_option("--pace", o->pace,
                "simulated seconds per second of real time, realtime, or lockstep: each set-point of the fast channel is 1 ms")
      ->capture_default_str();
  c->add_option("--silence", o->silence_s, "with lockstep: s without a set-point after which time goes on by itself, and the motor stops")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  c->add_flag("--no-arming", o->no_arming, "run without ArmingStatus, for controllers that do not send it");
  c->add_option(
      "--bridge-log", o->bridge_log,
      "CSV file to write: times at which the bridge starts and stops switching, and the age of the newest command, by the ESC's clock");
  add_live_options(*c, o->live);
  c->footer(
      "The firmware is the same as in `rotorloop hil`. The motor runs only while armed, with commands not older than 250 ms.\n"
      "Example: four ESCs, and their messages:\n"
      "  for i in 0 1 2 3; do rotorloop esc-sim --bus mcast:0 --node-id $((21 + i)) --esc-index $i & done\n"
      "  rotorloop bus dump mcast:0\n"
      "Example: an ESC with stored parameters and an allocated node id:\n"
      "  rotorloop esc serve & rotorloop esc-sim --bus mcast:0 --node-id auto --esc-index 0 --store esc0.flash\n"
      "Example: the program that is flashed into the board, in the chip's own time (a chip takes about a core):\n"
      "  rotorloop esc-sim --elf build/firmware/bin/b_g431b_esc1.elf --bus mcast:0 --node-id 21 --esc-index 0 --pace 0.5\n"
      "Prints one line when the ESC is operational and after each restart. For esc enumerate, kill -USR1 presses the button and kill "
      "-USR2\n"
      "turns the rotor by hand for 2 s. Ctrl-C ends the program.");
  c->callback([o, &exit_code] { exit_code = esc_sim(*o); });
}

}  // namespace rotorloop::cli
