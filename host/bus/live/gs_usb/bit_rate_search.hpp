// Which bit rate a bus has whose nodes talk: the channel only receives, so that it disturbs nobody, and tries one rate after the other.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>

#include "host/bus/live/gs_usb/adapter.hpp"

namespace rotorloop::gs_usb {

inline constexpr std::int64_t kListened_ns = 250'000'000;  // at each rate; a node of DroneCAN says something every 1 s, an ESC 50 times

// The first rate at which a frame of classic CAN comes whole (its CRC is checked by the controller): that of `settings`, then 1000000,
// 500000, 250000, 125000 bit/s. None: nothing came at any of them. The channel is stopped afterwards. Throws Error (exit 3) where the
// adapter cannot only listen, is gone, or has the channel open in this program. `now_ns`: nanoseconds of any epoch.
std::optional<std::uint32_t> search_bit_rate(const Settings& settings, Adapter& adapter, const std::function<std::int64_t()>& now_ns);

}  // namespace rotorloop::gs_usb
