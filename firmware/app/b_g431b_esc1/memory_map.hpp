// The 64 pages of the flash (decision 0180). link.ld has the same addresses; scripts/firmware_image.py compares.
#pragma once
#include <cstdint>

#include "firmware/board/g431/flash.hpp"
#include "firmware/boot/handover.hpp"
#include "firmware/update/application_area.hpp"

namespace rotorloop::b_g431b_esc1 {

inline constexpr std::uint32_t kBootloaderPages = 12, kUpdatePage = 60, kFaultPage = 61, kParameterPage = 62;
inline constexpr firmware::UpdateLayout kUpdateLayout{};
static_assert(kUpdateLayout.first_page == kBootloaderPages && kUpdateLayout.record_page == kUpdatePage);
static_assert(kUpdateLayout.first_page + kUpdateLayout.pages == kUpdatePage && kParameterPage + 2 == g431::kPages);
inline constexpr std::uint32_t kImageOffset = kBootloaderPages * g431::kPageBytes;

// The last 8 bytes of the RAM, in neither linker script.
inline constexpr std::uint32_t kHandoverAddress = 0x20000000 + 22 * 1024 - 8;
struct HandoverMemory {
  g431::Register word, complement;
};
inline HandoverMemory& handover_memory() { return g431::block<HandoverMemory, kHandoverAddress>(); }
inline firmware::Handover read_handover() {
  return firmware::Handover::of(handover_memory().word.read(), handover_memory().complement.read());
}
inline void write_handover(const firmware::Handover& h) {
  handover_memory().word.write(h.word());
  handover_memory().complement.write(~h.word());
}

}  // namespace rotorloop::b_g431b_esc1
