#include "bench/hil/processes/bench_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/hil/flight/scenario.hpp"
#include "host/base/toml_file.hpp"
#include "host/bus/bus_name.hpp"

namespace rotorloop::hil {
namespace {

std::string read_bus(const TomlTable& buses, const char* key) {
  std::string name = buses.text(key);
  if (parse_bus_name(name, buses.where(key)).backend == BusBackend::virtual_bus)
    buses.fail(key, fmt::format("\"{}\" is a virtual bus, which ends at one process", name), "",
               "use mcast:0, socketcan:can0 or another bus that others can join");
  return name;
}

void read_escs(const TomlTable& root, BenchFile& b) {
  const auto escs = root.tables("esc", 4, 4);
  for (std::size_t i = 0; i < escs.size(); ++i) {
    b.esc_nodes[i] = static_cast<std::uint8_t>(escs[i].integer("node_id", 1, 125));
    b.esc_simulated[i] = escs[i].boolean("simulated");
    if (std::find(b.esc_nodes.begin(), b.esc_nodes.begin() + static_cast<std::ptrdiff_t>(i), b.esc_nodes[i]) !=
        b.esc_nodes.begin() + static_cast<std::ptrdiff_t>(i))
      escs[i].fail("node_id", fmt::format("node_id = {} stands here twice", b.esc_nodes[i]), "two nodes of one id silence each other",
                   "give each ESC an id of its own");
  }
}

}  // namespace

BenchFile read_bench(const std::filesystem::path& path) {
  const auto file = TomlFile::read(path);
  file.format({1});
  const auto root = file.root();
  BenchFile b;
  b.path = path;
  b.scenario = root.file("scenario");
  b.flight = root.text("flight", "");
  b.variant = root.text("variant", "");
  b.seed = static_cast<std::uint64_t>(root.integer("seed", 0, INT64_MAX, 0));
  b.pace = root.text("pace", b.pace);
  if (!parse_pace(b.pace)) root.fail("pace", fmt::format("pace = \"{}\" is no pace", b.pace), "", fmt::format("give {}", kPaceWords));
  b.wait_s = root.number("wait_s", {0.1, 3600.0, "s"}, b.wait_s);
  b.silence_s = root.number("silence_s", {0.1, 3600.0, "s"}, b.silence_s);
  b.airframe = root.choice("airframe", {"local", "elsewhere"}, "local") == "local";
  b.fly = root.choice("fly", {"local", "elsewhere"}, "local") == "local";
  const auto buses = root.table("bus");
  b.esc_bus = read_bus(buses, "esc");
  b.state_bus = read_bus(buses, "state");
  if (b.esc_bus == b.state_bus)
    buses.fail("state", fmt::format("\"{}\" is the bus of the ESCs too", b.state_bus), "one bus does not carry both at 1 kHz",
               "give each a bus of its own");
  read_escs(root, b);
  file.refuse_unknown_keys();
  return b;
}

}  // namespace rotorloop::hil
