// What is left of a fault for the time after the restart: in RAM that nobody clears, then on a page of its own in the flash.
#pragma once
#include <array>
#include <cstdint>

#include "firmware/app/b_g431b_esc1/board.hpp"

namespace rotorloop::b_g431b_esc1 {

struct FaultRecord {
  static constexpr std::uint32_t kMagic = 0x464C5452;  // "RTLF"
  std::uint32_t magic = 0;
  std::uint32_t exception = 0;  // number in the vector table: 2 NMI, 3 hard fault, … 40 break input of TIM1
  std::uint32_t pc = 0, lr = 0, cfsr = 0, hfsr = 0, address = 0, clock_failed = 0, uptime_ms = 0;
  std::uint32_t check = 0;
  constexpr std::uint32_t sum() const { return ~(magic + exception + pc + lr + cfsr + hfsr + address + clock_failed + uptime_ms); }
  constexpr bool whole() const { return magic == kMagic && check == sum(); }
};
static_assert(sizeof(FaultRecord) % 8 == 0);

// Of the run before this one, in no-init RAM. Taking it empties it.
FaultRecord take_fault_record();
// Appends it to the page; a full page is erased first. Bridge off. False: the flash refused.
bool keep_fault_record(const FaultRecord& record);

}  // namespace rotorloop::b_g431b_esc1
