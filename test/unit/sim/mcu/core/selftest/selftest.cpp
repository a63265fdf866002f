// A program that checks the processor it runs on, a line for each check. It uses nothing of a chip but a register for text: on silicon that
// is a serial port. Interrupts are raised by STIR, so that no peripheral is needed.
#include <cstdint>

namespace {

volatile uint32_t& reg(uint32_t address) { return *reinterpret_cast<volatile uint32_t*>(address); }
constexpr uint32_t kText = 0x40000000, kEnd = 0x40000004;
constexpr uint32_t kCycles = 0xE0001004;
constexpr uint32_t kStir = 0xE000EF00, kCfsr = 0xE000ED28, kIcsr = 0xE000ED04, kShcsr = 0xE000ED24, kCcr = 0xE000ED14;

// Written by nobody but the program; the stack of a thread.
constexpr uint32_t kThreadStack = 0x20000800;
uint32_t failed = 0;
// What the handlers did, in order, and what they saw.
volatile char order[16];
volatile uint32_t steps = 0, ticks = 0, fault_pc = 0, fault_status = 0, fault_address = 0, fault_number = 0, svc_number = 0;
volatile uint32_t cycle_of[4];                                // when interrupts 4 and 5 began and ended
volatile uint32_t guarded[64] __attribute__((aligned(256)));  // what the MPU protects

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
extern volatile uint32_t svc_return_of;
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
void on_interrupt4() { cycle_of[0] = reg(kCycles); }
void on_interrupt5() { cycle_of[1] = reg(kCycles); }
void svc(const uint32_t* frame) {
  svc_number = *reinterpret_cast<const uint8_t*>(frame[6] - 2);
  if (svc_number == 8) asm volatile("mrs r0, control\n bic r0, #1\n msr control, r0\n isb" ::: "r0");
}
void fault(uint32_t* frame) {
  fault_pc = frame[6];
  fault_status = reg(kCfsr);
  fault_address = (fault_status & 0x80) != 0 ? reg(0xE000ED34) : reg(0xE000ED38);
  fault_number = reg(kIcsr) & 0x1FF;
  reg(kCfsr) = fault_status;
  if ((fault_status & 1) != 0) {  // a fetch that is not allowed: back to the caller
    frame[6] = frame[5] & ~1u;
    return;
  }
  frame[7] |= 1u << 24;  // Thumb, where a branch has lost it
  const uint16_t first = *reinterpret_cast<const uint16_t*>(frame[6]);
  frame[6] += first >> 11 >= 0x1D ? 4 : 2;  // goes on behind the instruction
}
[[gnu::naked]] void on_svc() {
  asm volatile("ldr r1, =svc_return_of\n str lr, [r1]\n tst lr, #4\n ite eq\n mrseq r0, msp\n mrsne r0, psp\n b svc\n .ltorg");
}
volatile uint32_t svc_return_of;
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
      : "r"(kThreadStack)
      : "r0", "memory");
  check("thread on the process stack, through exceptions", (on_psp & 2) == 2 && fault_status == 1u << 16);
}

void priorities() {
  set_priority(1, 0x80);
  set_priority(2, 0x80);
  asm volatile("cpsid i");
  raise(2);
  raise(1);
  asm volatile("cpsie i\n isb");
  check("equal priorities: the lower number first, and no nesting", noted("cde"));
  reg(0xE000ED0C) = 0x05FA0000 | 6u << 8;  // PRIGROUP: one bit of group priority
  set_priority(1, 0x40);
  set_priority(2, 0x00);
  raise(1);
  check("a subpriority does not preempt", noted("cde"));
  reg(0xE000ED0C) = 0x05FA0000;
  check("AIRCR reads its key as 0xFA05", reg(0xE000ED0C) >> 16 == 0xFA05);
  reg(0xE000ED0C) = 0x12340000 | 7u << 8;
  check("and takes nothing without it", (reg(0xE000ED0C) >> 8 & 7) == 0);
  set_priority(0, 0xC7);
  check("four bits of priority", *reinterpret_cast<volatile uint8_t*>(0xE000E400) == 0xC0);
  for (uint32_t n = 0; n < 3; ++n) set_priority(n, static_cast<uint8_t>(0xC0 - 0x40 * n));
  asm volatile("cpsid f");
  raise(2);
  check("FAULTMASK holds every interrupt back", noted(""));
  asm volatile("cpsie f\n isb");
  check("until it is cleared", noted("e"));
  asm volatile("msr basepri, %0\n msr basepri_max, %1" ::"r"(0x40), "r"(0x80));
  uint32_t basepri;
  asm volatile("mrs %0, basepri" : "=r"(basepri));
  check("BASEPRI_MAX only raises", basepri == 0x40);
  asm volatile("msr basepri, %0\n isb" ::"r"(0));
  asm volatile("cpsid i");
  raise(3);
  reg(0xE000E280) = 8;
  asm volatile("cpsie i\n isb");
  check("a pending interrupt can be taken back", noted(""));
  reg(0xE000E180) = 8;
  raise(3);
  check("a disabled interrupt stays pending", noted("") && (reg(0xE000E200) & 8) != 0);
  reg(0xE000E100) = 8;
  asm volatile("isb");
  check("and comes when it is enabled", noted("f"));
}

