// The bus contract: what every backend (virtual, SocketCAN, gs_usb, …) offers to a node. One object is one node's port.
// A port never blocks. send() queues: frames leave in CAN priority order, frames of equal id in the order they were sent
// (DroneCAN multi-frame transfers need that). receive() returns frames of other nodes in bus order, never one's own.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocols/can_controller.hpp"
#include "protocols/can_frame.hpp"

namespace rotorloop {

struct StampedFrame {
  CanFrame frame;
  std::int64_t time_ns = 0;  // end of frame on the bus, on the port's clock
};

enum class SendStatus : std::uint8_t {
  queued,
  queue_full,  // dropped; counted
  bus_off,     // dropped; counted
};

struct PortCounters {
  std::uint64_t sent = 0;  // frames that reached the bus
  std::uint64_t received = 0;
  std::uint64_t dropped_tx = 0;    // queue full or bus off
  std::uint64_t dropped_rx = 0;    // receive queue full: the node is too slow
  std::uint64_t error_frames = 0;  // seen while this port transmitted
  std::uint64_t filtered = 0;      // heard, and passed over as no filter fits
};

class CanBus {
 public:
  virtual ~CanBus() = default;
  virtual SendStatus send(const CanFrame& frame) = 0;
  virtual std::optional<StampedFrame> receive() = 0;
  virtual BusState state() const = 0;
  virtual PortCounters counters() const = 0;

  // Only frames that fit one of these are received from now on; none given: all of them. Returns false, and changes nothing, when
  // there are more than the controller has (kFilters).
  static constexpr std::size_t kFilters = 14;  // 29-bit identifiers of a bxCAN; more than the toolkit's nodes need
  virtual bool set_filters(std::span<const CanFilter> filters) {
    if (filters.size() > kFilters) return false;
    filter_count_ = 0;
    for (const CanFilter& f : filters) filters_[filter_count_++] = f;
    return true;
  }

 protected:
  // For backends: does a filter fit?
  bool wanted(std::uint32_t id, bool extended) const {
    if (filter_count_ == 0) return true;
    for (std::size_t i = 0; i < filter_count_; ++i) {
      if (filters_[i].fits(id, extended)) return true;
    }
    return false;
  }

 private:
  std::array<CanFilter, kFilters> filters_{};
  std::size_t filter_count_ = 0;
};

}  // namespace rotorloop
