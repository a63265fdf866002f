// The mailbox between main loop and interrupt, single-stepped: the processor's trap flag hands over after every instruction of the main
// loop's read or write, and the interrupt runs at one of these boundaries, at each in turn. What is read must be one of the values
// written, never a mixture.
#include "firmware/core/motor/mailbox.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <cstring>

namespace {

using rotorloop::firmware::Mailbox;

// As long as Telemetry, every word the same: a torn value shows.
struct Value {
  std::array<std::uint32_t, 20> word{};
};
Value value_of(std::uint32_t x) {
  Value v;
  v.word.fill(x);
  return v;
}
bool whole(const Value& v) {
  for (const std::uint32_t w : v.word)
    if (w != v.word[0]) return false;
  return true;
}

#if defined(__x86_64__)

void (*g_interrupt)() = nullptr;
volatile long g_boundary = 0, g_runs_at = -1;

void on_trap(int) {
  const long boundary = g_boundary;
  g_boundary = boundary + 1;
  if (boundary == g_runs_at) g_interrupt();
}

// Runs `main_loop` with the interrupt after instruction `at`; returns how many boundaries it had.
template <class Main>
long single_step(const Main& main_loop, void (*interrupt)(), long at) {
  struct sigaction trap {
  }, before{};
  trap.sa_handler = on_trap;
  sigaction(SIGTRAP, &trap, &before);
  g_interrupt = interrupt;
  g_boundary = 0;
  g_runs_at = at;
  __asm__ volatile("pushfq\n orq $0x100, (%%rsp)\n popfq" ::: "memory", "cc");
  main_loop();
  __asm__ volatile("pushfq\n andq $~0x100, (%%rsp)\n popfq" ::: "memory", "cc");
  sigaction(SIGTRAP, &before, nullptr);
  return g_boundary;
}

Mailbox<Value> g_box;
Value g_seen;
std::uint32_t g_next = 0;

void write_once() { g_box.write(value_of(++g_next)); }
void write_twice() {
  write_once();
  write_once();
}
void read_once() { g_seen = g_box.read(); }

// The unguarded copy that the mailbox replaces.
Value g_plain;
void write_plain() { g_plain = value_of(++g_next); }

TEST(Mailbox, AReadOfTheMainLoopIsWholeWhereverTheInterruptWrites) {
  for (void (*interrupt)() : {write_once, write_twice}) {
    long boundaries = 1;
    for (long at = 0; at < boundaries; ++at) {
      const std::uint32_t oldest = g_next;
      Value seen;
      const long n = single_step([&] { seen = g_box.read(); }, interrupt, at);
      boundaries = at == 0 ? n : std::max(boundaries, n);
      ASSERT_TRUE(whole(seen)) << "interrupt after instruction " << at;
      ASSERT_GE(seen.word[0], oldest) << at;
      ASSERT_LE(seen.word[0], g_next) << at;
    }
    EXPECT_GT(boundaries, 20);
  }
}

TEST(Mailbox, AReadOfTheInterruptIsWholeWhereverItFallsIntoAWriteOfTheMainLoop) {
  long boundaries = 1;
  for (long at = 0; at < boundaries; ++at) {
    const std::uint32_t before = g_box.read().word[0];
    g_seen = value_of(before);
    const Value next = value_of(++g_next);
    boundaries = std::max(boundaries, single_step([&] { g_box.write(next); }, read_once, at));
    ASSERT_TRUE(whole(g_seen)) << "interrupt after instruction " << at;
    ASSERT_TRUE(g_seen.word[0] == before || g_seen.word[0] == g_next) << at;
  }
  EXPECT_GT(boundaries, 20);
}

TEST(Mailbox, WithoutItTheSameReadIsTornAtSomeInstruction) {
  long boundaries = 1;
  int torn = 0;
  for (long at = 0; at < boundaries; ++at) {
    Value seen;
    const long n = single_step([&] { std::memcpy(&seen, const_cast<const Value*>(&g_plain), sizeof seen); }, write_plain, at);
    boundaries = std::max(boundaries, n);
    torn += whole(seen) ? 0 : 1;
  }
  EXPECT_GT(torn, 0);
}

#else

TEST(Mailbox, SingleStepping) { GTEST_SKIP() << "single-stepping is written for x86-64"; }

#endif

TEST(Mailbox, ReturnsTheLastValueAndCountsThem) {
  Mailbox<Value> box;
  EXPECT_EQ(box.sequence(), 0u);
  box.write(value_of(3));
  box.write(value_of(4));
  EXPECT_EQ(box.read().word[7], 4u);
  EXPECT_EQ(box.sequence(), 2u);
}

}  // namespace
