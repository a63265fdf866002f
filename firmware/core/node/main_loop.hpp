// The main loop around the node: how often it comes round, and how much it takes at a time. An application and a simulated ESC keep to it;
// the node's promises in time are made with it.
#pragma once
#include <cstddef>
#include <cstdint>

#include "protocols/bus_load.hpp"

namespace rotorloop::firmware {

inline constexpr std::uint32_t kPoll_us = 250;

// Frames handed in before the next poll: more than a bus of 1 Mbit/s carries in that time (the shortest has 47 bits), so that nothing piles
// up, and few enough that a burst out of a buffer does not hold up the loop.
inline constexpr std::size_t kFramesPerPoll = 8;
static_assert(kFramesPerPoll * 47 > kPoll_us);

// What a command has behind it when it is stamped, and its end before it acts: the longest frame on the wire, a poll at each end, a sample
// of the motor control. Less of the time-out, and the bridge is off within it, counted from the sending.
inline constexpr std::uint32_t kOnItsWay_us = protocols::worst_frame_bits(true, 8) + 2 * kPoll_us + 50;

}  // namespace rotorloop::firmware
