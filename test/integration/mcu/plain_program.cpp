// The program of the emulated core: its registers lie at the start of the RAM, interrupt 0 is the sample interrupt, and interrupt
// 1, which preempts it, does nothing.
#include <new>

#include "test/integration/mcu/plain_esc.hpp"

namespace {

using rotorloop::plain_board::PlainEsc;
using rotorloop::plain_board::Registers;

[[gnu::section(".registers")]] Registers registers;
alignas(PlainEsc) unsigned char place[sizeof(PlainEsc)];
PlainEsc* esc = nullptr;

void write_word(std::uint32_t address, std::uint32_t value) { *reinterpret_cast<volatile std::uint32_t*>(address) = value; }

void on_sample() { esc->on_sample(registers); }
void on_nothing() {}
void on_fault() {
  for (;;) asm volatile("bkpt 0");
}

}  // namespace

extern "C" void* memset(void* to, int value, unsigned bytes) {
  auto* at = static_cast<volatile unsigned char*>(to);
  for (unsigned n = 0; n < bytes; ++n) at[n] = static_cast<unsigned char>(value);
  return to;
}
extern "C" void* memcpy(void* to, const void* from, unsigned bytes) {
  auto* at = static_cast<volatile unsigned char*>(to);
  const auto* source = static_cast<const unsigned char*>(from);
  for (unsigned n = 0; n < bytes; ++n) at[n] = source[n];
  return to;
}

extern "C" [[noreturn]] void begin() {
  write_word(0xE000ED88, 0xF00000);  // CPACR: floating point
  asm volatile("dsb\n isb" ::: "memory");
  esc = new (place) PlainEsc(registers);
  write_word(0xE000E400, 0x10);  // the sample interrupt below the other one
  write_word(0xE000E100, 3);
  for (;;) {
    asm volatile("wfi" ::: "memory");
    esc->poll(registers);
  }
}

extern "C" unsigned char stack_top[];
using Entry = void (*)();
struct Vectors {
  const void* stack;
  Entry entry[17];
};
[[gnu::section(".vectors"), gnu::used]] const Vectors vectors{
    stack_top,
    {begin, on_fault, on_fault, on_fault, on_fault, on_fault, nullptr, nullptr, nullptr, nullptr, on_fault, on_fault, nullptr, on_fault,
     on_fault, on_sample, on_nothing}};
