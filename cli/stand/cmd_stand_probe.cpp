// `rotorloop stand probe`: what registers mean, from raw words without load and with a known weight.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/stand/instruments/exchange.hpp"
#include "bench/stand/instruments/poll_plan.hpp"
#include "bench/stand/instruments/port_link.hpp"
#include "bench/stand/instruments/probe.hpp"
#include "bench/stand/instruments/units.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/stand/bus_commands.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"

namespace rotorloop::cli {
namespace {

struct ProbeArguments {
  std::string port, name = "net", quantity = "force", unit;
  int slave = 1, fc = 3, address = 0, count = 8, baud = 9600, reads = 10, show = 12, pick = 0;
  std::string format = "8N1";
  double load = 0.0;
  std::filesystem::path out;
  bool force = false, json = false;
};

std::vector<std::vector<std::uint16_t>> read_words(modbus::Exchanger& bus, const ProbeArguments& o, bool tcp) {
  const modbus::SerialFormat format{o.baud, o.format[1], o.format[2] - '0'};
  modbus::ExchangeTiming timing{format.character_ns(), modbus::frame_gap_ns(o.baud, format.character_ns()), 500'000'000, 50'000'000,
                                1'000'000'000};
  if (tcp) timing.character_ns = timing.gap_ns = 0;
  std::vector<std::vector<std::uint16_t>> rows;
  for (int tries = 0; static_cast<int>(rows.size()) < o.reads; ++tries) {
    const auto x = bus.exchange(
        {static_cast<std::uint8_t>(o.slave), o.fc, static_cast<std::uint16_t>(o.address), static_cast<std::uint16_t>(o.count), {}}, timing);
    if (x.reply.failure == modbus::Failure::exception)
      throw Error({o.port,
                   fmt::format("slave {} refuses registers {} … {} (fc {}): {}", o.slave, o.address, o.address + o.count - 1, o.fc,
                               modbus::exception_text(x.reply.exception)),
                   "some of them do not exist, or need the other function code", "narrow --addr and --count, or give --fc 4"},
                  ExitCode::device);
    if (x.reply.failure == modbus::Failure::none)
      rows.push_back(x.reply.registers);
    else if (tries >= o.reads + 5)
      throw Error({o.port, fmt::format("slave {}: {}", o.slave, modbus::name(x.reply.failure)),
                   "another address, rate or word format, or A and B exchanged", "check them at the device; try --baud and --format"},
                  ExitCode::device);
  }
  return rows;
}

void ask(const std::string& what) {
  fmt::print(stderr, "{} ", what);
  std::fflush(stderr);
  std::string line;
  if (!std::getline(std::cin, line))
    throw Error({"stdin", "ended before the weight was on", "", "run the command in a terminal, and press Enter when asked"});
}

void print_words(const char* title, const std::vector<std::vector<std::uint16_t>>& rows, int address) {
  fmt::print("{}:", title);
  for (std::size_t i = 0; i < rows.back().size(); ++i) fmt::print(" {}={:04x}", address + static_cast<int>(i), rows.back()[i]);
  fmt::print("\n");
}

nlohmann::ordered_json words_json(const std::vector<std::vector<std::uint16_t>>& rows) { return rows.back(); }

nlohmann::ordered_json candidate_json(const modbus::ProbeCandidate& c) {
  return {{"address", c.address},
          {"type", modbus::name(c.type)},
          {"order", modbus::name(c.order)},
          {"without_load", c.zero},
          {"with_load", c.loaded},
          {"noise", c.noise},
          {"scale", c.scale},
          {"round_scale", c.round_scale != 0.0 ? nlohmann::ordered_json(c.round_scale) : nullptr}};
}

// All candidates, and what was written of them.
void print_json(const ProbeArguments& o, const modbus::ProbeReadings& r, const std::vector<modbus::ProbeCandidate>& all, int pick) {
  nlohmann::ordered_json j{{"format", 1},
                           {"command", "stand probe"},
                           {"port", o.port},
                           {"slave", o.slave},
                           {"function_code", o.fc},
                           {"address", o.address},
                           {"load", o.load},
                           {"unit", o.unit},
                           {"quantity", o.quantity},
                           {"words_without_load", words_json(r.zero)},
                           {"words_with_load", words_json(r.loaded)}};
  j["candidates"] = nlohmann::ordered_json::array();
  for (const modbus::ProbeCandidate& c : all) j["candidates"].push_back(candidate_json(c));
  if (pick > 0) {
    j["picked"] = pick;
    j["written"] = o.out.generic_string();
  }
  fmt::print("{}\n", j.dump(1));
}

int pick_one(const ProbeArguments& o, const std::vector<modbus::ProbeCandidate>& all) {
  if (o.pick > 0) return o.pick;
  fmt::print(stderr, "Which one is it? (1 to {}) ", std::min<std::size_t>(all.size(), static_cast<std::size_t>(o.show)));
  std::fflush(stderr);
  int pick = 0;
  std::cin >> pick;
  return pick;
}

void print_candidates(const ProbeArguments& o, const std::vector<modbus::ProbeCandidate>& all) {
  fmt::print("{:>3} {:>6} {:<4} {:<5} {:>16} {:>16} {:>12} {:>12} {}\n", "", "addr", "type", "order", "without", "with load", "noise",
             "scale", "round");
  for (std::size_t i = 0; i < all.size() && i < static_cast<std::size_t>(o.show); ++i) {
    const auto& c = all[i];
    fmt::print("{:>3} {:>6} {:<4} {:<5} {:>16.8g} {:>16.8g} {:>12.3g} {:>12.6g} {}\n", i + 1, c.address, modbus::name(c.type),
               modbus::name(c.order), c.zero, c.loaded, c.noise, c.scale, c.round_scale != 0.0 ? fmt::format("{:g}", c.round_scale) : "");
  }
}

int probe(const ProbeArguments& o) {
  const modbus::ChannelUnit* const unit = modbus::find_unit(o.unit);
  if (!unit || unit->quantity != o.quantity)
    throw Error({"--unit", fmt::format("\"{}\" is no unit of {}", o.unit, o.quantity), "", "use one of: " + modbus::units_of(o.quantity)});
  if (o.load == 0.0) throw Error({"--load", "0 changes nothing", "", "give the known load in --unit"});
  if (o.json && !o.out.empty() && o.pick == 0)
    throw Error(
        {"--pick", "is missing: with --json no candidate is asked for", "", "give the number of the one to write, or leave out -o"});
  check_outputs({{"-o", o.out}}, o.force);
  const modbus::PortName port = modbus::parse_port(o.port, "PORT");
  modbus::PortLink link(port, {o.baud, o.format[1], o.format[2] - '0'});
  modbus::Exchanger bus(link, port.tcp ? modbus::Exchanger::Framing::tcp : modbus::Exchanger::Framing::rtu);
  modbus::ProbeReadings r;
  r.address = static_cast<std::uint16_t>(o.address);
  ask("Take every load off, then press Enter.");
  r.zero = read_words(bus, o, port.tcp);
  if (!o.json) print_words("without load", r.zero, o.address);
  ask(fmt::format("Put {} {} on, wait until it rests, then press Enter.", o.load, o.unit));
  r.loaded = read_words(bus, o, port.tcp);
  if (!o.json) print_words("with load   ", r.loaded, o.address);
  const auto all = modbus::rank_candidates(r, o.load);
  if (all.empty())
    throw Error(
        {o.port, fmt::format("registers {} … {} do not follow the load", o.address, o.address + o.count - 1),
         "the value stands elsewhere, or the load did not reach the cell", "try other registers with --addr and --count, or --fc 4"},
        ExitCode::data_quality);
  if (!o.json) print_candidates(o, all);
  const int pick = o.out.empty() ? 0 : pick_one(o, all);
  if (o.out.empty()) {
    if (o.json) print_json(o, r, all, 0);
    return 0;
  }
  if (pick < 1 || pick > static_cast<int>(all.size()))
    throw Error({"--pick", fmt::format("{} is none of the candidates", pick), "", fmt::format("give 1 to {}", all.size())});
  const auto text = modbus::channel_text(all[static_cast<std::size_t>(pick - 1)], o.name, o.quantity, o.unit, o.fc,
                                         fmt::format("rotorloop stand probe with {} {}, slave {}", o.load, o.unit, o.slave));
  write_text_file(o.out, text);
  if (o.json)
    print_json(o, r, all, pick);
  else
    fmt::print("written: {}: put it into a profile (docs/files.md, Device profile)\n", o.out.generic_string());
  return 0;
}

}  // namespace

void add_stand_probe(CLI::App& stand, int& exit_code) {
  auto o = std::make_shared<ProbeArguments>();
  CLI::App* c = stand.add_subcommand("probe", "find register, type, word order and scale of a value with a known weight");
  c->add_option("PORT", o->port, "rtu:/dev/ttyUSB0 or tcp:HOST[:502]")->required();
  c->add_option("--load", o->load, "known load, in the unit of --unit")->required();
  c->add_option("--unit", o->unit, "unit of the load: kg, g, N, N m, …")->required();
  c->add_option("--quantity", o->quantity, "force or torque")->check(CLI::IsMember({"force", "torque"}))->capture_default_str();
  c->add_option("--slave", o->slave, "Modbus address of the device")->check(CLI::Range(1, 247))->capture_default_str();
  c->add_option("--fc", o->fc, "function code: 3 holding registers, 4 input registers")->check(CLI::Range(3, 4))->capture_default_str();
  c->add_option("--addr", o->address, "first register, from 0")->check(CLI::Range(0, 65535))->capture_default_str();
  c->add_option("--count", o->count, "number of registers")->check(CLI::Range(1, 125))->capture_default_str();
  c->add_option("--baud", o->baud, "baud rate")->check(CLI::Range(1200, 921600))->capture_default_str();
  c->add_option("--format", o->format, "data bits, parity, stop bits")
      ->check(CLI::IsMember({"8N1", "8N2", "8E1", "8E2", "8O1", "8O2"}))
      ->capture_default_str();
  c->add_option("--reads", o->reads, "number of readings with and without load; their scatter is the noise")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  c->add_option("--show", o->show, "number of candidates to print")->check(CLI::Range(1, 1000))->capture_default_str();
  c->add_option("--pick", o->pick, "number of the candidate to write; default: the command asks")->check(CLI::Range(1, 1000));
  c->add_option("--name", o->name, "name of the channel that is written")->capture_default_str();
  c->add_option("-o,--out", o->out, "file to write: the [[channel]] of the chosen candidate, for a profile");
  c->add_flag("--json", o->json, "one JSON document on stdout in place of the tables");
  add_force(*c, o->force);
  c->footer(
      "Example:\n  rotorloop stand probe rtu:/dev/ttyUSB0 --addr 7 --count 8 --load 500 --unit g -o net.toml\n"
      "Exit codes: 0 done; 2 bad arguments; 3 the port cannot be opened, or the device does not answer; 5 no register follows the load.");
  c->callback([o, &exit_code] { exit_code = probe(*o); });
}

}  // namespace rotorloop::cli
