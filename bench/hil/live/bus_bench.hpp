// What a frame costs on a bus of this machine, and where frames are lost: two nodes, filters on.
#pragma once
#include <cstdint>
#include <string>

#include "host/bus/timed_bus.hpp"

namespace rotorloop::live {

struct BusBenchOptions {
  std::uint64_t frames = 100'000;  // one way
  std::uint64_t round_trips = 2'000;
  std::uint64_t burst = 64;  // sent before the receiver reads again
};

struct BusBenchResult {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  std::uint64_t dropped_by_sender = 0;    // queue full: never left
  std::uint64_t dropped_by_receiver = 0;  // counted by the system: the receive buffer was full
  std::uint64_t unexplained = 0;          // sent, not received and in no count
  std::uint64_t out_of_order = 0;
  std::uint64_t damaged = 0;  // content differs from what was sent
  double frames_per_s = 0.0;
  double round_trip_median_us = 0.0, round_trip_p99_us = 0.0, round_trip_worst_us = 0.0;  // wall time
  std::uint64_t round_trips = 0, round_trips_lost = 0;
  double virtual_round_trip_us = 0.0;  // virtual bus: of bus time
  double bits_per_frame = 0.0;         // virtual bus: mean with stuff bits and intermission
  std::uint64_t receive_buffer_B = 0;
};

// The virtual bus at 1 Mbit/s: random 8-byte frames with 29-bit identifiers, one at a time; every second one is an answer.
BusBenchResult bench_virtual_bus(const BusBenchOptions& options);

// Two ends of a live bus in one process; frames of others on the bus are passed over.
BusBenchResult bench_live_bus(TimedBus& sender, TimedBus& receiver, const BusBenchOptions& options);

}  // namespace rotorloop::live
