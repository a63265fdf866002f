// A CAN bus between controllers of emulated adapters: arbitration, acknowledge, bit rates, error counters and bus-off.
#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "host/bus/bus_frame.hpp"

namespace rotorloop::emulated {

class WireController {
 public:
  struct Waiting {
    BusFrame frame;
    std::uint32_t echo_id = 0;
    std::int64_t since_ns = 0;
  };
  virtual ~WireController() = default;
  virtual void heard(const BusFrame& frame, std::int64_t time_ns) = 0;
  virtual void confirmed(const Waiting& sent, std::int64_t time_ns) = 0;
  enum class Report { warning, passive, active, bus_off, no_acknowledge };
  virtual void report(Report what) = 0;

  bool on = false;  // started, and not bus-off
  double rate_Hz = 0.0, data_rate_Hz = 0.0;
  bool fd = false, listen_only = false;
  int transmit_errors = 0, receive_errors = 0;
  std::deque<Waiting> to_send;

  void count_errors(int transmit, int receive);
};

class CanWire {
 public:
  // Without pace a frame takes no time; one that fails takes the time of a frame in any case.
  explicit CanWire(bool paced) : paced_(paced) {}
  void join(WireController& controller) { controllers_.push_back(&controller); }
  void leave(WireController& controller);
  // What ends up to `now_ns`.
  void step(std::int64_t now_ns);
  // When the frame on the wire ends; none: nothing is sent.
  std::optional<std::int64_t> next_event_ns() const;
  std::uint64_t frames() const { return frames_; }

 private:
  void begin(std::int64_t now_ns);
  void end();
  std::int64_t length_ns(const WireController& sender, const BusFrame& frame) const;

  bool paced_;
  std::vector<WireController*> controllers_;
  WireController* sender_ = nullptr;  // of the frame on the wire
  WireController::Waiting current_;
  bool succeeds_ = false, acknowledged_ = false;
  std::int64_t end_ns_ = 0, free_ns_ = 0;
  std::uint64_t frames_ = 0;
};

}  // namespace rotorloop::emulated
