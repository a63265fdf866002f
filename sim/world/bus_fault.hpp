// Faults of the bus as plain data, so that a scenario file can list them and a run repeats them bit by bit: what happens, to
// whom, from when and for how long. A random choice (probability, error position) is keyed (bus seed, fault number, frame number).
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocols/can_frame.hpp"
#include "sim/world/virtual_time.hpp"

namespace rotorloop::sim {

enum class BusFaultKind : std::uint8_t {
  lose_sent,      // frames of `port` pass the bus and are acknowledged, but no node takes them in
  lose_received,  // `port` does not take frames in (its software is too late); its controller still acknowledges
  corrupt,        // frames of `port` are destroyed on the wire: error frame, error counters, retransmission
  silent,         // `port` sends nothing: what it queues is discarded; its controller still acknowledges others
  unplugged,      // `port` neither sends, receives nor acknowledges
  extra_traffic,  // one more device sends `frame` every `period_ns`; period 0: without pause (a babbling node)
};

std::string_view name(BusFaultKind kind);
std::optional<BusFaultKind> bus_fault_kind(std::string_view name);

inline constexpr int kEveryPort = -1;

struct BusFault {
  BusFaultKind kind = BusFaultKind::corrupt;
  int port = kEveryPort;  // number that attach() counted, from 0; of the sender for lose_sent, corrupt, silent
  std::int64_t at_ns = 0;
  std::int64_t duration_ns = kNever_ns;  // acts in [at_ns, at_ns + duration_ns)

  // lose_sent, lose_received, corrupt: which frames, how often.
  std::uint32_t id = 0;                         // acts on frames with (frame.id & id_mask) == (id & id_mask)
  std::uint32_t id_mask = 0;                    // 0: every identifier
  double probability = 1.0;                     // of each matching frame, 0..1
  std::uint64_t max_count = ~std::uint64_t{0};  // at most so many frames
  int error_bit = -1;  // corrupt: bit of the frame (from 0, stuff bits counted) at which the error is seen; -1: random

  // extra_traffic: what the device sends.
  CanFrame frame{};
  bool vary_data = true;       // pseudo-random data, hence typical stuffing; false: frame.data as given
  std::int64_t period_ns = 0;  // 0: always one ready. A bus too busy for the period makes the device skip, not accumulate.

  constexpr bool active(std::int64_t time_ns) const {
    return time_ns >= at_ns && (duration_ns == kNever_ns || time_ns - at_ns < duration_ns);
  }
};

}  // namespace rotorloop::sim
