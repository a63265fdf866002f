// What the two processes of a flight over buses have in common: how time goes on, what they wait for, and how they end.
#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "host/base/deadlines.hpp"
#include "host/base/error.hpp"
#include "host/node/esc_link.hpp"

namespace rotorloop::hil {

// The airframe is the clock: its IMU samples carry the time. In lockstep it takes the next millisecond when all four ESCs have answered the
// set-points of the last one, so that a busy machine makes a flight longer to wait for and changes nothing in it.
struct ProcessPace {
  double pace = 0.0;                        // seconds of flight per second; 0: lockstep
  std::int64_t wait_ns = 30'000'000'000;    // for the others to appear
  std::int64_t silence_ns = 2'000'000'000;  // of another process, before the flight is ended
  std::int64_t catch_up_ns = Deadlines::kCatchUp_ns;
  std::array<std::uint8_t, 4> esc_nodes = host::EscLinkConfig{}.esc_node_ids;  // of esc_index 0 to 3
};

inline constexpr std::int64_t kLook_ns = 100'000'000;  // at time-outs, when no frame comes
inline constexpr std::int64_t kRunDown_us = 300'000;   // flown on after disarming: longer than any time-out of an ESC's orders

struct ProcessEnd {
  bool ended = false;
  ExitCode code = ExitCode::ok;
  std::string reason;  // for people; of a flight that is over: none
};

}  // namespace rotorloop::hil
