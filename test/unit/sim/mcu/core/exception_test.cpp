// Exceptions as the ARMv7-M manual (DDI 0403, B1.5) and the Cortex-M4 manual (DDI 0439) have them: frames, order, cycles.
#include <gtest/gtest.h>

#include "test/unit/sim/mcu/core/machine.hpp"

namespace rotorloop::mcu::testing {
namespace {

constexpr uint32_t kBxLr = 0x4770;

// A program of NOPs that runs, interrupted at its fourth.
struct Interrupted : Machine {
  Interrupted() {
    for (uint32_t i = 0; i < 64; ++i) code(kProgram + 2 * i, {kNop});
    for (const uint32_t n : {2u, 3u, 5u}) enable_interrupt(n, 0x80);
  }
};

TEST(McuException, EntryPushesEightWordsAlignsTheStackToEightBytesAndTakesTwelveCycles) {
  Interrupted m;
  m.core.state.r[kSp] = kStack - 4;
  for (uint32_t i = 0; i < 4; ++i) m.core.state.r[i] = 0x100 + i;
  m.core.state.r[12] = 0x112;
  m.core.state.r[kLr] = 0x114;
  m.core.set_xpsr(0xA1000000);  // N and C
  m.instructions(3);
  const uint64_t before = m.core.cycle();
  m.core.pulse_interrupt(5);
  ASSERT_TRUE(m.run_to(Machine::handler(21)));
  EXPECT_EQ(m.core.cycle() - before, 12u);
  const uint32_t frame = m.core.state.r[kSp];
  EXPECT_EQ(frame, kStack - 8 - 32);
  const uint32_t words[8] = {0x100, 0x101, 0x102, 0x103, 0x112, 0x114, kProgram + 6, 0xA1000200};
  for (uint32_t i = 0; i < 8; ++i) EXPECT_EQ(m.word(frame + 4 * i), words[i]) << i;
  EXPECT_EQ(m.core.state.r[kLr], 0xFFFFFFF9);
  EXPECT_EQ(m.core.state.ipsr, 21u);
  ASSERT_TRUE(m.run_to(kProgram + 6));
  EXPECT_EQ(m.core.state.r[kSp], kStack - 4);
  EXPECT_EQ(m.core.xpsr(), 0xA1000000);
  EXPECT_EQ(m.core.state.r[kLr], 0x114u);
}

TEST(McuException, NextHandlerFollowsAfterSixCyclesWithoutAnotherFrame) {
  Interrupted m;
  m.core.pulse_interrupt(2);
  m.core.pulse_interrupt(3);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  const uint32_t sp = m.core.state.r[kSp];
  m.instructions(1);  // BX LR
  const uint64_t returned = m.core.cycle();
  ASSERT_TRUE(m.run_to(Machine::handler(19)));
  EXPECT_EQ(m.core.cycle() - returned, 6u);
  EXPECT_EQ(m.core.state.r[kSp], sp);
  EXPECT_EQ(m.core.state.r[kLr], 0xFFFFFFF9);
}

TEST(McuException, MoreUrgentOneThatArrivesWhileTheFrameIsPushedIsTakenFirst) {
  Interrupted m;
  m.enable_interrupt(2, 0x40);
  m.core.pulse_interrupt(3);
  const uint64_t before = m.core.cycle();
  m.core.run_until(before + 8);
  ASSERT_EQ(m.core.state.phase, Phase::stacking);
  m.core.pulse_interrupt(2);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  EXPECT_EQ(m.core.cycle() - before, 12u);
  EXPECT_EQ(m.core.state.r[kSp], kStack - 32);
  ASSERT_TRUE(m.run_to(Machine::handler(19)));
  EXPECT_EQ(m.core.state.r[kSp], kStack - 32);
}

TEST(McuException, OneThatArrivesWhileTheFrameIsPoppedIsChainedToIt) {
  Interrupted m;
  m.core.pulse_interrupt(3);
  ASSERT_TRUE(m.run_to(Machine::handler(19)));
  m.instructions(1);
  m.core.run_until(m.core.cycle() + 3);
  ASSERT_EQ(m.core.state.phase, Phase::unstacking);
  m.core.pulse_interrupt(2);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  EXPECT_EQ(m.core.state.r[kSp], kStack - 32);
}

TEST(McuException, MoreUrgentGroupPreemptsAHandlerAndSubpriorityOnlyOrders) {
  Interrupted m;
  m.system(0xE000ED0C, 0x05FA0600);  // PRIGROUP 6: one bit of group, three of subpriority
  m.enable_interrupt(2, 0x90);
  m.enable_interrupt(3, 0xA0);
  m.enable_interrupt(5, 0x70);
  m.code(Machine::handler(19), {kNop, kNop, kBxLr});
  m.core.pulse_interrupt(3);
  ASSERT_TRUE(m.run_to(Machine::handler(19)));
  m.core.pulse_interrupt(2);  // same group
  m.instructions(1);
  EXPECT_EQ(m.core.state.ipsr, 19u);
  m.core.pulse_interrupt(5);
  ASSERT_TRUE(m.run_to(Machine::handler(21)));
  EXPECT_EQ(m.core.state.r[kLr], 0xFFFFFFF1);
  EXPECT_EQ(m.core.state.r[kSp], kStack - 64);
  ASSERT_TRUE(m.run_to(Machine::handler(19) + 4));
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
}

TEST(McuException, OfTwoPendingTheMoreUrgentAndThenTheLowerNumberComesFirst) {
  Interrupted m;
  m.enable_interrupt(5, 0x20);
  for (const uint32_t n : {3u, 2u, 5u}) m.core.pulse_interrupt(n);
  ASSERT_TRUE(m.run_to(Machine::handler(21)));
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  ASSERT_TRUE(m.run_to(Machine::handler(19)));
}

TEST(McuException, LineHeldHighIsTakenAgainAfterTheHandlerAndNotWhileItRuns) {
  Interrupted m;
  m.code(Machine::handler(18), {kNop, kNop, kBxLr});
  m.core.set_interrupt_line(2, true);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  EXPECT_FALSE(m.core.state.nvic.pending.has(18));
  m.instructions(3);
  EXPECT_TRUE(m.core.state.nvic.pending.has(18));
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  m.core.set_interrupt_line(2, false);
  m.instructions(3);
  EXPECT_FALSE(m.core.state.nvic.pending.has(18));
}

TEST(McuException, PulseWhileTheHandlerRunsIsLatchedOnce) {
  Interrupted m;
  m.core.pulse_interrupt(2);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  m.core.pulse_interrupt(2);
  m.core.pulse_interrupt(2);
  m.instructions(1);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  m.instructions(1);
  EXPECT_FALSE(m.run_to(Machine::handler(18)));
}

TEST(McuException, BasepriHoldsBackItsPriorityAndWhatIsLessUrgent) {
  Interrupted m;
  m.enable_interrupt(2, 0x40);
  m.core.state.basepri = 0x80;
  m.core.pulse_interrupt(3);
  m.instructions(4);
  EXPECT_EQ(m.core.state.ipsr, 0u);
  m.core.pulse_interrupt(2);
  EXPECT_TRUE(m.run_to(Machine::handler(18)));
}

TEST(McuException, PrimaskHoldsAllBackButNmi) {
  Interrupted m;
  m.program({0xB672, kNop, kNop, kNop});  // CPSID i
  m.instructions(1);
  m.core.pulse_interrupt(2);
  m.instructions(2);
  EXPECT_EQ(m.core.state.ipsr, 0u);
  m.core.raise_nmi();
  EXPECT_TRUE(m.run_to(Machine::handler(kNmi)));
}

TEST(McuException, FaultmaskEndsWithTheReturnFromAnyHandlerButNmi) {
  Interrupted m;
  m.code(Machine::handler(18), {0xB671, kNop, kBxLr});  // CPSID f
  m.core.pulse_interrupt(2);
  ASSERT_TRUE(m.run_to(Machine::handler(18) + 2));
  EXPECT_EQ(m.core.execution_priority(), -1);
  ASSERT_TRUE(m.run_to(kProgram));
  EXPECT_EQ(m.core.state.faultmask, 0u);
}

TEST(McuException, WaitForInterruptWakesWithPrimaskSetAndDoesNotTakeIt) {
  Interrupted m;
  m.program({0xB672, 0xBF30, kNop, 0xB662, kNop});  // CPSID i, WFI, NOP, CPSIE i
  m.instructions(2);
  m.core.run_until(m.core.cycle() + 500);
  EXPECT_TRUE(m.core.state.sleeping);
  EXPECT_EQ(m.core.state.instructions, 2u);
  m.core.pulse_interrupt(2);
  m.instructions(1);
  EXPECT_EQ(m.core.state.r[kPc], kProgram + 6);
  m.instructions(1);
  EXPECT_TRUE(m.run_to(Machine::handler(18)));
  EXPECT_EQ(m.word(m.core.state.r[kSp] + 24), kProgram + 8);
}

TEST(McuException, WaitForEventPassesOnceAfterSendEventAndSleepsThen) {
  Machine m;
  m.program({0xBF40, 0xBF20, 0xBF20, kNop});  // SEV, WFE, WFE
  m.instructions(3);
  m.core.run_until(m.core.cycle() + 100);
  EXPECT_TRUE(m.core.state.sleeping);
  EXPECT_EQ(m.core.state.r[kPc], kProgram + 6);
}

TEST(McuException, SysTickIsPendingWhenItReachesZeroEveryReloadPlusOneCycles) {
  Interrupted m;
  m.program({0xE7FE});  // B to itself
  m.system(0xE000E014, 99);
  m.system(0xE000E018, 0);
  m.system(0xE000E010, 7);
  const uint64_t start = m.core.cycle();
  for (uint64_t i = 1; i <= 5; ++i) {
    ASSERT_TRUE(m.run_to(Machine::handler(kSysTick)));
    EXPECT_GE(m.core.cycle(), start + 100 * i + 12);
    EXPECT_LE(m.core.cycle(), start + 100 * i + 12 + 3);  // at most the branch that was under way
    m.instructions(1);
  }
  EXPECT_NE(m.system(0xE000E010) & 1u << 16, 0u);  // COUNTFLAG, cleared by the read
  EXPECT_EQ(m.system(0xE000E010) & 1u << 16, 0u);
}

TEST(McuException, ItBlockIsContinuedWithItsConditionAfterAnInterruptInside) {
  Interrupted m;
  m.program(
      {0x2800, 0xBF08, 0x2101, kNop, 0xBF0C, 0x2202, 0x2303, kNop});  // CMP r0,#0; IT EQ: MOV r1,#1; ITE EQ: MOV r2,#2; else MOV r3,#3
  m.core.state.r[1] = m.core.state.r[2] = m.core.state.r[3] = 0;
  m.instructions(5);
  m.core.pulse_interrupt(2);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  m.core.state.z = 1;  // the handler's flags and IT state are its own
  EXPECT_EQ(m.core.state.it, 0u);
  ASSERT_TRUE(m.run_to(kProgram + 14));
  EXPECT_EQ(m.core.state.r[1], 1u);
  EXPECT_EQ(m.core.state.r[2], 2u);
  EXPECT_EQ(m.core.state.r[3], 0u);
}

TEST(McuException, ThreadOnTheProcessStackReturnsByFFFFFFFDAndItsHandlerUsesTheMainStack) {
  Interrupted m;
  m.program({0xF380, 0x8809, 0x2102, 0xF381, 0x8814, kNop, kNop});  // MSR PSP,r0; MOVS r1,#2; MSR CONTROL,r1
  m.core.state.r[0] = kProcessStack;
  m.instructions(3);
  EXPECT_EQ(m.core.state.r[kSp], kProcessStack);
  m.core.pulse_interrupt(2);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  EXPECT_EQ(m.core.state.r[kLr], 0xFFFFFFFD);
  EXPECT_EQ(m.core.state.r[kSp], kStack);
  EXPECT_EQ(m.core.process_sp(), kProcessStack - 32);
  ASSERT_TRUE(m.run_to(kProgram + 10));
  EXPECT_EQ(m.core.state.r[kSp], kProcessStack);
}

struct FloatingPoint : Interrupted {
  FloatingPoint() {
    system(0xE000ED88, 0xF00000);
    program({0xEE30, 0x0A81, kNop, kNop, kNop});  // VADD.F32 s0, s1, s2
    core.state.s[1] = 0x3F800000;
    core.state.s[2] = 0x40000000;
    instructions(1);
  }
};

TEST(McuException, FloatingPointFrameIsReservedAndWrittenByTheFirstFpInstructionOfTheHandler) {
  FloatingPoint m;
  m.code(Machine::handler(18), {kNop, 0xEEB0, 0x1A40, kBxLr});  // VMOV.F32 s2, s0
  m.word(kStack - 104 + 32, 0x12345678);
  m.core.pulse_interrupt(2);
  const uint64_t before = m.core.cycle();
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  EXPECT_EQ(m.core.cycle() - before, 12u);
  EXPECT_EQ(m.core.state.r[kLr], 0xFFFFFFE9);
  EXPECT_EQ(m.core.state.r[kSp], kStack - 104);
  EXPECT_EQ(m.word(kStack - 104 + 32), 0x12345678u);
  EXPECT_EQ(m.system(0xE000EF38), kStack - 104 + 32);
  EXPECT_EQ(m.system(0xE000EF34) & 1, 1u);
  m.instructions(2);
  EXPECT_EQ(m.word(kStack - 104 + 32), 0x40400000u);
  EXPECT_EQ(m.core.state.s[2], 0x40400000u);
  EXPECT_EQ(m.system(0xE000EF34) & 1, 0u);
  ASSERT_TRUE(m.run_to(kProgram + 4));
  EXPECT_EQ(m.core.state.s[2], 0x40000000u);
  EXPECT_EQ(m.core.state.control & 4, 4u);
}

TEST(McuException, HandlerWithoutFpInstructionLeavesTheFrameUnwrittenAndTheRegistersAsTheyAre) {
  FloatingPoint m;
  m.word(kStack - 104 + 32, 0x12345678);
  m.core.pulse_interrupt(2);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  ASSERT_TRUE(m.run_to(kProgram + 4));
  EXPECT_EQ(m.word(kStack - 104 + 32), 0x12345678u);
  EXPECT_EQ(m.core.state.s[0], 0x40400000u);
  EXPECT_EQ(m.system(0xE000EF34) & 1, 0u);
}

TEST(McuException, WithoutLazyStackingTheEntryWritesSeventeenWordsMoreInAsManyCycles) {
  FloatingPoint m;
  m.system(0xE000EF34, 0x80000000);
  m.core.pulse_interrupt(2);
  const uint64_t before = m.core.cycle();
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  EXPECT_EQ(m.core.cycle() - before, 29u);
  EXPECT_EQ(m.word(kStack - 104 + 32), 0x40400000u);
}

TEST(McuException, ExclusiveStoreFailsAfterAnInterruptAndSucceedsWithoutOne) {
  for (const bool interrupted : {false, true}) {
    Interrupted m;
    m.program({0xE850, 0x1F00, kNop, 0xE840, 0x1200, kNop});  // LDREX r1,[r0]; NOP; STREX r2,r1,[r0]
    m.core.state.r[0] = kRam;
    m.instructions(2);
    if (interrupted) m.core.pulse_interrupt(2);
    ASSERT_TRUE(m.run_to(kProgram + 10));
    EXPECT_EQ(m.core.state.r[2], interrupted ? 1u : 0u);
  }
}

TEST(McuException, SnapshotTakenInsideAnEntryContinuesBitForBit) {
  Interrupted m;
  m.core.pulse_interrupt(2);
  m.core.run_until(m.core.cycle() + 5);
  const CoreState snapshot = m.core.state;
  const std::vector<uint8_t> ram = m.ram;
  m.core.run_until(m.core.cycle() + 40);
  const uint32_t pc = m.core.state.r[kPc], sp = m.core.state.r[kSp];
  const uint64_t cycle = m.core.cycle();
  m.core.state = snapshot;
  std::copy(ram.begin(), ram.end(), m.ram.begin());
  m.core.restored();
  m.core.run_until(m.core.cycle() + 40);
  EXPECT_EQ(m.core.state.r[kPc], pc);
  EXPECT_EQ(m.core.state.r[kSp], sp);
  EXPECT_EQ(m.core.cycle(), cycle);
}

}  // namespace
}  // namespace rotorloop::mcu::testing
