// Serves an ELF on a core with plain memories to a debugger; prints the port that it got.
#include <cstdio>
#include <vector>

#include "sim/mcu/elf/program.hpp"
#include "sim/mcu/gdb/core_target.hpp"
#include "sim/mcu/gdb/server.hpp"

namespace {

class NothingElse : public rotorloop::mcu::Bus {
  bool read(uint32_t, uint32_t, uint32_t&) override { return false; }
  bool write(uint32_t, uint32_t, uint32_t) override { return false; }
};

}  // namespace

int main(int count, char** arguments) {
  using namespace rotorloop::mcu;
  if (count != 2) return 2;
  std::vector<uint8_t> flash(0x20000, 0xFF), ram(0x8000);
  for (const ElfSection& s : read_elf(arguments[1]).sections)
    if (!s.bytes.empty() && s.load_address - 0x08000000 < flash.size())
      std::copy(s.bytes.begin(), s.bytes.end(), &flash[s.load_address - 0x08000000]);
  MemoryMap memories;
  NothingElse bus;
  memories.add({flash.data(), 0x08000000, static_cast<uint32_t>(flash.size()), false, true, false});
  memories.add({ram.data(), 0x20000000, static_cast<uint32_t>(ram.size()), true, false, false});
  Core core(memories, bus);
  core.reset(0x08000000);
  gdb::CoreTarget target(core, memories, 0x08000000);
  gdb::Server server(0);
  std::printf("%u\n", server.port());
  std::fflush(stdout);
  server.serve(target, [] { return false; });
  return 0;
}
