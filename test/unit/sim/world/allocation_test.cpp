// The bus costs no heap once it runs: counted by replacing the allocator of this test program.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>

#include "host/bus/candump_log.hpp"
#include "test/unit/sim/world/bus_fixture.hpp"

namespace {
std::size_t allocations = 0;
}

void* operator new(std::size_t bytes) {
  ++allocations;
  if (void* p = std::malloc(bytes)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace rotorloop::sim {
namespace {

TEST(VirtualBusAllocation, TenThousandFramesWithFaultsAndARecorderAllocateNothing) {
  VirtualBus bus({.faults = {{.kind = BusFaultKind::corrupt, .probability = 0.01},
                             {.kind = BusFaultKind::extra_traffic, .frame = test::standard(0x7F0, {0, 0}), .period_ns = 1'000'000}}});
  CanBus& a = bus.attach({.name = "a"});
  CanBus& b = bus.attach({.name = "b"});
  CandumpWriter recorder("/dev/null", "vcan0");
  bus.set_tap([&recorder](const BusEvent& e) { recorder.write(e.end_ns, e.frame); });
  bus.advance_to(0);
  std::size_t got = 0;
  const std::size_t before = allocations;
  for (std::int64_t ms = 1; ms <= 5'000; ++ms) {
    a.send(test::standard(0x100, {1, 2, 3}));
    b.send(test::extended(0x12345, {4, 5}));
    bus.advance_to(ms * kNs_per_ms);
    while (a.receive()) ++got;
    while (b.receive()) ++got;
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(got, 19'000u);
}

}  // namespace
}  // namespace rotorloop::sim
