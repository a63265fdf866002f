// A program that checks the processor it runs on, a line for each check. It uses nothing of a chip but a register for text: on silicon that
// is a serial port. Interrupts are raised by STIR, so that no peripheral is needed.
#include <cstdint>

namespace {

volatile uint32_t& reg(uint32_t address) { return *reinterpret_cast<volatile uint32_t*>(address); }
constexpr uint32_t kText = 0x40000000, kEnd = 0x40000004;
constexpr uint32_t kStir = 0xE000EF00, kCfsr = 0xE000ED28, kIcsr = 0xE000ED04, kShcsr = 0xE000ED24, kCcr = 0xE000ED14;

uint32_t failed = 0;
// What the handlers did, in order, and what they saw.
volatile char order[16];
volatile uint32_t steps = 0, ticks = 0, fault_pc = 0, fault_status = 0, svc_number = 0;

void check(const char* name, bool holds) {
  for (const char* p = holds ? "ok     " : "FAILED "; *p != 0; ++p) reg(kText) = static_cast<uint32_t>(*p);
  for (; *name != 0; ++name) reg(kText) = static_cast<uint32_t>(*name);
  reg(kText) = '\n';
  if (!holds) ++failed;
}

void note(char what) {
  const uint32_t at = steps;
  order[at & 15] = what;
  steps = at + 1;
}
bool noted(const char* expected) {
  uint32_t i = 0;
  for (; expected[i] != 0; ++i)
    if (order[i] != expected[i]) return false;
  const bool same = steps == i;
  steps = 0;
  return same;
}
void raise(uint32_t n) {
  reg(kStir) = n;
  asm volatile("dsb\n isb" ::: "memory");
}
void set_priority(uint32_t n, uint8_t priority) { *reinterpret_cast<volatile uint8_t*>(0xE000E400 + n) = priority; }
template <class T>
T opaque(T value) {  // not computed by the compiler
  asm volatile("" : "+r"(value));
  return value;
}
float opaque_float(float value) {
  asm volatile("" : "+t"(value));
  return value;
}
uint32_t fpscr() {
  uint32_t value;
  asm volatile("vmrs %0, fpscr" : "=r"(value));
  return value;
}
void set_fpscr(uint32_t value) { asm volatile("vmsr fpscr, %0" ::"r"(value)); }

}  // namespace

extern "C" {
void on_interrupt0() {  // least urgent
  note('a');
  raise(1);
  note('b');
}
void on_interrupt1() {
  note('c');
  raise(2);
  note('d');
}
void on_interrupt2() {
  asm volatile("vmov s0, %0\n vmov s16, %0" ::"r"(0x41000000) : "s0", "s16");
  note('e');
}
void on_interrupt3() { note('f'); }
void on_pendsv() { note('p'); }
void on_systick() { ticks = ticks + 1; }
void svc(const uint32_t* frame) { svc_number = *reinterpret_cast<const uint8_t*>(frame[6] - 2); }
void fault(uint32_t* frame) {
  fault_pc = frame[6];
  fault_status = reg(kCfsr);
  reg(kCfsr) = fault_status;
  const uint16_t first = *reinterpret_cast<const uint16_t*>(frame[6]);
  frame[6] += first >> 11 >= 0x1D ? 4 : 2;  // goes on behind the instruction
}
[[gnu::naked]] void on_svc() { asm volatile("mrs r0, msp\n b svc"); }
[[gnu::naked]] void on_fault() { asm volatile("tst lr, #4\n ite eq\n mrseq r0, msp\n mrsne r0, psp\n b fault"); }
}

