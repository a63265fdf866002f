#include "bench/hil/processes/bench_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "bench/hil/flight/scenario.hpp"
#include "host/base/toml_file.hpp"
#include "host/bus/bus_name.hpp"

namespace rotorloop::hil {
namespace {

constexpr const char* kOneBusTooFew = "one bus does not carry both at 1 kHz";

std::string read_bus(const TomlTable& buses, const char* key, const std::string& fallback = "") {
  std::string name = fallback.empty() ? buses.text(key) : buses.text(key, fallback);
  if (parse_bus_name(name, buses.where(key)).backend == BusBackend::virtual_bus)
    buses.fail(key, fmt::format("\"{}\" is a virtual bus, which ends at one process", name), "",
               "use mcast:0, socketcan:can0 or another bus that others can join");
  return name;
}

// Of all, and where an adapter has one user only or a program another adapter: of one process.
void read_buses(const TomlTable& root, BenchFile& b) {
  const TomlTable all = root.table("bus");
  const BenchFile::Buses common{.esc = read_bus(all, "esc"), .state = read_bus(all, "state")};
  const auto check = [](const TomlTable& at, const BenchFile::Buses& buses) {
    if (buses.esc == buses.state)
      at.fail("state", fmt::format("\"{}\" is the bus of the ESCs too", buses.state), kOneBusTooFew, "give each a bus of its own");
  };
  check(all, common);
  b.airframe_buses = b.fly_buses = common;
  for (const auto& [key, buses] : {std::pair{"airframe", &b.airframe_buses}, std::pair{"fly", &b.fly_buses}}) {
    const auto own = all.optional_table(key);
    if (!own) continue;
    *buses = {.esc = read_bus(*own, "esc", common.esc), .state = read_bus(*own, "state", common.state)};
    check(*own, *buses);
  }
  b.esc_buses.fill(common.esc);
}

void read_escs(const TomlTable& root, BenchFile& b) {
  const auto escs = root.tables("esc", 4, 4);
  for (std::size_t i = 0; i < escs.size(); ++i) {
    b.esc_nodes[i] = static_cast<std::uint8_t>(escs[i].integer("node_id", 1, 125));
    b.esc_simulated[i] = escs[i].boolean("simulated");
    b.esc_buses[i] = read_bus(escs[i], "bus", b.esc_buses[i]);
    if (b.esc_buses[i] == b.airframe_buses.state || b.esc_buses[i] == b.fly_buses.state)
      escs[i].fail("bus", fmt::format("\"{}\" is the state bus", b.esc_buses[i]), kOneBusTooFew, "give the bus of the ESCs");
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
  read_buses(root, b);
  read_escs(root, b);
  file.refuse_unknown_keys();
  return b;
}

}  // namespace rotorloop::hil
