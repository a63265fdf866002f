// What every CAN controller has, in a host as in an ESC: acceptance filters and the state of its error counters.
#pragma once
#include <cstdint>

namespace rotorloop {

enum class BusState : std::uint8_t { error_active, error_passive, bus_off };

// Acceptance filter, as CAN controllers have them: a frame fits when it is of this format and agrees with `id` where `mask` is 1.
struct CanFilter {
  std::uint32_t id = 0, mask = 0;
  bool extended = true;
  constexpr bool fits(std::uint32_t frame_id, bool frame_extended) const {
    return frame_extended == extended && ((frame_id ^ id) & mask) == 0;
  }
};

}  // namespace rotorloop
