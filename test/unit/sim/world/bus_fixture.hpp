// Frames and a bus with a few ports, for the tests of this folder.
#pragma once
#include <initializer_list>
#include <string>
#include <vector>

#include "sim/world/virtual_bus.hpp"

namespace rotorloop::sim::test {

inline CanFrame standard(std::uint32_t id, std::initializer_list<int> data = {}) {
  CanFrame f{.id = id, .extended = false, .length = static_cast<std::uint8_t>(data.size())};
  std::size_t i = 0;
  for (const int byte : data) f.data[i++] = static_cast<std::uint8_t>(byte);
  return f;
}

inline CanFrame extended(std::uint32_t id, std::initializer_list<int> data = {}) {
  CanFrame f = standard(id, data);
  f.extended = true;
  return f;
}

struct Bus {
  explicit Bus(BusConfig config = {}, std::size_t ports = 3) : bus(std::move(config)) {
    for (std::size_t i = 0; i < ports; ++i) port.push_back(&bus.attach({.name = "node " + std::to_string(i)}));
    bus.set_tap([this](const BusEvent& e) { trace.push_back(e); });
  }
  std::vector<StampedFrame> received(std::size_t at) {
    std::vector<StampedFrame> frames;
    while (const auto f = port[at]->receive()) frames.push_back(*f);
    return frames;
  }
  VirtualBus bus;
  std::vector<CanBus*> port;
  std::vector<BusEvent> trace;
};

inline constexpr std::int64_t kBit_ns = 1'000;  // at 1 Mbit/s

}  // namespace rotorloop::sim::test