void timing() {
  reg(0xE000EDFC) = 1u << 24;
  reg(kCycles) = 0;
  reg(0xE0001000) = reg(0xE0001000) | 1;
  const uint32_t first = reg(kCycles);
  check("the cycle counter counts", reg(kCycles) > first);
  set_priority(4, 0x80);
  set_priority(5, 0x80);
  reg(0xE000E100) = 48;
  asm volatile("cpsid i");
  raise(4);
  raise(5);
  asm volatile("cpsie i\n isb");
  check("tail chaining: the second handler begins soon after the first", cycle_of[1] - cycle_of[0] < 60);
  reg(0xE000E014) = 999;
  reg(0xE000E018) = 0;
  reg(0xE000E010) = 5;
  const uint32_t begun = reg(kCycles);
  while ((reg(0xE000E010) >> 16 & 1) == 0) {
  }
  const uint32_t taken = reg(kCycles) - begun;
  reg(0xE000E010) = 0;
  check("SysTick counts LOAD + 1 cycles", taken > 950 && taken < 1100);
  check("COUNTFLAG is cleared by reading", (reg(0xE000E010) >> 16 & 1) == 0);
  reg(0xE000E018) = 5;
  check("writing VAL clears it", reg(0xE000E018) == 0);
}

void lazy_stacking() {
  asm volatile("vmov s0, %0\n vmov s15, %0\n svc #3" ::"r"(0x3FC00000) : "s0", "s15", "r1", "r2", "r3", "r12");
  uint32_t s0, s15;
  asm volatile("vmov %0, s0\n vmov %1, s15" : "=r"(s0), "=r"(s15));
  check("EXC_RETURN says that the frame has the FPU", svc_return_of == 0xFFFFFFE9);
  check("S0 and S15 come back", s0 == 0x3FC00000 && s15 == 0x3FC00000);
  uint32_t control;
  asm volatile("mrs %0, control\n bic %0, #4\n msr control, %0\n isb\n svc #4\n mrs %0, control"
               : "=&r"(control)::"r0", "r1", "r2", "r3", "r12", "memory");
  check("without FP context the frame is short", svc_return_of == 0xFFFFFFF9 && (control & 4) == 0);
  reg(0xE000EF34) = 0x80000000;  // ASPEN alone: stacked at once
  set_fpscr(3u << 22);
  raise(2);
  check("FPSCR is part of the frame", (fpscr() >> 22 & 3) == 3);
  check("with LSPEN off nothing is left to be saved", (reg(0xE000EF34) & 1) == 0);
  reg(0xE000EF34) = 0xC0000000;
  set_fpscr(0);
  raise(2);
  check("FPCAR is the place of S0 in the frame", reg(0xE000EF38) >= 0x20000000 && reg(0xE000EF38) % 4 == 0);
}

void protection() {
  const auto region = [](uint32_t n, uint32_t base, uint32_t attributes) {
    reg(0xE000ED98) = n;
    reg(0xE000ED9C) = base;
    reg(0xE000EDA0) = attributes;
    asm volatile("dsb\n isb");
  };
  const auto load = [](uint32_t from) {
    fault_status = 0;
    asm volatile("ldr r0, [%0]" ::"r"(from) : "r0");
    return fault_status;
  };
  constexpr uint32_t kOn = 1, k256Bytes = 7u << 1, kNever = 0u << 24, kFull = 3u << 24, kReadOnly = 6u << 24, kNoExecution = 1u << 28;
  const auto at = reinterpret_cast<uint32_t>(&guarded[0]);
  check("the MPU has eight regions", (reg(0xE000ED90) >> 8 & 0xFF) == 8);
  region(1, 0x20000000, kNoExecution | kFull | 17u << 1 | kOn);
  region(2, at, kReadOnly | k256Bytes | kOn);
  guarded[0] = 7;
  reg(0xE000ED94) = 5;  // with the default map for privileged code
  asm volatile("dsb\n isb\n str %0, [%1]" ::"r"(1), "r"(at) : "memory");
  check("a write to a read-only region is a MemManage with its address", fault_number == 4 && fault_status == 0x82 && fault_address == at);
  check("and changes nothing", guarded[0] == 7);
  region(3, at, kNever | 0x0Fu << 8 | k256Bytes | kOn);
  check("where its subregion is off, a region does not count", load(at) == 0);
  check("where it is on, the highest region decides", load(at + 160) == 0x82 && fault_address == at + 160);
  region(3, at, kNever | k256Bytes | kOn);
  check("a region of no access", load(at + 4) == 0x82 && fault_address == at + 4);
  region(3, 0, 0);
  asm volatile("blx %0" ::"r"(0x20001001) : "lr", "memory");
  check("no execution from a region marked so", (fault_status & 0xFF) == 1);
  reg(0xE000ED94) = 0;
  asm volatile("dsb\n isb");
  guarded[0] = 5;
  check("with the MPU off all is allowed", guarded[0] == 5);
}

