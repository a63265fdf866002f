// How many instructions a second the emulated core executes, by CPU time: an integer loop with a store, and a chain of floating point.
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <initializer_list>
#include <vector>

#include "sim/mcu/core/core.hpp"

namespace {

using namespace rotorloop::mcu;

class Nothing : public Bus {
  bool read(uint32_t, uint32_t, uint32_t&) override { return false; }
  bool write(uint32_t, uint32_t, uint32_t) override { return false; }
};

double million_per_s(std::initializer_list<uint16_t> loop, uint32_t wait_states) {
  std::vector<uint8_t> flash(0x1000), ram(0x1000);
  const uint32_t vectors[2] = {0x20001000, 0x08000101};
  std::memcpy(flash.data(), vectors, sizeof vectors);
  std::memcpy(flash.data() + 0x100, loop.begin(), loop.size() * 2);
  MemoryMap memories;
  Nothing bus;
  memories.add({flash.data(), 0x08000000, 0x1000, false, true, false});
  memories.add({ram.data(), 0x20000000, 0x1000, true, false, false});
  Core core(memories, bus);
  core.reset(0x08000000);
  core.set_clocking(Clocking::zero_wait, wait_states);
  core.write_system(0xE000ED88, 4, 0xF00000);
  core.state.r[3] = 0x20000100;
  double best = 0.0;
  for (int i = 0; i < 5; ++i) {
    const uint64_t before = core.state.instructions;
    const std::clock_t start = std::clock();
    core.run_until(core.cycle() + 30000000);
    const double s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    const double rate = static_cast<double>(core.state.instructions - before) / s * 1e-6;
    best = rate > best ? rate : best;
  }
  return best;
}

}  // namespace

int main() {
  for (const uint32_t wait_states : {0u, 4u}) {
    // ADDS r0, #1; EOR r2, r2, r0; STR r2, [r3]; CMP r0, r1; B back
    const double integer = million_per_s({0x3001, 0xEA82, 0x0200, 0x601A, 0x4288, 0xE7F9}, wait_states);
    // VMUL s0, s1, s2; VADD s3, s3, s0; VSUB s1, s3, s2; VLDR s2, [r3]; B back
    const double floating = million_per_s({0xEE20, 0x0A81, 0xEE71, 0x1A80, 0xEE71, 0x0AC1, 0xED93, 0x1A00, 0xE7F6}, wait_states);
    std::printf("flash model %s: integer loop %.0f, floating point %.0f million instructions a second\n", wait_states != 0 ? "on" : "off",
                integer, floating);
  }
  return 0;
}
