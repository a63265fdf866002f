// A board without hardware: the test or the simulated drive writes the counts, reads the compares. One template over the scales of
// a real board (board_scales.hpp); FakeBoard is the ST B-G431B-ESC1, the first real target.
#pragma once
#include <array>
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/board/fake/board_scales.hpp"
#include "firmware/board/fake/memory_flash.hpp"

namespace rotorloop::firmware {

template <class Scales>
class FakePowerStage : public Scales {
 public:
  AdcCounts counts{};
  std::array<std::uint16_t, 3> unloaded{};
  PwmCompare compare{};
  bool bridge = false;             // any gate follows its compare
  std::uint8_t gates = kAllGates;  // which do while it does
  std::uint64_t now_us = 0;

  AdcCounts adc() const noexcept { return counts; }
  std::uint16_t unloaded_counts(std::size_t phase) const noexcept { return unloaded[phase]; }
  void set_compare(PwmCompare c) noexcept { compare = c; }
  void bridge_on() noexcept { gates_on(kAllGates); }
  void gates_on(std::uint8_t mask) noexcept {
    bridge = mask != 0;
    gates = mask;
  }
  void bridge_off() noexcept { bridge = false; }
  std::uint64_t time_us() const noexcept { return now_us; }
};

// What the interrupt uses comes first: its offsets then fit into the instructions, as addresses of registers do.
template <class Scales>
class BasicFakeBoard : public FakePowerStage<Scales>, public MemoryFlash {};
using FakeBoard = BasicFakeBoard<B_G431B_ESC1_Scales>;
using SmallFakeBoard = BasicFakeBoard<Small2s15aScales>;
using HighVoltageFakeBoard = BasicFakeBoard<HighVoltage14s120aScales>;
static_assert(Board<FakeBoard> && Board<SmallFakeBoard> && Board<HighVoltageFakeBoard>);

}  // namespace rotorloop::firmware
