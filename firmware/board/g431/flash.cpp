#include "firmware/board/g431/flash.hpp"

#include "firmware/board/g431/cortex.hpp"

// Runs while the flash cannot be read.
#ifdef __arm__
#define ROTORLOOP_IN_RAM __attribute__((section(".ccm_text"), noinline, long_call))
#else
#define ROTORLOOP_IN_RAM
#endif

namespace rotorloop::g431 {
namespace {

using namespace flash_bits;

// Written by read_flash(), read by the NMI in the middle of it.
volatile bool reading = false, unreadable = false;

// About 100 ms at 170 MHz: an erase takes 22 to 25 ms.
constexpr std::uint32_t kBusyTries = 1'000'000;

ROTORLOOP_IN_RAM void operate(std::uint32_t control, volatile std::uint32_t* at, std::uint32_t low, std::uint32_t high,
                              void (*while_busy)()) {
  Register& sr = flash_registers().sr;
  flash_registers().cr.write(control);
  if (at != nullptr) {
    at[0] = low;
    synchronise();
    at[1] = high;
  } else {
    flash_registers().cr.write(control | kStart);
  }
  synchronise();
  for (std::uint32_t tries = kBusyTries; sr.has(kBusy) && tries != 0; --tries) {
    if (while_busy != nullptr) while_busy();
  }
}

bool idle() {
  return wait_for([] { return !flash_registers().sr.has(kBusy); }, kBusyTries);
}

// An operation from unlock to lock. False: refused or failed, by the flags of the hardware.
bool run(std::uint32_t control, volatile std::uint32_t* at, std::uint64_t word, void (*while_busy)()) {
  FlashRegisters& f = flash_registers();
  if (!idle()) return false;
  f.sr.write(kErrors | kEndOfOperation);
  if (f.cr.has(kLock)) {
    f.keyr.write(kKey1);
    f.keyr.write(kKey2);
  }
  mask_interrupts();
  operate(control, at, static_cast<std::uint32_t>(word), static_cast<std::uint32_t>(word >> 32u), while_busy);
  allow_interrupts();
  const std::uint32_t status = f.sr.read();
  f.sr.write(status & (kErrors | kEndOfOperation));
  f.cr.write(kLock);
  // The data cache still holds what was there before (RM0440, section 3.3.7).
  f.acr.clear(kDataCache);
  f.acr.set(kDataCacheReset);
  f.acr.clear(kDataCacheReset);
  f.acr.set(kDataCache);
  return (status & (kErrors | kBusy)) == 0;
}

}  // namespace

bool set_wait_states(std::uint32_t wait_states) {
  Register& acr = flash_registers().acr;
  acr.change(kLatencyMask, wait_states | kPrefetch | kInstructionCache | kDataCache);
  return wait_for([&] { return (acr.read() & kLatencyMask) == wait_states; }, 1000);
}

bool read_flash(std::uint32_t offset, std::span<std::uint8_t> out) {
  if (offset > kFlashBytes || out.size() > kFlashBytes - offset) return false;
  unreadable = false;
  reading = true;
  synchronise();
  const volatile std::uint8_t* from = flash_memory() + offset;
  for (std::uint8_t& byte : out) byte = *from++;
  synchronise();
  reading = false;
  return !unreadable;
}

bool erase_page(std::uint32_t page, void (*while_busy)()) {
  return page < kPages && run(kPageErase | field(page, 3), nullptr, 0, while_busy);
}

bool program_word(std::uint32_t offset, std::uint64_t word, void (*while_busy)()) {
  if (offset % 8 != 0 || offset > kFlashBytes - 8) return false;
  return run(kProgram, reinterpret_cast<volatile std::uint32_t*>(flash_memory() + offset), word, while_busy);
}

bool expected_ecc_error() {
  if (!reading || !flash_registers().eccr.has(kDoubleError)) return false;
  flash_registers().eccr.write(kDoubleError);
  unreadable = true;
  return true;
}

}  // namespace rotorloop::g431
