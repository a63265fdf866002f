// Runs an image from flash and prints what it writes to its register for text. Exit code: what it writes to the register that ends it.
// With a second argument, the addresses of the instructions that were executed go into that file.
#include <cstdio>
#include <set>
#include <vector>

#include "sim/mcu/core/core.hpp"

namespace {

using namespace rotorloop::mcu;

class TextAndEnd : public Bus {
 public:
  bool read(uint32_t, uint32_t, uint32_t&) override { return false; }
  bool write(uint32_t address, uint32_t, uint32_t value) override {
    if (address == 0x40000000) std::putchar(static_cast<int>(value));
    if (address == 0x40000004) {
      ended = true;
      result = static_cast<int>(value);
      core->stop_at(core->cycle());
    }
    return address == 0x40000000 || address == 0x40000004;
  }
  Core* core = nullptr;
  bool ended = false;
  int result = 0;
};

// Instruction by instruction, with the address of each.
Stopped trace(Core& core, const TextAndEnd& bus, uint64_t cycles, const char* path) {
  std::set<uint32_t> executed;
  Stopped stopped = Stopped::at_cycle;
  while (core.cycle() < cycles && stopped == Stopped::at_cycle && !bus.ended) {
    const uint64_t before = core.state.instructions;
    const uint32_t pc = core.state.r[kPc];
    stopped = core.run_until(core.cycle() + 1);
    if (core.state.instructions != before) executed.insert(pc);
  }
  std::FILE* file = std::fopen(path, "w");
  if (file == nullptr) return stopped;
  for (const uint32_t pc : executed) std::fprintf(file, "%x\n", pc);
  std::fclose(file);
  return stopped;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2 && count != 3) return 2;
  std::vector<uint8_t> flash(0x20000), ram(0x5800);
  std::FILE* file = std::fopen(arguments[1], "rb");
  if (file == nullptr) return 2;
  const size_t bytes = std::fread(flash.data(), 1, flash.size(), file);
  std::fclose(file);
  MemoryMap memories;
  TextAndEnd bus;
  memories.add({flash.data(), 0x08000000, static_cast<uint32_t>(flash.size()), false, true, false});
  memories.add({ram.data(), 0x20000000, static_cast<uint32_t>(ram.size()), true, false, false});
  Core core(memories, bus);
  bus.core = &core;
  core.reset(0x08000000);
  const Stopped stopped = count == 3 ? trace(core, bus, 10000000, arguments[2]) : core.run_until(10000000);
  std::printf("%zu bytes, %llu instructions, %llu cycles with zero wait states, %llu waits of the flash\n", bytes,
              static_cast<unsigned long long>(core.state.instructions), static_cast<unsigned long long>(core.cycle()),
              static_cast<unsigned long long>(core.state.flash_waits));
  if (bus.ended) return bus.result == 0 ? 0 : 1;
  std::printf("not ended: %s at %#x, CFSR %#x\n", stopped == Stopped::locked_up ? "locked up" : "still running", core.state.r[kPc],
              core.state.scb.cfsr);
  return 1;
}
