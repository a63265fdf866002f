// Faults with their status bits, addresses and escalation (DDI 0403, B1.5.14, B3.2), and the memory protection unit (B3.5).
#include <gtest/gtest.h>

#include "test/unit/sim/mcu/core/machine.hpp"

namespace rotorloop::mcu::testing {
namespace {

constexpr uint32_t kCfsr = 0xE000ED28, kHfsr = 0xE000ED2C, kMmfar = 0xE000ED34, kBfar = 0xE000ED38, kCcr = 0xE000ED14, kShcsr = 0xE000ED24;
constexpr uint32_t kForced = 1u << 30;

struct Faulting : Machine {
  Faulting() {
    system(kShcsr, 0x70000);       // MemManage, BusFault, UsageFault have handlers of their own
    core.state.r[0] = 0x30000000;  // nothing answers there
    core.state.r[1] = kRam;
  }
  // The program starts its handler, with the faulting instruction's address in the frame.
  bool takes(uint32_t exception, uint32_t stacked_pc = kProgram) {
    return run_to(handler(exception)) && word(core.state.r[kSp] + 24) == stacked_pc;
  }
};

TEST(McuFault, UndefinedInstructionIsAUsageFaultAtItsOwnAddress) {
  Faulting m;
  m.program({0xDE00});  // UDF
  EXPECT_TRUE(m.takes(kUsageFault));
  EXPECT_EQ(m.system(kCfsr), 1u << 16);
  EXPECT_EQ(m.system(kHfsr), 0u);
}

TEST(McuFault, FaultWithoutAHandlerOfItsOwnIsAForcedHardFault) {
  Faulting m;
  m.system(kShcsr, 0);
  m.program({0xDE00});
  EXPECT_TRUE(m.takes(kHardFault));
  EXPECT_EQ(m.system(kCfsr), 1u << 16);
  EXPECT_EQ(m.system(kHfsr), kForced);
}

TEST(McuFault, StatusBitsAreClearedByWritingOneInBytesToo) {
  Faulting m;
  m.program({0xDE00});
  ASSERT_TRUE(m.takes(kUsageFault));
  m.core.write_system(kCfsr + 2, 2, 1);
  EXPECT_EQ(m.system(kCfsr), 0u);
}

TEST(McuFault, LoadFromNowhereIsAPreciseBusFaultWithTheAddressAndLeavesBothRegisters) {
  Faulting m;
  m.program({0xF850, 0x2B04});  // LDR r2, [r0], #4
  m.core.state.r[2] = 7;
  EXPECT_TRUE(m.takes(kBusFault));
  EXPECT_EQ(m.system(kCfsr), 0x8200u);
  EXPECT_EQ(m.system(kBfar), 0x30000000u);
  EXPECT_EQ(m.core.state.r[0], 0x30000000u);
  EXPECT_EQ(m.core.state.r[2], 7u);
}

TEST(McuFault, StoreToNowhereIsImpreciseAfterTheInstructionUnlessTheWriteBufferIsOff) {
  for (const bool buffered : {true, false}) {
    Faulting m;
    m.system(0xE000E008, buffered ? 0 : 2);  // DISDEFWBUF
    m.program({0xF840, 0x2B04, kNop});       // STR r2, [r0], #4
    EXPECT_TRUE(m.takes(kBusFault, buffered ? kProgram + 4 : kProgram));
    EXPECT_EQ(m.system(kCfsr), buffered ? 0x400u : 0x8200u);
    EXPECT_EQ(m.core.state.r[0], buffered ? 0x30000004u : 0x30000000u);
  }
}

TEST(McuFault, BranchToNowhereIsAnInstructionBusFaultThere) {
  Faulting m;
  m.core.state.r[2] = 0x0F000001;
  m.program({0x4710});  // BX r2
  EXPECT_TRUE(m.takes(kBusFault, 0x0F000000));
  EXPECT_EQ(m.system(kCfsr), 0x100u);
}

TEST(McuFault, BranchToPeripheralsIsAnAccessViolationAndToAnEvenAddressAnInvalidState) {
  Faulting m;
  m.core.state.r[2] = kRegister | 1;
  m.program({0x4710});
  EXPECT_TRUE(m.takes(kMemManage, kRegister));
  EXPECT_EQ(m.system(kCfsr), 1u);
  Faulting even;
  even.core.state.r[2] = kProgram + 8;
  even.program({0x4710});
  EXPECT_TRUE(even.takes(kUsageFault, kProgram + 8));
  EXPECT_EQ(even.system(kCfsr), 1u << 17);
}

TEST(McuFault, UnalignedWordIsReadUnlessTrappedAndPairsMustBeAligned) {
  Faulting m;
  m.word(kRam, 0x44332211);
  m.word(kRam + 4, 0x88776655);
  m.core.state.r[1] = kRam + 1;
  m.program({0x680A, 0xE9D1, 0x2300});  // LDR r2, [r1]; LDRD r2, r3, [r1]
  m.instructions(1);
  EXPECT_EQ(m.core.state.r[2], 0x55443322u);
  EXPECT_TRUE(m.takes(kUsageFault, kProgram + 2));
  EXPECT_EQ(m.system(kCfsr), 1u << 24);
  Faulting trapped;
  trapped.system(kCcr, 0x208);
  trapped.core.state.r[1] = kRam + 1;
  trapped.program({0x680A});
  EXPECT_TRUE(trapped.takes(kUsageFault));
  EXPECT_EQ(trapped.system(kCfsr), 1u << 24);
}

TEST(McuFault, DivisionByZeroGivesZeroUnlessTrapped) {
  for (const bool trapped : {false, true}) {
    Faulting m;
    m.system(kCcr, trapped ? 0x210 : 0x200);
    m.core.state.r[2] = m.core.state.r[4] = 9;
    m.core.state.r[3] = 0;
    m.program({0xFBB2, 0xF4F3, 0xE7FE});  // UDIV r4, r2, r3
    EXPECT_EQ(m.takes(kUsageFault), trapped);
    EXPECT_EQ(m.core.state.r[4], trapped ? 9u : 0u);
    EXPECT_EQ(m.system(kCfsr), trapped ? 1u << 25 : 0u);
  }
}

TEST(McuFault, FloatingPointWithTheCoprocessorOffIsNocpAndWorksOnceItIsOn) {
  Faulting m;
  m.program({0xEE30, 0x0A81});  // VADD.F32 s0, s1, s2
  EXPECT_TRUE(m.takes(kUsageFault));
  EXPECT_EQ(m.system(kCfsr), 1u << 19);
  m.system(0xE000ED88, 0xF00000);
  EXPECT_TRUE(m.run_to(kProgram + 4));
}

TEST(McuFault, ReturnByAValueThatNoEntryGaveIsInvalidPc) {
  Faulting m;
  m.enable_interrupt(2, 0x80);
  m.code(Machine::handler(18), {0xF06F, 0x0E04, 0x4770});  // MVN lr, #4: 0xFFFFFFFB
  m.core.pulse_interrupt(2);
  EXPECT_TRUE(m.run_to(Machine::handler(kUsageFault)));
  EXPECT_EQ(m.system(kCfsr), 1u << 18);
  EXPECT_FALSE(m.core.state.nvic.active.has(18));
}

TEST(McuFault, FrameThatNamesNoExceptionOfTheChipIsInvalidPc) {
  Faulting m;
  m.enable_interrupt(2, 0x80);
  m.enable_interrupt(3, 0x40);
  m.code(Machine::handler(18), {kNop, kNop, 0xE7FE});
  m.core.pulse_interrupt(2);
  ASSERT_TRUE(m.run_to(Machine::handler(18)));
  m.core.pulse_interrupt(3);
  ASSERT_TRUE(m.run_to(Machine::handler(19)));
  const uint32_t xpsr = m.core.state.r[kSp] + 28;
  m.word(xpsr, (m.word(xpsr) & ~0x1FFu) | 300);
  ASSERT_TRUE(m.run_to(Machine::handler(kUsageFault)));
  EXPECT_EQ(m.system(kCfsr), 1u << 18);
}

TEST(McuFault, StepIsOneInstructionOrOneEntryAndABreakpointIsLeftByClearingIt) {
  Faulting m;
  m.enable_interrupt(2, 0x80);
  m.program({kNop, 0xBE00, kNop});
  m.core.stop_at_breakpoints(true);
  EXPECT_EQ(m.core.step(), Stopped::at_cycle);
  EXPECT_EQ(m.core.state.r[kPc], kProgram + 2);
  EXPECT_EQ(m.core.step(), Stopped::breakpoint);
  EXPECT_EQ(m.core.state.r[kPc], kProgram + 2);
  m.core.state.at_breakpoint = false;
  m.core.set_pc(kProgram + 4);
  m.core.pulse_interrupt(2);
  m.core.step();
  m.core.step();
  EXPECT_EQ(m.core.state.r[kPc], Machine::handler(18));
}

TEST(McuFault, FaultInsideHardFaultLocksUpAndTimePasses) {
  Faulting m;
  m.code(Machine::handler(kHardFault), {0xDE00});
  m.system(kShcsr, 0);
  m.program({0xDE00});
  EXPECT_EQ(m.core.run_until(1000), Stopped::locked_up);
  EXPECT_TRUE(m.core.state.locked_up);
  EXPECT_EQ(m.core.state.r[kPc], Machine::handler(kHardFault));
  EXPECT_EQ(m.core.run_until(2000), Stopped::locked_up);
  EXPECT_EQ(m.core.cycle(), 2000u);
  m.core.reset(kFlash);
  EXPECT_FALSE(m.core.state.locked_up);
}

TEST(McuFault, VectorThatCannotBeReadIsAHardFaultByVectorTable) {
  Faulting m;
  m.program({0xDF00});  // SVC
  m.core.state.scb.vtor = kFlash;
  m.core.state.nvic.priority[kSvCall] = 0;
  m.instructions(1);
  m.core.state.scb.vtor = 0x30000000;
  EXPECT_EQ(m.core.run_until(m.core.cycle() + 100), Stopped::locked_up);  // HardFault's vector is not there either
  EXPECT_EQ(m.system(kHfsr) & 2, 2u);
}

TEST(McuFault, BreakpointWithoutDebuggerIsAHardFaultByDebugEventAndStopsWithOne) {
  Faulting m;
  m.program({0xBE00});
  EXPECT_TRUE(m.takes(kHardFault));
  EXPECT_EQ(m.system(kHfsr), 1u << 31);
  Faulting stops;
  stops.program({0xBE00});
  stops.core.stop_at_breakpoints(true);
  EXPECT_EQ(stops.core.run_until(100), Stopped::breakpoint);
  EXPECT_EQ(stops.core.state.r[kPc], kProgram);
}

TEST(McuFault, StackThatIsNotThereIsAStackingErrorOnTopOfTheFault) {
  Faulting m;
  m.core.state.r[kSp] = 0x30000100;
  m.program({0xDE00});
  EXPECT_TRUE(m.run_to(Machine::handler(kBusFault)) || m.run_to(Machine::handler(kUsageFault)));
  EXPECT_EQ(m.system(kCfsr), 1u << 16 | 1u << 12);
}

TEST(McuFault, SupervisorCallThatIsNotUrgentEnoughIsAForcedHardFault) {
  Faulting m;
  m.program({0xB672, 0xDF00});  // CPSID i; SVC
  EXPECT_TRUE(m.takes(kHardFault, kProgram + 4));
  EXPECT_EQ(m.system(kHfsr), kForced);
}

TEST(McuFault, ResetRequestNeedsTheKey) {
  Faulting m;
  m.program({0xE7FE});
  m.system(0xE000ED0C, 0x00000004);
  EXPECT_EQ(m.core.run_until(100), Stopped::at_cycle);
  m.system(0xE000ED0C, 0x05FA0004);
  EXPECT_EQ(m.core.run_until(200), Stopped::reset_request);
}

// Region 0: flash, read only and executable. Region 1: the first 4 KB of SRAM, as `rasr_bits` say. Anything else by the default map.
struct Protected : Faulting {
  explicit Protected(uint32_t rasr_bits) {
    system(0xE000ED9C, kFlash | 0x10);
    system(0xE000EDA0, 6u << 24 | 15 << 1 | 1);
    system(0xE000ED9C, kRam | 0x11);
    system(0xE000EDA0, rasr_bits | 11 << 1 | 1);
    system(0xE000ED94, 5);  // on, default map for privileged code
  }
};
constexpr uint32_t kReadOnly = 6u << 24, kPrivilegedOnly = 1u << 24, kFull = 3u << 24, kNever = 1u << 28;

TEST(McuFault, StoreToAReadOnlyRegionIsADataAccessViolationWithItsAddress) {
  Protected m(kReadOnly);
  m.program({0x680A, 0x604A});  // LDR r2, [r1]; STR r2, [r1, #4]
  EXPECT_TRUE(m.takes(kMemManage, kProgram + 2));
  EXPECT_EQ(m.system(kCfsr), 0x82u);
  EXPECT_EQ(m.system(kMmfar), kRam + 4);
}

TEST(McuFault, RegionWithoutExecutionRefusesTheFetch) {
  Protected m(kFull | kNever);
  m.core.state.r[2] = kRam | 1;
  m.program({0x4710});
  EXPECT_TRUE(m.takes(kMemManage, kRam));
  EXPECT_EQ(m.system(kCfsr), 1u);
  Protected open(kFull);
  open.core.state.r[2] = kRam | 1;
  open.code(kRam, {kNop, kNop});
  open.program({0x4710});
  EXPECT_TRUE(open.run_to(kRam + 2));
}

TEST(McuFault, UnprivilegedThreadIsKeptOutOfAPrivilegedRegionAndOfTheSystemSpace) {
  Protected m(kPrivilegedOnly);
  m.program({0x680A, 0x2301, 0xF383, 0x8814, 0x680A});  // LDR; MOVS r3, #1; MSR CONTROL, r3; LDR
  EXPECT_TRUE(m.run_to(kProgram + 8));
  EXPECT_TRUE(m.run_to(Machine::handler(kMemManage)) || m.core.state.locked_up);
  EXPECT_EQ(m.system(kCfsr) & 0x82, 0x82u);
  Faulting plain;
  plain.core.state.r[1] = 0xE000ED00;
  plain.program({0x2301, 0xF383, 0x8814, 0x680A});
  EXPECT_TRUE(plain.takes(kBusFault, kProgram + 6));
  EXPECT_EQ(plain.system(kBfar), 0xE000ED00u);
}

TEST(McuFault, SubregionThatIsOffFallsThroughToTheDefaultMap) {
  Protected m(kReadOnly | 1u << 8);     // the first 512 bytes
  m.program({0x600A, 0xF8C1, 0x2200});  // STR r2, [r1]; STR r2, [r1, #0x200]
  EXPECT_TRUE(m.takes(kMemManage, kProgram + 2));
  EXPECT_EQ(m.system(kMmfar), kRam + 0x200);
}

TEST(McuFault, UnprivilegedLoadOfPrivilegedCodeIsCheckedAsUnprivileged) {
  Protected m(kPrivilegedOnly);
  m.program({0xF851, 0x2E00});  // LDRT r2, [r1]
  EXPECT_TRUE(m.takes(kMemManage));
  EXPECT_EQ(m.system(kMmfar), kRam);
}

// A guard of 32 bytes, as under a stack, and the default map around it.
struct Guarded : Faulting {
  Guarded() {
    system(0xE000ED9C, (kRam + 0x100) | 0x10);
    system(0xE000EDA0, kNever | 4 << 1 | 1);
    system(0xE000ED94, 5);
  }
};

TEST(McuFault, AccessesBesideAGuardPassAndOneThatReachesIntoItFaults) {
  Guarded m;
  m.program({0xF8C1, 0x20FC, 0xF8C1, 0x2120, 0xF8C1, 0x20FE});  // STR r2 at 0xFC, 0x120, 0xFE
  EXPECT_TRUE(m.takes(kMemManage, kProgram + 8));
  EXPECT_EQ(m.system(kCfsr), 0x82u);
  Guarded inside;
  inside.program({0xF891, 0x211F});  // LDRB r2, [r1, #0x11F]
  EXPECT_TRUE(inside.takes(kMemManage, kProgram));
  EXPECT_EQ(inside.system(kMmfar), kRam + 0x11F);
}

TEST(McuFault, UnprivilegedThreadHasNothingOutsideOfTheRegions) {
  Guarded m;
  m.program({0x680A, 0x2301, 0xF383, 0x8814, 0x680A});  // LDR; MOVS r3, #1; MSR CONTROL, r3; LDR
  EXPECT_TRUE(m.run_to(Machine::handler(kMemManage)) || m.core.state.locked_up);
  EXPECT_NE(m.system(kCfsr) & 3, 0u);
}

}  // namespace
}  // namespace rotorloop::mcu::testing
