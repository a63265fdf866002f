// How scripted faults act on the bus: who is mute, who hears, which frame is destroyed or lost, what extra devices send.
#include <algorithm>

#include "sim/world/virtual_bus.hpp"
#include "sim/world/virtual_bus_port.hpp"

namespace rotorloop::sim {

void VirtualBus::deliver(const StampedFrame& stamped, std::uint64_t senders) {
  if (faults_.empty()) {
    for (std::size_t i = 0; i < port_count_; ++i) {
      Port& port = *nodes_[i];
      if ((senders >> i & 1u) != 0) continue;
      if (port.controller != nullptr) continue;
      if (port.off()) {
        ++missed_while_off_;
        continue;
      }
      port.count_good_reception();
      port.take_in(stamped);
    }
    return;
  }
  bool nobody = false;
  for (FaultState& state : faults_) {
    if (state.fault.kind != BusFaultKind::lose_sent) continue;
    const bool hit = state.fault.port == kEveryPort || (senders >> state.fault.port & 1u) != 0;
    if (hit && strikes(state, stamped.frame, stamped.time_ns)) nobody = true;
  }
  for (std::size_t i = 0; i < port_count_; ++i) {
    Port& port = *nodes_[i];
    if ((senders >> i & 1u) != 0 || port.controller != nullptr) continue;
    if (port.off()) {
      ++missed_while_off_;
      continue;
    }
    bool lost = nobody;
    if (acknowledges(port, stamped.time_ns)) {
      port.count_good_reception();
    } else {
      lost = true;
    }
    for (FaultState& state : faults_) {
      if (state.fault.kind != BusFaultKind::lose_received) continue;
      if (state.fault.port != kEveryPort && state.fault.port != port.number) continue;
      if (strikes(state, stamped.frame, stamped.time_ns)) lost = true;
    }
    if (lost) {
      ++lost_by_fault_;
    } else {
      port.take_in(stamped);
    }
  }
}

// Gives the device of an extra_traffic fault its next frame.
void VirtualBus::refill(Port& device, std::int64_t not_before_ns) {
  const BusFault& fault = device.traffic->fault;
  if (device.traffic_count > 0) device.traffic_due_ns += fault.period_ns;
  if (device.traffic_due_ns < not_before_ns) {
    const std::int64_t late_ns = not_before_ns - device.traffic_due_ns;
    device.traffic_due_ns += fault.period_ns == 0 ? late_ns : (late_ns + fault.period_ns - 1) / fault.period_ns * fault.period_ns;
  }
  if (!fault.active(device.traffic_due_ns)) return;
  CanFrame frame = fault.frame;
  if (fault.vary_data) {
    std::uint64_t word = device.traffic->random.bits(device.traffic_count);
    for (std::size_t i = 0; i < frame.length; ++i, word >>= 8) frame.data[i] = static_cast<std::uint8_t>(word);
  }
  ++device.traffic_count;
  device.tx.push(tx_entry(frame, device.traffic_due_ns));
}

bool VirtualBus::muted(const Port& port, std::int64_t time_ns) const {
  return std::any_of(faults_.begin(), faults_.end(), [&](const FaultState& s) {
    return (s.fault.kind == BusFaultKind::silent || s.fault.kind == BusFaultKind::unplugged) && port.number >= 0 &&
           (s.fault.port == kEveryPort || s.fault.port == port.number) && s.fault.active(time_ns);
  });
}

bool VirtualBus::unplugged(const Port& port, std::int64_t time_ns) const {
  return std::any_of(faults_.begin(), faults_.end(), [&](const FaultState& s) {
    return s.fault.kind == BusFaultKind::unplugged && port.number >= 0 && (s.fault.port == kEveryPort || s.fault.port == port.number) &&
           s.fault.active(time_ns);
  });
}

bool VirtualBus::acknowledges(const Port& port, std::int64_t time_ns) const {
  if (port.controller != nullptr && !port.controller->acknowledges(time_ns)) return false;
  return !port.off() && !unplugged(port, time_ns);
}

bool VirtualBus::strikes(FaultState& state, const CanFrame& frame, std::int64_t time_ns) {
  const BusFault& fault = state.fault;
  if (!fault.active(time_ns) || ((frame.id ^ fault.id) & fault.id_mask) != 0 || state.applied >= fault.max_count) return false;
  if (state.random.uniform(state.seen++) >= fault.probability) return false;
  ++state.applied;
  return true;
}

int VirtualBus::error_bit(FaultState& state, int frame_bits) const {
  if (state.fault.error_bit >= 0) return std::min(state.fault.error_bit, frame_bits - 1);
  // Its own sample numbers, apart from those of strikes().
  const std::uint64_t word = state.random.bits(~state.applied);
  return static_cast<int>(word % static_cast<std::uint64_t>(frame_bits));
}

}  // namespace rotorloop::sim