namespace {

void integers() {
  check("64-bit product", uint64_t{opaque(0xFFFFFFFFu)} * opaque(0xFFFFFFFFu) == 0xFFFFFFFE00000001u);
  check("64-bit quotient", opaque(0x123456789ABCDEFull) / opaque(12345ull) == 0x123456789ABCDEFull / 12345);
  check("signed quotient of the most negative number", opaque(INT32_MIN) / opaque(3) == -715827882);
  check("division by zero gives zero", [] {
    uint32_t q;
    asm volatile("udiv %0, %1, %2" : "=r"(q) : "r"(7), "r"(0));
    return q == 0;
  }());
  uint32_t r, flags;
  asm volatile("ssat %0, #8, %2\n mrs %1, apsr" : "=&r"(r), "=r"(flags) : "r"(1000));
  check("signed saturation and Q", r == 127 && (flags >> 27 & 1) == 1);
  asm volatile("uadd8 %0, %1, %2\n sel %0, %1, %2" : "=&r"(r) : "r"(0xFF010203), "r"(0x01020304));
  check("parallel sum and selection by GE", r == 0xFF020304);
  asm volatile("smlad %0, %1, %2, %3" : "=r"(r) : "r"(0x00020003), "r"(0x00040005), "r"(100));
  check("dual product", r == 100 + 3 * 5 + 2 * 4);
  asm volatile("rbit %0, %1\n clz %0, %0" : "=r"(r) : "r"(0x00000100));
  check("reversal and leading zeros", r == 8);
  asm volatile("cmp %1, #1\n ite eq\n moveq %0, #10\n movne %0, #20" : "=r"(r) : "r"(1) : "cc");
  check("IT block, condition holds", r == 10);
  asm volatile("bfi %0, %1, #4, #8" : "+r"(r) : "r"(0xAB));
  check("bit field insertion", r == 0xABA);
}

void floating_point() {
  check("quotient", opaque_float(1.0f) / opaque_float(4.0f) == 0.25f);
  float root;
  asm volatile("vsqrt.f32 %0, %1" : "=t"(root) : "t"(2.0f));
  check("root of two", root == 1.41421356f);
  check("conversion toward zero", static_cast<int32_t>(opaque_float(-3.75f)) == -3);
  check("unsigned conversion", static_cast<uint32_t>(opaque_float(3e9f)) == 3000000000u);
  check("comparison with NaN is false", !(opaque_float(__builtin_nanf("")) == opaque_float(1.0f)));
  set_fpscr(0);
  static_cast<void>(opaque_float(opaque_float(1.0f) / opaque_float(3.0f)));
  check("inexact flag", (fpscr() & 0x9F) == 0x10);
  set_fpscr(0);
  static_cast<void>(opaque_float(opaque_float(1.0f) / opaque_float(0.0f)));
  check("division by zero flag", (fpscr() & 0x9F) == 0x02);
  set_fpscr(2u << 22);
  check("rounding down", opaque_float(opaque_float(1.0f) / opaque_float(3.0f)) < 0.33333334f);
  set_fpscr(1u << 24);
  check("flush to zero", opaque_float(opaque_float(2e-38f) * opaque_float(0.1f)) == 0.0f && (fpscr() & 8) != 0);
  set_fpscr(0);
}

void interrupts() {
  for (uint32_t n = 0; n < 4; ++n) set_priority(n, static_cast<uint8_t>(0xC0 - 0x40 * (n == 3 ? 0 : n)));
  reg(0xE000E100) = 15;
  float kept = opaque_float(5.0f);
  raise(0);
  check("three levels of nesting, innermost first done", noted("acedb"));
  check("FP registers survive handlers that use them", opaque_float(kept) == 5.0f);
  asm volatile("cpsid i");
  raise(3);
  raise(2);
  reg(kIcsr) = 1u << 28;
  check("PRIMASK holds them back", noted(""));
  asm volatile("cpsie i\n isb");
  check("then by priority: PendSV is 0, then 2, then 3", noted("pef"));
  asm volatile("msr basepri, %0" ::"r"(0x80));
  raise(1);
  raise(2);
  check("BASEPRI 0x80 lets 0x40 through and holds 0x80", noted("e"));
  asm volatile("msr basepri, %0\n isb" ::"r"(0));
  check("and 0x80 comes when it is lifted", noted("ced"));
  asm volatile("svc #42");
  check("SVC with its number", svc_number == 42);
  reg(0xE000E014) = 37;
  reg(0xE000E018) = 0;
  reg(0xE000E010) = 7;
  uint32_t even = 0, odd = 0;
  for (uint32_t i = 0; i < 2000; ++i)
    asm volatile("tst %2, #1\n ite eq\n addeq %0, %0, #1\n addne %1, %1, #1" : "+r"(even), "+r"(odd) : "r"(i) : "cc");
  reg(0xE000E010) = 0;
  check("IT blocks under a SysTick of 38 cycles", even == 1000 && odd == 1000 && ticks > 100);
}

void faults() {
  reg(kShcsr) = 0x70000;
  asm volatile("udf #0");
  check("undefined instruction", fault_status == 1u << 16);
  reg(kCcr) = 0x210;
  asm volatile("udiv r0, r0, %0" ::"r"(0) : "r0");
  check("division by zero, trapped", fault_status == 1u << 25);
  reg(kCcr) = 0x200;
  asm volatile("ldr r0, [%0]" ::"r"(0x30000000) : "r0");
  check("precise bus fault with its address", fault_status == 0x8200 && reg(0xE000ED38) == 0x30000000);
  asm volatile("ldrd r0, r1, [%0]" ::"r"(0x20000001) : "r0", "r1");
  check("unaligned pair", fault_status == 1u << 24);
  uint32_t failed_store;
  asm volatile("ldrex r0, [%1]\n svc #1\n strex %0, r0, [%1]" : "=&r"(failed_store) : "r"(0x20000100) : "r0", "memory");
  check("exclusive store fails after an exception", failed_store == 1);
  asm volatile("ldrex r0, [%1]\n strex %0, r0, [%1]" : "=&r"(failed_store) : "r"(0x20000100) : "r0", "memory");
  check("and succeeds without one", failed_store == 0);
  uint32_t on_psp;
  asm volatile(
      "msr psp, %1\n mov r0, #2\n msr control, r0\n isb\n svc #7\n udf #1\n mrs %0, control\n mov r0, #0\n msr "
      "control, r0\n isb"
      : "=&r"(on_psp)
      : "r"(0x20000800)
      : "r0", "memory");
  check("thread on the process stack, through exceptions", (on_psp & 2) == 2 && fault_status == 1u << 16);
}

}  // namespace

extern "C" [[noreturn]] void begin() {
  reg(0xE000ED88) = 0xF00000;
  asm volatile("dsb\n isb");
  failed = 0;  // nothing has cleared memory
  steps = 0;
  ticks = 0;
  integers();
  floating_point();
  interrupts();
  faults();
  reg(kEnd) = failed;
  for (;;) asm volatile("wfi");
}

using Vector = void (*)();
[[gnu::section(".vectors"), gnu::used]] const Vector vectors[20] = {reinterpret_cast<Vector>(0x20004000),
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
                                                                    on_svc,
                                                                    on_fault,
                                                                    nullptr,
                                                                    on_pendsv,
                                                                    on_systick,
                                                                    on_interrupt0,
                                                                    on_interrupt1,
                                                                    on_interrupt2,
                                                                    on_interrupt3};
