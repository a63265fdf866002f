// The flash memory (RM0440, section 3): 64 pages of 2 KB, programmed by words of 8 bytes that were erased before. While it works nothing
// can be fetched from it: the core waits, interrupts too. A word torn by a power cut may be unreadable: its double ECC error raises an
// NMI, which read_flash() expects and nothing else does.
#pragma once
#include <cstdint>
#include <span>

#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct FlashRegisters {
  Register acr, pdkeyr, keyr, optkeyr, sr, cr, eccr;
  Reserved<1> reserved_1c;
  Register optr, pcrop1sr, pcrop1er, wrp1ar, wrp1br;
};
static_assert(offsetof(FlashRegisters, keyr) == 0x08 && offsetof(FlashRegisters, cr) == 0x14 && offsetof(FlashRegisters, eccr) == 0x18 &&
              offsetof(FlashRegisters, optr) == 0x20 && offsetof(FlashRegisters, wrp1ar) == 0x2C);
inline FlashRegisters& flash_registers() { return block<FlashRegisters, 0x40022000>(); }

namespace flash_bits {
inline constexpr std::uint32_t kKey1 = 0x45670123, kKey2 = 0xCDEF89AB, kOptionKey1 = 0x08192A3B, kOptionKey2 = 0x4C5D6E7F;
inline constexpr std::uint32_t kLatencyMask = 15, kPrefetch = bit(8), kInstructionCache = bit(9), kDataCache = bit(10),
                               kDataCacheReset = bit(12);
inline constexpr std::uint32_t kBusy = bit(16), kEndOfOperation = bit(0), kErrors = 0xC3FA;  // SR: all that a failed operation leaves
inline constexpr std::uint32_t kProgram = bit(0), kPageErase = bit(1), kStart = bit(16), kOptionStart = bit(17), kOptionLaunch = bit(27),
                               kOptionLock = bit(30), kLock = bit(31);        // CR
inline constexpr std::uint32_t kDoubleError = bit(31), kCorrected = bit(30);  // ECCR
}  // namespace flash_bits

inline constexpr std::uint32_t kFlashBase = 0x08000000, kFlashBytes = 128 * 1024, kPageBytes = 2048, kPages = kFlashBytes / kPageBytes;

// Caches on; false: the flash did not take them.
bool set_wait_states(std::uint32_t wait_states);

// `offset` in bytes from the start of the flash. False: outside, or one of its words is unreadable; `out` is then not to be used.
bool read_flash(std::uint32_t offset, std::span<std::uint8_t> out);
// Both return when the flash has finished. While it works interrupts are masked, so that none waits half done for its code, and
// `while_busy` is called over and over: it lies in RAM and keeps a watchdog quiet.
bool erase_page(std::uint32_t page, void (*while_busy)());
bool program_word(std::uint32_t offset, std::uint64_t word, void (*while_busy)());

// The NMI's question. True: a double error of a word that read_flash() is reading; the flag is cleared and reading goes on.
bool expected_ecc_error();

#ifndef __arm__
inline std::uint8_t* flash_memory() {
  static std::uint8_t plain[kFlashBytes];
  return plain;
}
#else
inline std::uint8_t* flash_memory() { return reinterpret_cast<std::uint8_t*>(kFlashBase); }
#endif

}  // namespace rotorloop::g431
