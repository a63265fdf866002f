// The remote serial protocol, packet by packet (gdb manual, appendix E).
#include "sim/mcu/gdb/session.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/mcu/gdb/core_target.hpp"
#include "test/unit/sim/mcu/core/machine.hpp"

namespace rotorloop::mcu::gdb {
namespace {

using testing::kNop, testing::kProgram, testing::kRam, testing::kStack, testing::Machine;

std::string framed(const std::string& body) {
  unsigned sum = 0;
  for (const char c : body) sum += static_cast<unsigned char>(c);
  return fmt::format("${}#{:02x}", body, sum & 0xFF);
}

struct Debugged {
  Debugged() : target(m.core, m.memories, testing::kFlash), session(target) { session.receive(framed("QStartNoAckMode")); }
  // What the packet is answered by, without frame.
  std::string ask(const std::string& body) {
    const std::string reply = session.receive(framed(body));
    return reply.size() > 4 ? reply.substr(1, reply.size() - 4) : "";
  }
  std::string until_stop() {
    for (int i = 0; i < 100; ++i)
      if (const std::string stop = session.run(); !stop.empty()) return stop.substr(1, stop.size() - 4);
    return "still running";
  }
  std::string pc() { return ask("pf"); }

  Machine m;
  CoreTarget target;
  Session session;
};

std::string little(uint32_t v) { return fmt::format("{:02x}{:02x}{:02x}{:02x}", v & 0xFF, v >> 8 & 0xFF, v >> 16 & 0xFF, v >> 24); }

TEST(McuGdb, PacketsAreAcknowledgedUntilTheDebuggerAsksNotTo) {
  Machine m;
  CoreTarget target(m.core, m.memories, testing::kFlash);
  Session session(target);
  EXPECT_EQ(session.receive(framed("qAttached")), "+" + framed("1"));
  EXPECT_EQ(session.receive("$qAttached#00"), "-") << "wrong sum";
  EXPECT_EQ(session.receive(framed("QStartNoAckMode")), "+" + framed("OK"));
  EXPECT_EQ(session.receive(framed("qAtta").substr(0, 4)), "") << "in pieces";
  EXPECT_EQ(session.receive(framed("qAttached").substr(4)), framed("1"));
}

TEST(McuGdb, RegistersOfCoreSystemAndFpuAreReadAndWritten) {
  Debugged d;
  d.m.core.state.s[3] = 0x3F800000;
  EXPECT_EQ(d.ask("g").size(), 2u * (17 * 4 + 6 * 4 + 16 * 8 + 4));
  EXPECT_EQ(d.ask("pd"), little(kStack));
  EXPECT_EQ(d.ask("p18"), "000000000000803f") << "D1 is S2 and S3";
  EXPECT_EQ(d.ask("P5=" + little(0x12345678)), "OK");
  EXPECT_EQ(d.m.core.state.r[5], 0x12345678u);
  EXPECT_EQ(d.ask("P12=" + little(0x20001000)), "OK");
  EXPECT_EQ(d.m.core.process_sp(), 0x20001000u);
  EXPECT_EQ(d.ask("P28=00000000"), "E01") << "there is none";
  EXPECT_TRUE(d.ask("qXfer:features:read:target.xml:0,2000").starts_with("l<?xml"));
}

TEST(McuGdb, MemoryIsReadAndWrittenFlashToo) {
  Debugged d;
  EXPECT_EQ(d.ask(fmt::format("M{:x},4:01020304", kRam + 16)), "OK");
  EXPECT_EQ(d.ask(fmt::format("m{:x},4", kRam + 16)), "01020304");
  EXPECT_EQ(d.ask(fmt::format("X{:x},2:}}\x03}}]", kRam)), "OK");
  EXPECT_EQ(d.ask(fmt::format("m{:x},2", kRam)), "237d") << "# and } come as } and the character by 0x20";
  EXPECT_EQ(d.ask(fmt::format("M{:x},2:00bf", kProgram)), "OK");
  EXPECT_EQ(d.ask("m60000000,4"), "E0e");
}

TEST(McuGdb, ABreakpointStopsBeforeItsInstructionAndTheNextContinuePassesIt) {
  Debugged d;
  d.m.program({kNop, kNop, kNop, 0xE7FB});  // B to the start
  EXPECT_EQ(d.ask(fmt::format("Z0,{:x},2", kProgram + 4)), "OK");
  d.ask("c");
  EXPECT_EQ(d.until_stop(), "T05hwbreak:;thread:1;");
  EXPECT_EQ(d.pc(), little(kProgram + 4));
  const uint64_t executed = d.m.core.state.instructions;
  d.ask("vCont;c");
  EXPECT_EQ(d.until_stop(), "T05hwbreak:;thread:1;");
  EXPECT_EQ(d.m.core.state.instructions, executed + 4);
  EXPECT_EQ(d.ask(fmt::format("z0,{:x},2", kProgram + 4)), "OK");
  d.ask("c");
  EXPECT_EQ(d.session.run(), "");
  EXPECT_EQ(d.session.receive("\x03"), framed("T02thread:1;"));
}

TEST(McuGdb, OneStepIsOneInstruction) {
  Debugged d;
  d.m.program({kNop, kNop});
  EXPECT_EQ(d.ask("s"), "T05thread:1;");
  EXPECT_EQ(d.pc(), little(kProgram + 2));
}

TEST(McuGdb, AWatchpointStopsBehindTheStoreAndSaysItsAddress) {
  Debugged d;
  d.m.core.state.r[1] = kRam + 0x100;
  d.m.program({0x6808, 0x6008, 0xE7FC});  // LDR, STR r0, [r1]; again
  d.ask(fmt::format("Z2,{:x},4", kRam + 0x100));
  d.ask("c");
  EXPECT_EQ(d.until_stop(), fmt::format("T05watch:{:x};thread:1;", kRam + 0x100));
  EXPECT_EQ(d.pc(), little(kProgram + 4));
  d.ask(fmt::format("z2,{:x},4", kRam + 0x100));
  d.ask(fmt::format("Z3,{:x},1", kRam + 0x102));
  d.ask("c");
  EXPECT_EQ(d.until_stop(), fmt::format("T05rwatch:{:x};thread:1;", kRam + 0x102)) << "a word that covers it";
  EXPECT_EQ(d.pc(), little(kProgram + 2));
}

TEST(McuGdb, ABkptOfTheProgramStopsOnItAndContinueGoesOnBehindIt) {
  Debugged d;
  d.m.program({kNop, 0xBE00, kNop, 0xE7FE});
  d.ask("c");
  EXPECT_EQ(d.until_stop(), "T05thread:1;");
  EXPECT_EQ(d.pc(), little(kProgram + 2));
  d.ask("c");
  EXPECT_EQ(d.session.run(), "");
  d.session.receive("\x03");
  EXPECT_EQ(d.pc(), little(kProgram + 6));
}

TEST(McuGdb, LockUpEndsTheRunWithAText) {
  Debugged d;
  d.m.word(testing::kFlash + 12, 0xFFFFFFF1);  // HardFault's handler is nowhere
  d.m.program({0xDE00});
  d.ask("c");
  const std::string stop = d.until_stop();
  EXPECT_NE(stop.find("T0bthread:1;"), std::string::npos) << stop;
  EXPECT_EQ(d.ask("?"), "T0bthread:1;");
}

TEST(McuGdb, MonitorResetStartsFromTheVectorsAndTimeGoesOn) {
  Debugged d;
  d.m.program({kNop, kNop, kNop, 0xE7FE});
  d.ask("s");
  const uint64_t cycle = d.m.core.cycle();
  EXPECT_EQ(d.ask("qRcmd,7265736574"), "OK");
  EXPECT_EQ(d.pc(), little(kProgram));
  EXPECT_EQ(d.m.core.cycle(), cycle);
}

TEST(McuGdb, AfterDetachingNothingStopsThePrograms) {
  Machine m;
  m.program({kNop, 0xE7FD});
  {
    CoreTarget target(m.core, m.memories, testing::kFlash);
    Session session(target);
    session.receive(framed(fmt::format("Z2,{:x},4", kRam)));
    session.receive(framed("D"));
    EXPECT_TRUE(session.detached());
  }
  m.instructions(10);
  EXPECT_FALSE(m.core.state.at_breakpoint);
}

}  // namespace
}  // namespace rotorloop::mcu::gdb
