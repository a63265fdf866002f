// What the maker wrote into the chip (RM0440, section 48, DS12589), why it was reset, and its option bytes.
#pragma once
#include <array>
#include <cstdint>

#include "firmware/board/application_board.hpp"
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct UniqueIdRegisters {
  Register word[3];
};
inline UniqueIdRegisters& unique_id_registers() { return block<UniqueIdRegisters, 0x1FFF7590>(); }
// 96 bits and four zeros: the 16 bytes that a node says.
std::array<std::uint8_t, 16> unique_id();

// Counts of VREFINT at 3.0 V and 30 C; the upper half of a word.
inline Register& vrefint_word() { return block<Register, 0x1FFF75A8>(); }
inline std::uint32_t vrefint_calibration() { return vrefint_word().read() >> 16u; }

// Reads the flags of the hardware and clears them: once.
firmware::ResetCause take_reset_cause();
inline constexpr std::uint32_t kPinFlag = bit(26), kBrownOutFlag = bit(27), kSoftwareFlag = bit(28), kIwdgFlag = bit(29),
                               kWwdgFlag = bit(30);
constexpr firmware::ResetCause reset_cause_of(std::uint32_t csr) {
  using firmware::ResetCause;
  // The pin's flag is set by every reset, as the chip pulls its own pin low: it counts last.
  if ((csr & (kIwdgFlag | kWwdgFlag)) != 0) return ResetCause::watchdog;
  if ((csr & kSoftwareFlag) != 0) return ResetCause::software;
  if ((csr & kBrownOutFlag) != 0) return ResetCause::power_on;  // the same flag for power-on and brown-out
  return (csr & kPinFlag) != 0 ? ResetCause::pin : ResetCause::unknown;
}

// What the option bytes should be: brown-out reset at 2.8 V, so that no gate is driven by a supply that fails; PB8 no boot pin (it is an
// input of the board), start from flash; pages of the bootloader protected against writing.
struct OptionBytes {
  std::uint32_t optr = 0, wrp1ar = 0;
};
inline constexpr std::uint32_t kBorMask = field(7, 8), kBor2V8 = field(4, 8), kBootByPin = bit(26), kBootFlash = bit(27);
constexpr OptionBytes wanted_options(const OptionBytes& now, std::uint32_t bootloader_pages) {
  return {(now.optr & ~(kBorMask | kBootByPin)) | kBor2V8 | kBootFlash, field(bootloader_pages - 1, 16)};  // first page 0
}
OptionBytes read_options();
// By an explicit command only. Resets the chip when it succeeds; false: refused.
bool write_options(const OptionBytes& options);

}  // namespace rotorloop::g431
