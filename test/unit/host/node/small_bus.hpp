// The smallest bus that a test of nodes needs: what one port sends, all others receive, in arbitration order and one frame
// after the other. Frames can be lost on purpose. (The virtual bus with bit timing and faults lives in sim/world.)
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "host/bus/can_bus.hpp"
#include "protocols/bus_load.hpp"

namespace rotorloop::host {

class SmallBus {
 public:
  class Port : public CanBus {
   public:
    SendStatus send(const CanFrame& frame) override {
      if (out.size() >= capacity) return SendStatus::queue_full;
      out.push_back(frame);
      return SendStatus::queued;
    }
    std::optional<StampedFrame> receive() override {
      if (in.empty()) return std::nullopt;
      const StampedFrame f = in.front();
      in.pop_front();
      return f;
    }
    BusState state() const override { return BusState::error_active; }
    PortCounters counters() const override { return {}; }

    std::deque<CanFrame> out;
    std::deque<StampedFrame> in;
    std::size_t capacity = 64;
  };

  Port& add_port() { return *ports_.emplace_back(std::make_unique<Port>()); }

  // Carries what is queued, as far as it fits until `end_us`.
  void run_until(std::int64_t end_us) {
    for (;;) {
      Port* sender = nullptr;
      std::size_t which = 0;
      for (const auto& p : ports_) {
        for (std::size_t i = 0; i < p->out.size(); ++i) {
          if (sender == nullptr || protocols::arbitration_key(p->out[i]) < protocols::arbitration_key(sender->out[which])) {
            sender = p.get();
            which = i;
          }
        }
      }
      if (sender == nullptr) {
        time_us = end_us;  // idle
        return;
      }
      const CanFrame frame = sender->out[which];
      const std::int64_t frame_us = protocols::worst_frame_bits(frame.extended, frame.length);  // 1 Mbit/s
      if (time_us + frame_us > end_us) return;
      time_us += frame_us;
      sender->out.erase(sender->out.begin() + static_cast<std::ptrdiff_t>(which));
      seen.push_back(frame);
      if (lose && lose(frame)) continue;
      for (const auto& p : ports_) {
        if (p.get() != sender) p->in.push_back({.frame = frame, .time_ns = time_us * 1000});
      }
    }
  }

  std::int64_t time_us = 0;
  std::vector<CanFrame> seen;
  std::function<bool(const CanFrame&)> lose;

 private:
  std::vector<std::unique_ptr<Port>> ports_;
};

}  // namespace rotorloop::host
