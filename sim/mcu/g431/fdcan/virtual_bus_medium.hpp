// FDCAN1 of a chip on a virtual bus.
#pragma once
#include <algorithm>
#include <string>

#include "sim/mcu/g431/fdcan/fdcan.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::mcu::g431 {

class VirtualBusMedium final : public CanMedium {
 public:
  // Bus and chip have one zero of time: power-up at the bus's start. `drives`: the chip moves the bus, to the cycle at each access. Without
  // it, who runs several nodes does, in steps not longer than VirtualBus::next_event_ns, and calls Chip::reschedule(fdcan) after each.
  VirtualBusMedium(sim::VirtualBus& bus, Fdcan& fdcan, bool drives, std::string name = "FDCAN1") : bus_(bus), drives_(drives) {
    bus.attach(fdcan, std::move(name));
    fdcan.connect(this);
  }
  void advance_to(int64_t time_ns) override {
    if (drives_) bus_.advance_to(std::max(time_ns, bus_.now_ns()));
  }
  int64_t next_event_ns() const override { return drives_ ? bus_.next_event_ns() : sim::kNever_ns; }
  void has_frame(int64_t since_ns) override { bus_.has_frame(since_ns); }

 private:
  sim::VirtualBus& bus_;
  bool drives_;
};

}  // namespace rotorloop::mcu::g431
