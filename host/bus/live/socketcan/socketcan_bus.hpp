// A CAN interface of Linux, "socketcan:can0": real adapters with a kernel driver, vcan and vxcan. The socket's send buffer is kept small,
// so that frames wait here, in priority order, and not in the kernel's queue, which has none. A frame counts as sent when it comes back
// confirmed. Used by nobody here on real hardware; tested in a guest of Debian's kernel.
#pragma once
#include <linux/can.h>
#include <sys/socket.h>

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "host/base/descriptor.hpp"
#include "host/bus/live/socketcan/can_interfaces.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop {

class SocketCanBus final : public TimedBus {
 public:
  static constexpr std::size_t kQueue = 1000;         // frames; more are dropped and counted
  static constexpr std::int64_t kRetry_ns = 150'000;  // after ENOBUFS: about one frame of eight bytes at 1 Mbit/s

  // Throws Error (device): no CAN in this kernel, and all that ready_interface() refuses.
  explicit SocketCanBus(const SocketCanSettings& settings);

  SendStatus send_any(const BusFrame& frame) override;
  std::optional<StampedBusFrame> receive_any() override;  // throws Error (device), once and again, after the interface is down or gone
  std::int64_t now_ns() const override;
  void wait_until(std::int64_t deadline_ns) override;
  BusState state() const override { return state_; }
  PortCounters counters() const override { return counted_; }
  LinkCounters link_counters() const override;
  std::string name() const override { return "socketcan:" + interface_.name; }
  int descriptor() const override { return socket_.get(); }
  bool output_waits() const override { return !queue_.empty() && retry_ns_ == 0; }
  void flush() override;
  std::int64_t flush_at_ns() const override { return retry_ns_ == 0 ? INT64_MAX : retry_ns_; }
  bool set_filters(std::span<const CanFilter> filters) override;
  // What was last heard of the controller's errors, in words; empty so far.
  const std::string& last_error() const { return last_error_; }

 private:
  enum class Written : unsigned char { done, later, refused };
  Written write(const BusFrame& frame);
  void install_filters();
  void note_own(const BusFrame& frame);
  void take_error(const can_frame& frame);
  std::int64_t take_control(msghdr& message, std::int64_t now_ns);
  void end(int reason);

  CanInterface interface_;
  Descriptor socket_;
  bool fd_ = false;
  BusState state_ = BusState::error_active;
  PortCounters counted_;
  LinkCounters link_;
  std::uint64_t handed_over_ = 0;                 // frames that the kernel took
  std::uint32_t overflow_ = 0;                    // the system's count, of 32 bits
  std::multimap<std::uint32_t, BusFrame> queue_;  // by arbitration; equal ones in the order they came
  std::int64_t retry_ns_ = 0;                     // 0: the descriptor tells when there is room
  std::optional<std::vector<CanFilter>> kernel_filters_;
  std::set<std::uint32_t> own_ids_;  // with CAN_EFF_FLAG: their confirmations must pass the filters too
  std::string ended_, last_error_;
};

}  // namespace rotorloop
