// A board without hardware: the test or the simulated drive writes the counts, reads the compares. Scales are those of the ST
// B-G431B-ESC1, the first real target, so that both see the same numbers.
#pragma once
#include <algorithm>
#include <array>
#include <cstring>

#include "firmware/board/board.hpp"

namespace rotorloop::firmware {

// Analogue scales of the B-G431B-ESC1 (UM2516; current: 3 mohm shunt × 64/7, 3.3 V / 4096 counts; confidence A).
struct B_G431B_ESC1_Scales {
  static constexpr std::uint32_t kPwm_Hz = 48'000;
  static constexpr std::uint32_t kPwmPeriodsPerSample = 2;
  static constexpr std::uint32_t kPwmTop = 1771;  // 170 MHz centre-aligned: 47 996 Hz
  static constexpr std::uint32_t kDeadTime_ns = 800;
  static constexpr std::uint32_t kSampleWindow_ns = 1200;
  static constexpr float kVolt_per_count = 3.3f / 4096.0f;
  static constexpr float kCurrent_A_per_count = kVolt_per_count / -27.43e-3f;
  static constexpr float kCurrentZero_counts = 2553.0f;
  static constexpr float kCurrentZeroTolerance_counts = 100.0f;
  static constexpr float kBus_V_per_count = kVolt_per_count / 0.09626f;
  static constexpr float kTemperature_K_per_count = kVolt_per_count / 19e-3f;
  static constexpr float kTemperatureZero_K = 298.15f - 1.4f / 19e-3f;
  static constexpr float kSwitchResistance_ohm = 4e-3f;
  static constexpr float kDiodeDrop_V = 0.8f;
  static constexpr float kTripCurrent_A = 44.0f;  // shunt range ±45 A
  static constexpr std::uint32_t kFlashPageBytes = 2048;
};

class FakeBoard : public B_G431B_ESC1_Scales {
 public:
  AdcCounts counts{};
  PwmCompare compare{};
  bool bridge = false;
  std::uint64_t now_us = 0;
  std::array<std::array<std::uint8_t, kFlashPageBytes>, 2> flash{};

  FakeBoard() {
    for (auto& page : flash) page.fill(0xFF);
  }
  AdcCounts adc() const noexcept { return counts; }
  void set_compare(PwmCompare c) noexcept { compare = c; }
  void bridge_on() noexcept { bridge = true; }
  void bridge_off() noexcept { bridge = false; }
  std::uint64_t time_us() const noexcept { return now_us; }
  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const noexcept {
    if (page >= flash.size() || offset > kFlashPageBytes || out.size() > kFlashPageBytes - offset) return false;
    std::copy_n(flash[page].begin() + offset, out.size(), out.begin());
    return true;
  }
  bool flash_erase(std::uint32_t page) noexcept {
    if (page >= flash.size()) return false;
    flash[page].fill(0xFF);
    return true;
  }
  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) noexcept {
    if (page >= flash.size() || offset % 8 != 0 || offset > kFlashPageBytes - 8) return false;
    const auto at = flash[page].begin() + offset;
    if (!std::all_of(at, at + 8, [](std::uint8_t b) { return b == 0xFF; })) return false;  // as the real flash: erase first
    std::memcpy(&*at, &word, 8);
    return true;
  }
};
static_assert(Board<FakeBoard>);

}  // namespace rotorloop::firmware
