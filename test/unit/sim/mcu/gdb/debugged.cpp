// What the debugger looks at: a counter, a function with an argument, a float, an interrupt.
#include <cstdint>

volatile uint32_t counter, interrupts;
volatile float half;

extern "C" {
[[gnu::noinline]] void counted(uint32_t by) {
  counter = counter + by;
  asm volatile("");
}
void on_svc() { interrupts = interrupts + 1; }
void on_fault() {
  for (;;) asm volatile("");
}
[[noreturn]] void begin() {
  *reinterpret_cast<volatile uint32_t*>(0xE000ED88) = 0xF00000;
  asm volatile("dsb\n isb");
  counter = 0;
  interrupts = 0;
  for (uint32_t n = 1;; ++n) {
    half = 0.5f * static_cast<float>(n);
    counted(n);
    if (n == 3) asm volatile("svc #0");
  }
}
}

using Vector = void (*)();
[[gnu::section(".vectors"), gnu::used]] const Vector vectors[12] = {reinterpret_cast<Vector>(0x20004000),
                                                                    reinterpret_cast<Vector>(begin),
                                                                    on_fault,
                                                                    on_fault,
                                                                    on_fault,
                                                                    on_fault,
                                                                    on_fault,
                                                                    nullptr,
                                                                    nullptr,
                                                                    nullptr,
                                                                    nullptr,
                                                                    on_svc};
