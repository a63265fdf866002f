// A tool and a node on a simulated bus of 1 Mbit/s, in virtual time: waiting of the tool moves both on.
#pragma once
#include <cstdint>
#include <functional>
#include <string>

#include "host/tools/tool_node.hpp"
#include "sim/world/lockstep_bus.hpp"

namespace rotorloop::tools {

inline constexpr std::int64_t kMs_ns = 1'000'000, kSecond_ns = 1'000'000'000, kTick_ns = 250'000;

// Node 126 and node 21, which is made of the same transport but has no code of the tools under test.
class Pair {
 public:
  explicit Pair(const std::string& node_name = "org.example.esc")
      : tool_port_(bus_, bus_.attach({.name = "tool", .tx_depth = 1024, .rx_depth = 1024}), kTick_ns,
                   [this](std::int64_t now_ns) { tick(now_ns); }),
        node_port_(bus_, bus_.attach({.name = "node", .tx_depth = 1024, .rx_depth = 1024}), kTick_ns, [](std::int64_t) {}),
        tool(tool_port_),
        node(node_port_, {.node_id = 21, .name = node_name, .unique_id = {1, 2, 3}}) {}

 private:
  void tick(std::int64_t) {
    node.poll();
    if (on_tick) on_tick();
  }
  sim::VirtualBus bus_{sim::BusConfig{}};
  sim::LockstepBus tool_port_, node_port_;

 public:
  ToolNode tool, node;
  std::function<void()> on_tick;
};

}  // namespace rotorloop::tools
