// CAN over UDP multicast, "mcast:N": the bus that ArduPilot's SITL, AP_Periph, pydronecan and the DroneCAN GUI tool join on one machine or
// network. Group 239.65.82.N, port 57732, one frame a datagram (multicast_packet.hpp). There is no arbitration and no bit time, and
// what a receiver is too slow for is lost: the system counts that, and so does dropped_rx.
#pragma once
#include <netinet/in.h>

#include <cstdint>
#include <optional>
#include <string>

#include "host/bus/timed_bus.hpp"

namespace rotorloop {

inline constexpr std::uint16_t kMulticastPort = 57732;
inline constexpr int kMulticastGroups = 10;  // 0..9, as ArduPilot counts its instances

class MulticastBus final : public TimedBus {
 public:
  static constexpr int kWantedReceiveBuffer_B = 4 << 20;  // a second of a full 1 Mbit/s bus is 1.5 MB of packets with their bookkeeping

  // Throws Error (exit 3) with the system's reason when the group cannot be joined.
  explicit MulticastBus(int group);
  ~MulticastBus() override;
  MulticastBus(const MulticastBus&) = delete;
  MulticastBus& operator=(const MulticastBus&) = delete;

  SendStatus send_any(const BusFrame& frame) override;
  std::optional<StampedBusFrame> receive_any() override;
  std::int64_t now_ns() const override;
  void wait_until(std::int64_t deadline_ns) override;
  BusState state() const override { return BusState::error_active; }
  PortCounters counters() const override { return counted_; }
  LinkCounters link_counters() const override;
  std::string name() const override;
  int descriptor() const override { return in_; }

 private:
  void open();

  int group_;
  int in_ = -1, out_ = -1;
  sockaddr_in own_{};  // what our datagrams come from
  PortCounters counted_;
  LinkCounters link_;
  std::uint32_t overflow_ = 0;  // the system's count, of 32 bits
};

}  // namespace rotorloop
