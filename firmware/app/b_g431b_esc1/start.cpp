// From the reset to main(), the vector table, and every exception that has no business here: gates low first, then a record, then a reset.
#include <algorithm>
#include <array>
#include <cstdint>

#include "firmware/app/b_g431b_esc1/faults.hpp"
#include "firmware/board/g431/cortex.hpp"
#include "firmware/board/g431/flash.hpp"

using namespace rotorloop;
using namespace rotorloop::b_g431b_esc1;

extern "C" {
// Of link.ld.
extern std::uint32_t link_stack_bottom[], link_stack_top[], link_emergency_top[];
extern std::uint32_t link_data_start[], link_data_end[], link_data_load[], link_bss_start[], link_bss_end[];
extern std::uint32_t link_ccm_start[], link_ccm_end[], link_ccm_load[], link_ram_vectors[];
extern void (*link_init_start[])();
extern void (*link_init_end[])();

int main();
[[noreturn]] void reset_handler();
void fault_entry();
void nmi_handler();
bool nmi_is_expected();
[[noreturn]] void record_fault(const std::uint32_t* frame, std::uint32_t exception);
void sample_interrupt();
void can_interrupt();
}

namespace {

[[gnu::section(".noinit")]] FaultRecord last_fault;

using Vector = void (*)();
constexpr std::size_t kVectors = 16 + g431::kInterrupts;
constexpr std::array<Vector, kVectors - 1> vectors() {
  std::array<Vector, kVectors - 1> table{};
  table.fill(fault_entry);
  table[0] = reset_handler;
  table[1] = nmi_handler;
  table[15 + g431::kIrqAdc12] = sample_interrupt;
  table[15 + g431::kIrqFdcan0] = can_interrupt;
  return table;
}

struct VectorTable {
  std::uint32_t* stack;
  std::array<Vector, kVectors - 1> entries;
};
[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable kTable{link_stack_top, vectors()};

void copy_words(std::uint32_t* to, const std::uint32_t* end, const std::uint32_t* from) {
  while (to != end) *to++ = *from++;
}

std::uint32_t address(const void* at) { return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(at)); }

// A write through null or beyond the stack ends here and nowhere else.
void guard_memory() {
  g431::forbid(0, address(link_stack_bottom), 256);
  g431::forbid(1, 0, g431::kFlashBytes);  // the flash again, for the boot: nothing of ours is read there
  g431::enable_mpu();
  g431::synchronise();
}

// The eight words that the exception has pushed.
bool in_stack(const std::uint32_t* frame) {
  return address(frame) >= address(link_stack_bottom) + 256 && address(frame) + 32 <= address(link_stack_top);
}

}  // namespace

extern "C" {

[[noreturn]] void reset_handler() {
  hold_gates_low();
  g431::enable_fpu();
  g431::synchronise();
  copy_words(link_data_start, link_data_end, link_data_load);
  copy_words(link_ccm_start, link_ccm_end, link_ccm_load);
  for (std::uint32_t* at = link_bss_start; at != link_bss_end; ++at) *at = 0;
  const auto* table = reinterpret_cast<const std::uint32_t*>(&kTable);
  copy_words(link_ram_vectors, link_ram_vectors + kVectors, table);
  g431::scb().vtor.write(address(link_ram_vectors));
  g431::synchronise();
  g431::enable_faults();
  guard_memory();
  for (auto* init = link_init_start; init != link_init_end; ++init) (*init)();
  main();
  record_fault(nullptr, 0);
}

// No stack is trusted: the output enable goes first, then a stack of its own.
[[gnu::naked]] void fault_entry() {
  __asm__ volatile(
      "ldr r0, =0x40012C44\n"  // TIM1_BDTR
      "ldr r1, [r0]\n"
      "bic r1, r1, #0x8000\n"
      "str r1, [r0]\n"
      "mrs r0, msp\n"
      "mrs r1, ipsr\n"
      "ldr r2, =link_emergency_top\n"
      "msr msp, r2\n"
      "b record_fault\n");
}

bool nmi_is_expected() { return g431::expected_ecc_error(); }

[[gnu::naked]] void nmi_handler() {
  __asm__ volatile(
      "push {r4, lr}\n"
      "bl nmi_is_expected\n"
      "pop {r4, lr}\n"
      "cbz r0, 1f\n"
      "bx lr\n"
      "1: b fault_entry\n");
}

void record_fault(const std::uint32_t* frame, std::uint32_t exception) {
  g431::bridge_off();
  hold_gates_low();
  g431::mask_interrupts();
  FaultRecord r;
  r.magic = FaultRecord::kMagic;
  r.exception = exception;
  if (in_stack(frame)) {
    r.lr = frame[5];
    r.pc = frame[6];
  }
  r.cfsr = g431::scb().cfsr.read();
  r.hfsr = g431::scb().hfsr.read();
  r.address = (r.cfsr & 0x80u) != 0 ? g431::scb().mmfar.read() : g431::scb().bfar.read();
  r.clock_failed = g431::rcc().cifr.read() & g431::rcc_bits::kCssFailed;
  r.uptime_ms = g431::tim2().cnt.read() / 1000u;
  r.check = r.sum();
  last_fault = r;
  g431::synchronise();
  g431::request_reset();
  for (;;) {
  }
}

}  // extern "C"

namespace rotorloop::b_g431b_esc1 {

FaultRecord take_fault_record() {
  const FaultRecord r = last_fault;
  last_fault = FaultRecord{};
  return r.whole() ? r : FaultRecord{};
}

}  // namespace rotorloop::b_g431b_esc1
