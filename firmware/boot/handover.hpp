// What bootloader and application tell each other across a reset: 8 bytes of RAM that no reset clears and neither program uses for
// anything else: stage, failures, cause of the reset, 0xB5, a byte each, and the complement of this word. After a power-up they hold
// anything; what by chance looks right then is no harm, as a power-up counts no failures and starts nothing by what it finds.
#pragma once
#include <algorithm>
#include <cstdint>

#include "firmware/board/application_board.hpp"

namespace rotorloop::firmware {

enum class BootStage : std::uint8_t {
  none,     // the bootloader runs
  start,    // it has found the application good, and resets so that this one finds the chip as a reset leaves it
  started,  // the application runs and has not yet called itself healthy
  healthy,  // … it has
  restart,  // the application has reset the chip because somebody asked for it
};

struct Handover {
  static constexpr std::uint8_t kMostFailures = 3;          // resets by watchdog or fault in a row, then the bootloader stays
  static constexpr std::uint64_t kHealthy_us = 10'000'000;  // of an application's life, then it calls itself healthy

  BootStage stage = BootStage::none;
  std::uint8_t failures = 0;
  ResetCause cause = ResetCause::unknown;  // of the reset before the one by which the application was started

  constexpr std::uint32_t word() const {
    return static_cast<std::uint32_t>(stage) | std::uint32_t{failures} << 8u | static_cast<std::uint32_t>(cause) << 16u | 0xB5u << 24u;
  }
  // Where nobody has told anything all is as at a first start.
  static constexpr Handover of(std::uint32_t word, std::uint32_t complement) {
    if (word != ~complement || word >> 24u != 0xB5u) return {};
    return {static_cast<BootStage>(word & 0xFFu), static_cast<std::uint8_t>(word >> 8u & 0xFFu),
            static_cast<ResetCause>(word >> 16u & 0xFFu)};
  }
};

// Applications that failed in a row, this reset included. Only the application's own resets count: whoever switches the power off and
// on, or presses the reset, wants it tried again.
constexpr std::uint8_t failures_after(ResetCause cause, const Handover& before) {
  if (cause != ResetCause::watchdog && cause != ResetCause::software) return 0;
  if (before.stage == BootStage::healthy || before.stage == BootStage::restart) return 0;
  const auto failures = static_cast<std::uint8_t>(before.failures + (before.stage == BootStage::started ? 1 : 0));
  return std::min(failures, Handover::kMostFailures);
}

}  // namespace rotorloop::firmware
