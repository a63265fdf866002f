// The 64 pages of the flash (decision 0180). link.ld has the same addresses; scripts/firmware_image.py compares.
#pragma once
#include <cstdint>

#include "firmware/board/g431/flash.hpp"
#include "firmware/update/application_area.hpp"

namespace rotorloop::b_g431b_esc1 {

inline constexpr std::uint32_t kBootloaderPages = 12, kUpdatePage = 60, kFaultPage = 61, kParameterPage = 62;
inline constexpr firmware::UpdateLayout kUpdateLayout{};
static_assert(kUpdateLayout.first_page == kBootloaderPages && kUpdateLayout.record_page == kUpdatePage);
static_assert(kUpdateLayout.first_page + kUpdateLayout.pages == kUpdatePage && kParameterPage + 2 == g431::kPages);
inline constexpr std::uint32_t kImageOffset = kBootloaderPages * g431::kPageBytes;

}  // namespace rotorloop::b_g431b_esc1
