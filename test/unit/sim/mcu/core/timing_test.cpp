// Cycles: the tables of the Cortex-M4 manual (DDI 0439, 3-1 and 7-1) and the model of the flash. None of it is checked on silicon.
#include <gtest/gtest.h>

#include "test/unit/sim/mcu/core/machine.hpp"

namespace rotorloop::mcu::testing {
namespace {

// Cycles of the first instruction of a program with zero wait states.
uint64_t cycles_of(std::initializer_list<uint32_t> code, uint32_t r0 = kRam, uint32_t r1 = 1) {
  Machine m;
  m.system(0xE000ED88, 0xF00000);
  m.core.state.r[0] = r0;
  m.core.state.r[1] = r1;
  m.program(code);
  const uint64_t before = m.core.cycle();
  m.instructions(1);
  return m.core.cycle() - before;
}

TEST(McuTiming, InstructionsCostWhatTheManualsTablesSay) {
  EXPECT_EQ(cycles_of({0x1840}), 1u);           // ADDS r0, r0, r1
  EXPECT_EQ(cycles_of({0x6802}), 2u);           // LDR r2, [r0]
  EXPECT_EQ(cycles_of({0x6002}), 1u);           // STR r2, [r0]
  EXPECT_EQ(cycles_of({0xE9D0, 0x2300}), 3u);   // LDRD
  EXPECT_EQ(cycles_of({0xC80E}), 4u);           // LDM r0!, {r1-r3}
  EXPECT_EQ(cycles_of({0xE000}), 3u);           // B
  EXPECT_EQ(cycles_of({0xF000, 0xF800}), 3u);   // BL
  EXPECT_EQ(cycles_of({0xD0FE}), 1u);           // BEQ, not taken: Z is clear after reset
  EXPECT_EQ(cycles_of({0xD1FE}), 3u);           // BNE, taken
  EXPECT_EQ(cycles_of({0xFB00, 0x2201}), 2u);   // MLA
  EXPECT_EQ(cycles_of({0xFB80, 0x2301}), 1u);   // SMULL
  EXPECT_EQ(cycles_of({0xEE30, 0x0A81}), 1u);   // VADD.F32
  EXPECT_EQ(cycles_of({0xEE80, 0x0A81}), 14u);  // VDIV.F32
  EXPECT_EQ(cycles_of({0xEEB1, 0x0AC1}), 14u);  // VSQRT.F32
  EXPECT_EQ(cycles_of({0xEE00, 0x0A81}), 3u);   // VMLA.F32
}

TEST(McuTiming, DivisionTakesTwoToTwelveCyclesByTheBitsOfTheQuotient) {
  EXPECT_EQ(cycles_of({0xFBB0, 0xF2F1}, 1, 2), 2u);
  EXPECT_EQ(cycles_of({0xFBB0, 0xF2F1}, 0xFFFFFFFF, 1), 12u);
  EXPECT_EQ(cycles_of({0xFBB0, 0xF2F1}, 1000, 10), 5u);
}

// 64 NOPs from an address, then a branch back to them.
void loop(Machine& m, uint32_t address, uint32_t nops) {
  for (uint32_t i = 0; i < nops; ++i) m.code(address + 2 * i, {kNop});
  m.code(address + 2 * nops, {0xE000u | ((0u - nops - 2u) & 0x7FF)});
  m.core.set_pc(address);
}

TEST(McuTiming, StraightCodeFromFlashWaitsForEach64BitsAndALoopInTheCacheInTheEndForNothing) {
  Machine m;
  loop(m, kProgram, 64);
  m.instructions(65);
  const uint64_t first = m.core.state.flash_waits;
  EXPECT_GE(first, 16u);       // 17 words of four instructions, at best one cycle beyond the four that execute
  EXPECT_LE(first, 17u * 4u);  // at worst four for each
  m.instructions(65);
  EXPECT_LT(m.core.state.flash_waits - first, 17u * 4u);
  m.instructions(65 * 20);  // only what missed is kept, so that each turn adds a word (RM0440)
  const uint64_t warm = m.core.state.flash_waits;
  m.instructions(65 * 10);
  EXPECT_EQ(m.core.state.flash_waits, warm);
}

TEST(McuTiming, LoopLongerThanTheInstructionCacheOfOneKilobyteWaitsInEveryTurn) {
  Machine m;
  loop(m, kProgram, 1000);
  m.instructions(1001 * 4);
  const uint64_t before = m.core.state.flash_waits;
  m.instructions(1001);
  EXPECT_GT(m.core.state.flash_waits - before, 100u);
}

TEST(McuTiming, CodeInSramNeverWaits) {
  Machine m;
  loop(m, kRam, 64);
  m.instructions(1000);
  EXPECT_EQ(m.core.state.flash_waits, 0u);
}

TEST(McuTiming, TheTwoFiguresDifferByTheWaitsAndTheChosenOneIsTime) {
  uint64_t cycles[2] = {0, 0}, waits[2] = {0, 0};
  for (const bool flash : {false, true}) {
    Machine m;
    loop(m, kProgram, 300);
    m.core.set_clocking(flash ? Clocking::flash : Clocking::zero_wait);
    m.instructions(602);
    cycles[flash] = m.core.cycle();
    waits[flash] = m.core.state.flash_waits;
  }
  EXPECT_EQ(waits[0], waits[1]);
  EXPECT_GT(waits[0], 0u);
  EXPECT_EQ(cycles[1] - waits[1], cycles[0]);
}

TEST(McuTiming, CycleCounterCountsCyclesWhileTraceIsEnabled) {
  Machine m;
  for (uint32_t i = 0; i < 64; ++i) m.code(kProgram + 2 * i, {kNop});
  m.system(0xE000EDFC, 1u << 24);
  m.system(0xE0001004, 0);
  m.system(0xE0001000, 1);
  m.instructions(20);
  EXPECT_EQ(m.system(0xE0001004), 20u);
  m.system(0xE0001000, 0);
  m.instructions(20);
  EXPECT_EQ(m.system(0xE0001004), 20u);
}

TEST(McuTiming, RunEndsAtTheCycleAskedForAndAPeripheralCanAskForAnEarlierOne) {
  Machine m;
  for (uint32_t i = 0; i < 64; ++i) m.code(kProgram + 2 * i, {kNop});
  m.core.run_until(10);
  EXPECT_EQ(m.core.cycle(), 10u);
  EXPECT_EQ(m.core.state.instructions, 10u);
}

}  // namespace
}  // namespace rotorloop::mcu::testing
