// A CAN interface of Linux, "socketcan:can0[@BITRATE[,DATARATE]]", through one raw socket. `sent` counts frames that the kernel reported as
// sent (its echo to the sender, MSG_CONFIRM); what it took and did not report yet is `unconfirmed`. Filters are the kernel's.
#pragma once
#include <linux/can.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "host/bus/live/error_report.hpp"
#include "host/bus/live/socketcan/interface_choice.hpp"
#include "host/bus/live/stamp_clock.hpp"
#include "host/bus/live/transmit_queue.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop {

// Why this process cannot have a CAN socket (errno); 0: it can.
int can_socket_trouble();

class SocketCanPort final : public TimedBus {
 public:
  static constexpr int kWantedReceiveBuffer_B = 4 << 20;  // as of the multicast bus: some 5 000 frames with their bookkeeping

  // Throws Error (exit 3): see choose_interface() and socket_refusal().
  explicit SocketCanPort(const SocketCanSettings& settings);
  ~SocketCanPort() override;
  SocketCanPort(const SocketCanPort&) = delete;
  SocketCanPort& operator=(const SocketCanPort&) = delete;

  SendStatus send_any(const BusFrame& frame) override;
  // Throws Error (exit 3) from the moment on at which the interface went down or away.
  std::optional<StampedBusFrame> receive_any() override;
  std::int64_t now_ns() const override;
  void wait_until(std::int64_t deadline_ns) override;
  BusState state() const override { return errors_.state(); }
  PortCounters counters() const override { return counted_; }
  LinkCounters link_counters() const override;
  bool set_filters(std::span<const CanFilter> filters) override;
  std::string name() const override { return settings_.name(); }
  int descriptor() const override { return socket_; }
  bool output_waits() const override { return !queue_.empty() && retry_ns_ == INT64_MAX; }
  void flush() override;
  std::int64_t next_flush_ns() const override { return queue_.empty() ? INT64_MAX : retry_ns_; }
  bool input_waits() const override { return next_ < count_ || lost_ != 0; }
  std::optional<std::string> next_notice() override;

 private:
  struct Batch;  // frames taken by one call of the system
  enum class Write { taken, full, refused };
  void open();
  void ask_for(int option, const void* value, unsigned size, const char* step);
  Write write(const BusFrame& frame);
  void drop_stale();
  void lose(int reason);
  void fill();
  // The frame of the batch at `i` when it is one for the caller.
  std::optional<StampedBusFrame> take(std::size_t i);
  void read_control(std::size_t i, StampedBusFrame& received);
  void install_filters();
  void hear_own(const BusFrame& frame);

  SocketCanSettings settings_;
  CanInterface link_info_;
  int socket_ = -1;
  std::unique_ptr<Batch> batch_;
  std::size_t next_ = 0, count_ = 0;  // of the batch
  TransmitQueue queue_;
  std::int64_t retry_ns_ = INT64_MAX;  // after ENOBUFS; polling says writable all the same
  std::int64_t frame_ns_;              // that a frame takes on this bus, for the next try
  ErrorState errors_{"then set the interface down and up"};
  std::deque<std::string> notices_;
  StampClock adapter_clock_;
  PortCounters counted_;
  LinkCounters link_;
  std::uint64_t taken_ = 0;     // by the system
  std::uint32_t overflow_ = 0;  // the system's count, of 32 bits
  int lost_ = 0;                // the reason that ended the connection
  std::vector<CanFilter> filters_;
  std::set<std::uint32_t> own_ids_;  // with CAN_EFF_FLAG; the kernel's filters let their echoes pass
};

}  // namespace rotorloop
