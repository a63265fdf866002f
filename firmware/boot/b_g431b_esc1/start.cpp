// From the reset to main(), sixteen vectors, and the way into the application.
#include <array>
#include <cstdint>

#include "firmware/app/b_g431b_esc1/memory_map.hpp"
#include "firmware/app/b_g431b_esc1/pins.hpp"
#include "firmware/board/g431/cortex.hpp"
#include "firmware/board/g431/information.hpp"
#include "firmware/board/g431/rcc.hpp"
#include "firmware/board/g431/watchdog.hpp"
#include "firmware/boot/b_g431b_esc1/boot_start.hpp"

using namespace rotorloop;
using namespace rotorloop::b_g431b_esc1;

extern "C" {
extern std::uint32_t link_stack_top[];  // of link.ld
extern std::uint32_t link_data_start[], link_data_end[], link_data_load[], link_bss_start[], link_bss_end[];

int main();
[[noreturn]] void reset_handler();
void nmi_handler();
[[noreturn]] void fault_handler();
}

namespace {

using Vector = void (*)();
struct VectorTable {
  std::uint32_t* stack;
  std::array<Vector, 15> entries;
};
constexpr std::array<Vector, 15> vectors() {
  std::array<Vector, 15> table{};
  table.fill(fault_handler);
  table[0] = reset_handler;
  table[1] = nmi_handler;
  return table;
}
[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable kTable{link_stack_top, vectors()};

void hold_gates_low() {
  g431::rcc().ahb2enr.set(g431::rcc_bits::kGpioA | g431::rcc_bits::kGpioB | g431::rcc_bits::kGpioC);
  for (const GatePin& g : kGates) g431::make_output(g.pin, false);
}

[[noreturn]] void enter(const std::uint32_t* table) {
  g431::scb().vtor.write(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(table)));
  __asm__ volatile("dsb\n isb\n msr msp, %0\n bx %1\n" ::"r"(table[0]), "r"(table[1]) : "memory");
  __builtin_unreachable();
}

// By the reset that start_application() has made, and by no other: what the block says was then checked a moment ago. Clocks, peripherals,
// interrupts and FPU are as a reset leaves them; only the watchdog runs, and the gates are low.
void enter_application_when_told() {
  firmware::Handover told = read_handover();
  const std::uint32_t flags = g431::rcc().csr.read();
  if (told.stage != firmware::BootStage::start || (flags & g431::kSoftwareFlag) == 0 || (flags & g431::kBrownOutFlag) != 0) return;
  told.stage = firmware::BootStage::started;
  write_handover(told);
  g431::start_iwdg();
  enter(reinterpret_cast<const std::uint32_t*>(g431::kFlashBase + kImageOffset + firmware::kImageHeaderBytes));
}

}  // namespace

extern "C" {

void reset_handler() {
  hold_gates_low();
  enter_application_when_told();
  g431::enable_fpu();
  g431::synchronise();
  const std::uint32_t* from = link_data_load;
  for (std::uint32_t* at = link_data_start; at != link_data_end; ++at) *at = *from++;
  for (std::uint32_t* at = link_bss_start; at != link_bss_end; ++at) *at = 0;
  main();
  reset_chip();
}

// Double error of a flash word. One that read_flash() reads is noted there; of any other there is nothing to tell and nowhere to go: the
// flag is cleared and the program goes on with what it got, as a reset would only meet the same word again.
void nmi_handler() {
  if (!g431::expected_ecc_error()) g431::flash_registers().eccr.write(g431::flash_bits::kDoubleError);
}

void fault_handler() { reset_chip(); }

}  // extern "C"

namespace rotorloop::b_g431b_esc1 {

void reset_chip() {
  hold_gates_low();
  g431::synchronise();
  g431::request_reset();
  for (;;) {
  }
}

}  // namespace rotorloop::b_g431b_esc1