void unprivileged() {
  uint32_t seen, basepri, after;
  asm volatile(
      "msr psp, %3\n mov r0, #3\n msr control, r0\n isb\n mov r0, #0x40\n msr basepri, r0\n cpsid i\n ldr r0, [%4]\n mov r0, #0\n msr "
      "control, r0\n"
      "mrs %0, control\n svc #8\n mrs %1, basepri\n mrs %2, control\n mov r0, #0\n msr control, r0\n isb"
      : "=&r"(seen), "=&r"(basepri), "=&r"(after)
      : "r"(kThreadStack), "r"(0xE000ED08)
      : "r0", "memory");
  check("a bus fault answers an unprivileged access to the system space", fault_number == 5 && fault_address == 0xE000ED08);
  check("an unprivileged thread changes neither BASEPRI, PRIMASK nor CONTROL", (seen & 3) == 3 && basepri == 0);
  check("a handler gives the privilege back", (after & 3) == 2 && svc_number == 8);
}

void more_faults() {
  asm volatile("adr r0, 1f\n bx r0\n .align 2\n 1: nop" ::: "r0");
  check("a branch to an even address is INVSTATE", fault_status == 1u << 17 && fault_number == 6);
  reg(kCcr) = 0x208;
  asm volatile("ldr r0, [%0]" ::"r"(0x20000102) : "r0");
  check("unaligned words can be trapped", fault_status == 1u << 24);
  reg(kCcr) = 0x200;
  reg(kShcsr) = 0;
  asm volatile("udf #2");
  check("a fault that is not enabled becomes a HardFault", fault_number == 3 && (reg(0xE000ED2C) >> 30 & 1) == 1);
  reg(0xE000ED2C) = 0xFFFFFFFF;
  reg(kShcsr) = 0x70000;
  reg(0xE000ED88) = 0;
  asm volatile("dsb\n isb\n vmov s0, r0" ::: "s0");
  check("the FPU without access is NOCP", fault_status == 1u << 19);
  reg(0xE000ED88) = 0xF00000;
  asm volatile("dsb\n isb");
}

void sleep() {
  asm volatile("sev\n wfe");
  check("WFE goes on at once after SEV", true);
  asm volatile("cpsid i");
  raise(3);
  asm volatile("wfi");
  check("WFI wakes for an interrupt that PRIMASK holds back", noted("") && (reg(0xE000E200) & 8) != 0);
  asm volatile("cpsie i\n isb");
  check("which comes then", noted("f"));
  reg(0xE000ED10) = 1u << 4;  // SEVONPEND
  reg(0xE000E180) = 8;
  raise(3);
  asm volatile("wfe");
  reg(0xE000E280) = 8;
  reg(0xE000E100) = 8;
  reg(0xE000ED10) = 0;
  check("SEVONPEND wakes for a disabled one", noted(""));
}

void exclusives() {
  uint32_t first, second, third;
  asm volatile("ldrex r0, [%3]\n clrex\n strex %0, r0, [%3]\n ldrexb r0, [%3]\n strexb %1, r0, [%3]\n ldrexh r0, [%3]\n strexh %2, r0, [%3]"
               : "=&r"(first), "=&r"(second), "=&r"(third)
               : "r"(0x20000100)
               : "r0", "memory");
  check("CLREX gives the claim up; bytes and halfwords can be claimed", first == 1 && second == 0 && third == 0);
  asm volatile("dmb ish\n strex %0, r0, [%1]" : "=&r"(first) : "r"(0x20000100) : "memory");
  check("a store without a claim fails", first == 1);
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
  priorities();
  timing();
  lazy_stacking();
  protection();
  unprivileged();
  more_faults();
  steps = 0;
  sleep();
  exclusives();
  reg(kEnd) = failed;
  for (;;) asm volatile("wfi");
}

using Vector = void (*)();
[[gnu::section(".vectors"), gnu::used]] const Vector vectors[22] = {reinterpret_cast<Vector>(0x20004000),
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
                                                                    on_interrupt3,
                                                                    on_interrupt4,
                                                                    on_interrupt5};
