// A board without hardware: the test or the simulated drive writes the counts, reads the compares. One template over the scales of
// a real board (board_scales.hpp); FakeBoard is the ST B-G431B-ESC1, the first real target.
#pragma once
#include <algorithm>
#include <array>
#include <cstring>

#include "firmware/board/board.hpp"
#include "firmware/board/fake/board_scales.hpp"

namespace rotorloop::firmware {

template <class Scales>
class BasicFakeBoard : public Scales {
 public:
  using Scales::kFlashPageBytes;
  AdcCounts counts{};
  std::array<std::uint16_t, 3> unloaded{};
  PwmCompare compare{};
  bool bridge = false;             // any gate follows its compare
  std::uint8_t gates = kAllGates;  // which do while it does
  std::uint64_t now_us = 0;
  std::array<std::array<std::uint8_t, kFlashPageBytes>, 2> flash{};

  BasicFakeBoard() {
    for (auto& page : flash) page.fill(0xFF);
  }
  AdcCounts adc() const noexcept { return counts; }
  std::uint16_t unloaded_counts(std::size_t phase) const noexcept { return unloaded[phase]; }
  void set_compare(PwmCompare c) noexcept { compare = c; }
  void bridge_on() noexcept { gates_on(kAllGates); }
  void gates_on(std::uint8_t mask) noexcept { bridge = mask != 0, gates = mask; }
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
using FakeBoard = BasicFakeBoard<B_G431B_ESC1_Scales>;
using SmallFakeBoard = BasicFakeBoard<Small2s15aScales>;
using HighVoltageFakeBoard = BasicFakeBoard<HighVoltage14s120aScales>;
static_assert(Board<FakeBoard> && Board<SmallFakeBoard> && Board<HighVoltageFakeBoard>);

}  // namespace rotorloop::firmware
