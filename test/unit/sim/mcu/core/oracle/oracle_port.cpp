// Executes short programs on the core for a comparison: states come in on stdin and go out on stdout, as oracle_test.py has them.
#include <array>
#include <cstdio>
#include <cstring>
#include <vector>

#include "sim/mcu/core/core.hpp"

namespace {

using namespace rotorloop::mcu;

constexpr uint32_t kCode = 0x08000000, kCodeBytes = 0x200000, kData = 0x20000000, kDataBytes = 0x10000, kWindow = kData + 0x8000;

struct Registers {
  uint32_t r[15], xpsr, fpscr, s[32];
  uint8_t window[1024];
};
struct Request {
  uint32_t address, bytes;
  uint8_t code[64];
  Registers before;
};
struct Reply {
  uint32_t cfsr, pc;
  Registers after;
};

class NothingElse : public Bus {
  bool read(uint32_t, uint32_t, uint32_t&) override { return false; }
  bool write(uint32_t, uint32_t, uint32_t) override { return false; }
};

void take(Core& core, const Registers& from) {
  for (uint32_t i = 0; i < 15; ++i) core.state.r[i] = from.r[i];
  core.set_xpsr(from.xpsr | 1u << 24);
  core.state.fpscr = from.fpscr;
  std::copy(std::begin(from.s), std::end(from.s), core.state.s.begin());
}

void give(const Core& core, Registers& to) {
  for (uint32_t i = 0; i < 15; ++i) to.r[i] = core.state.r[i];
  to.xpsr = core.xpsr();
  to.fpscr = core.state.fpscr;
  std::copy(core.state.s.begin(), core.state.s.end(), std::begin(to.s));
}

void execute(Core& core, const Request& request, Reply& reply) {
  const uint32_t end = request.address + request.bytes;
  core.code_changed(request.address, request.bytes);
  core.state.control |= 4;
  core.state.scb.cfsr = 0;
  core.restored();
  take(core, request.before);
  core.set_pc(request.address);
  for (int i = 0; i < 40 && core.state.r[kPc] != end && core.state.scb.cfsr == 0; ++i) core.run_until(core.cycle() + 1);
  reply.cfsr = core.state.scb.cfsr;
  reply.pc = core.state.r[kPc];
  give(core, reply.after);
}

}  // namespace

int main() {
  std::vector<uint8_t> code(kCodeBytes), data(kDataBytes);
  MemoryMap memories;
  NothingElse bus;
  memories.add({code.data(), kCode, kCodeBytes, false, false, false});
  memories.add({data.data(), kData, kDataBytes, true, false, false});
  Core core(memories, bus);
  core.reset(kCode);
  core.write_system(0xE000ED88, 4, 0xF00000);
  const CoreState fresh = core.state;
  Request request;
  Reply reply;
  while (std::fread(&request, sizeof request, 1, stdin) == 1) {
    std::memcpy(code.data() + (request.address - kCode), request.code, sizeof request.code);
    std::memcpy(data.data() + (kWindow - kData), request.before.window, sizeof request.before.window);
    core.state = fresh;
    execute(core, request, reply);
    std::memcpy(reply.after.window, data.data() + (kWindow - kData), sizeof reply.after.window);
    std::fwrite(&reply, sizeof reply, 1, stdout);
    std::fflush(stdout);
  }
  return 0;
}
