// Promises of the virtual bus that a node programmer relies on: who wins, when a frame arrives, what is counted.
#include "sim/world/virtual_bus.hpp"

#include <gtest/gtest.h>

namespace rotorloop::sim {
namespace {

CanFrame standard(std::uint32_t id, std::uint8_t length = 8, std::uint8_t fill = 0x55) {
  CanFrame f{.id = id, .length = length};
  f.data.fill(fill);
  return f;
}

TEST(VirtualBus, LowerIdWinsArbitrationWhateverTheOrderOfSending) {
  VirtualBus bus({});
  CanBus& a = bus.attach({.name = "a"});
  CanBus& b = bus.attach({.name = "b"});
  CanBus& c = bus.attach({.name = "c"});
  bus.advance_to(1000);
  a.send(standard(0x200));
  b.send(standard(0x100));
  bus.advance_to(10'000'000);
  EXPECT_EQ(c.receive()->frame.id, 0x100u);
  EXPECT_EQ(c.receive()->frame.id, 0x200u);
  EXPECT_FALSE(c.receive().has_value());
}

}  // namespace
}  // namespace rotorloop::sim
