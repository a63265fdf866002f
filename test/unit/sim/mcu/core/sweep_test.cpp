// What an interrupt, a snapshot or another thread must not change: swept over every instruction and every cycle of one program.
#include <gtest/gtest.h>

#include <thread>

#include "test/unit/sim/mcu/core/machine.hpp"

namespace rotorloop::mcu::testing {
namespace {

constexpr uint32_t kEnd = kProgram + 0x86;

// Three rounds of: MUL, UMULL, STM, an IT block of four, LDMDB, a call that pushes R and S registers, LDRD, UDIV, ADCS, VMUL, VADD, VCMP,
// VMRS, IT, VSTR, LDREX and STREX until it succeeds, SSAT, MRS, STR with write-back; then a branch to itself at kEnd.
void load_program(Machine& m) {
  m.program({0xF240, 0x1400, 0xF2C2, 0x0400, 0x2000, 0x2703, 0xEEB7, 0x0A08, 0xEEB6, 0x8A00, 0x3007, 0xFB00, 0xF107, 0xFBA1, 0x2300, 0xC40F,
             0xF010, 0x0F01, 0xBF0B, 0x300A, 0x3801, 0x0081, 0x4041, 0xE914, 0x0360, 0xB560, 0xF000, 0xF828, 0xE8BD, 0x4060, 0xEB18, 0x0809,
             0xEB59, 0x0905, 0xEE60, 0x0A08, 0xEE30, 0x0A20, 0xEEB4, 0x0A60, 0xEEF1, 0xFA10, 0xBFC8, 0x3001, 0xED84, 0x0A00, 0xE854, 0xAF00,
             0xF10A, 0x0A01, 0xE844, 0xAB00, 0xF1BB, 0x0F00, 0xD1F6, 0xF301, 0x0C04, 0xF3EF, 0x8B00, 0xF844, 0xBF04, 0x3F01, 0xD1CA, 0xF05F,
             0x0B00, 0xF3EF, 0x8C03, 0xE7FE, 0xED2D, 0x8A01, 0xE954, 0x5604, 0xFBB6, 0xF5F7, 0xECBD, 0x8A01, 0x4770});
  // Handlers that leave nothing as it was: R0 to R3, R12, S0, FPSCR, flags.
  for (const uint32_t n : {uint32_t{kSysTick}, uint32_t{kFirstInterrupt}})
    m.code(Machine::handler(n), {0x2055, 0x2100, 0x2200, 0x2300, 0x4684, 0xEE00, 0x0A10, 0xEEE1, 0x1A10, 0x2800, 0x4770});
  m.system(0xE000ED88, 0xF00000);
  m.enable_interrupt(0, 0x40);
}

// What a program can see at its end, but the stack below its pointer, the times and the claim of an exclusive load.
std::vector<uint32_t> seen(Machine& m) {
  std::vector<uint32_t> all(m.core.state.r.begin(), m.core.state.r.begin() + 16);
  all.insert(all.end(), m.core.state.s.begin(), m.core.state.s.end());
  for (const uint32_t v : {m.core.xpsr(), m.core.state.fpscr, m.core.state.control, m.core.state.other_sp}) all.push_back(v);
  for (uint32_t at = kRam; at < kStack - 0x400; at += 4) all.push_back(m.word(at));
  return all;
}

// The same with times and all of the memory.
std::vector<uint64_t> everything(Machine& m) {
  std::vector<uint64_t> all;
  for (const uint32_t v : seen(m)) all.push_back(v);
  const CoreState& s = m.core.state;
  for (const uint64_t v :
       {s.cycle, s.flash_waits, s.instructions, s.systick.zero_at_cycle, s.phase_end_cycle, uint64_t{s.exclusive}, uint64_t{s.ipsr}})
    all.push_back(v);
  for (uint32_t at = kStack - 0x400; at < kStack; at += 4) all.push_back(m.word(at));
  return all;
}

struct Snapshot {
  CoreState state;
  std::vector<uint8_t> ram;
};
Snapshot taken(const Machine& m) { return {m.core.state, m.ram}; }
void put_back(Machine& m, const Snapshot& s) {
  m.core.state = s.state;
  std::copy(s.ram.begin(), s.ram.end(), m.ram.begin());
  m.core.restored();
}

TEST(McuSweep, AnInterruptAtAnyInstructionLeavesTheProgramsStateAsWithoutIt) {
  Machine m;
  load_program(m);
  const Snapshot begin = taken(m);
  ASSERT_TRUE(m.run_to(kEnd));
  const std::vector<uint32_t> undisturbed = seen(m);
  const uint64_t instructions = m.core.state.instructions - begin.state.instructions;
  ASSERT_EQ(instructions, 122u);
  for (uint64_t at = 0; at < instructions; ++at) {
    put_back(m, begin);
    m.instructions(at);
    m.core.pulse_interrupt(0);
    ASSERT_TRUE(m.run_to(kEnd)) << at;
    EXPECT_GE(m.core.state.instructions - begin.state.instructions, instructions + 9) << "the handler of 9 instructions ran, at " << at;
    EXPECT_EQ(seen(m), undisturbed) << "interrupted at instruction " << at;
  }
}

TEST(McuSweep, SoDoInterruptsAtEveryRateOfSysTick) {
  Machine m;
  load_program(m);
  const Snapshot begin = taken(m);
  ASSERT_TRUE(m.run_to(kEnd));
  const std::vector<uint32_t> undisturbed = seen(m);
  // Shorter periods can meet every try of the exclusive store: then the program waits for ever, as it would on the chip.
  for (uint32_t period = 100; period < 260; ++period) {
    put_back(m, begin);
    m.system(0xE000E014, period);
    m.system(0xE000E018, 0);
    m.system(0xE000E010, 7);
    ASSERT_TRUE(m.run_to(kEnd)) << period;
    EXPECT_EQ(seen(m), undisturbed) << "SysTick every " << period + 1 << " cycles";
  }
}

std::vector<uint64_t> run_with_systick(uint64_t cycles) {
  Machine m;
  load_program(m);
  m.system(0xE000E014, 73);
  m.system(0xE000E010, 7);
  m.core.run_until(cycles);
  return everything(m);
}

TEST(McuSweep, FiveRunsAndTwoThreadsAtOnceGiveTheSameStateTimesAndMemory) {
  const std::vector<uint64_t> first = run_with_systick(900);
  for (int n = 0; n < 4; ++n) EXPECT_EQ(run_with_systick(900), first);
  std::vector<uint64_t> here, there;
  std::thread other([&] { there = run_with_systick(900); });
  here = run_with_systick(900);
  other.join();
  EXPECT_EQ(here, first);
  EXPECT_EQ(there, first);
}

TEST(McuSweep, ASnapshotAtAnyCycleGoesOnTheSameHereAndInAnotherCore) {
  constexpr uint64_t kCycles = 900;
  const std::vector<uint64_t> whole = run_with_systick(kCycles);
  Machine m, other;
  load_program(m);
  load_program(other);
  m.system(0xE000E014, 73);
  m.system(0xE000E010, 7);
  for (uint64_t at = 1; at < kCycles; ++at) {
    m.core.run_until(at);
    const Snapshot here = taken(m);
    put_back(other, here);
    other.core.run_until(kCycles);
    ASSERT_EQ(everything(other), whole) << "snapshot at cycle " << at;
  }
  m.core.run_until(kCycles);
  EXPECT_EQ(everything(m), whole) << "taking them changes nothing";
}

}  // namespace
}  // namespace rotorloop::mcu::testing
