// The bus as a sequence of starts (arbitrations) and ends of frames; between them nothing happens, so a lockstep run pays for
// frames and not for bit times.
#include "sim/world/virtual_bus.hpp"

#include <algorithm>
#include <stdexcept>

#include "host/base/error.hpp"
#include "host/bus/frame_bits.hpp"

namespace rotorloop::sim {
namespace {

constexpr std::size_t kMaxNodes = 64;  // senders are a bit set
constexpr std::size_t kIdTableSlots = 1024;
constexpr int kFirstErrorBit = 12;          // where a node with another bit time finds its first error
constexpr int kErrorFrameBits = 6 + 6 + 8;  // own flag, echoed flag, delimiter

// Keys of random streams (host/base/random.hpp): one per fault.
constexpr std::uint64_t kFaultStreams = 0x6275735F66617500ull;

[[noreturn]] void refuse(std::string what, std::string remedy) {
  throw Error({.where = "virtual bus", .what = std::move(what), .likely = "", .remedy = std::move(remedy)});
}

bool has_meaning_without_bus_time(BusFaultKind kind) { return kind != BusFaultKind::corrupt && kind != BusFaultKind::extra_traffic; }

// Bit (stuff bits not counted) at which two different frames of one identifier first differ.
int first_difference_bit(const CanFrame& a, const CanFrame& b) {
  const int header_bits = a.extended ? 39 : 19;
  if (a.length != b.length) return header_bits - 1;
  for (int i = 0; i < a.length; ++i) {
    const auto byte = static_cast<std::size_t>(i);
    if (a.data[byte] != b.data[byte]) return header_bits + 8 * i + 7;
  }
  return header_bits;
}

void check_frame(const CanFrame& f) {
  if (f.length > 8 || f.id >= (f.extended ? 1u << 29 : 1u << 11)) throw std::invalid_argument("CAN frame with an impossible id or length");
}

}  // namespace

SendStatus VirtualBusPort::send(const CanFrame& frame) { return bus_.send(*this, frame); }

std::optional<StampedFrame> VirtualBusPort::receive() {
  if (rx_count_ == 0 || rx_[rx_head_].time_ns + config.rx_latency_ns > bus_.now_ns_) return std::nullopt;
  const StampedFrame& frame = rx_[rx_head_];
  if (++rx_head_ == rx_.size()) rx_head_ = 0;
  --rx_count_;
  return frame;
}

VirtualBus::VirtualBus(BusConfig config)
    : config_(std::move(config)),
      bit_ns_(config_.bit_rate_Hz > 0 ? kNs_per_s / config_.bit_rate_Hz : 0),
      now_ns_(config_.start_ns),
      processed_ns_(config_.start_ns),
      idle_from_ns_(config_.start_ns),
      wake_ns_(config_.start_ns),
      load_(config_.start_ns, std::max(config_.load_window_ns, std::int64_t{1}), config_.stored_load_windows),
      ids_(kIdTableSlots) {
  if (bit_ns_ <= 0 || kNs_per_s % config_.bit_rate_Hz != 0) {
    refuse("bit rate " + std::to_string(config_.bit_rate_Hz) + " Hz does not give whole nanoseconds per bit",
           "use 1000000, 800000, 500000, 250000, 125000 or another divisor of 1 GHz");
  }
  if (config_.load_window_ns <= 0) refuse("load window of " + std::to_string(config_.load_window_ns) + " ns", "use 10000000 (10 ms)");
  for (const BusFault& fault : config_.faults) {
    const std::string which = "fault " + std::to_string(faults_.size()) + " (" + std::string(name(fault.kind)) + ")";
    if (config_.ideal && !has_meaning_without_bus_time(fault.kind)) {
      refuse(which + " needs bus time, which the ideal bus does not have", "remove the fault, or set ideal = false");
    }
    if (!(fault.probability >= 0.0 && fault.probability <= 1.0)) refuse(which + ": probability outside 0..1", "give a share of the frames");
    if (fault.period_ns < 0) refuse(which + ": period below 0 ns", "use 0 for a node that never pauses");
    if (fault.duration_ns < 0) refuse(which + ": duration below 0 ns", "leave it out for a fault that lasts to the end");
    if (fault.kind == BusFaultKind::extra_traffic) check_frame(fault.frame);
    faults_.push_back({.fault = fault, .random = RandomStream(config_.seed, kFaultStreams + faults_.size())});
  }
}

VirtualBus::~VirtualBus() = default;

CanBus& VirtualBus::attach(PortConfig config) {
  if (sealed_) refuse("port \"" + config.name + "\" attached to a running bus", "attach all nodes before the first frame or step");
  if (nodes_.size() >= kMaxNodes) refuse("more than 64 nodes", "use a second bus");
  if (config.tx_depth == 0 || config.rx_depth == 0 || config.tx_depth > 0xFFFF) {
    refuse("port \"" + config.name + "\": queue depth outside 1..65535", "use 64 to send and 256 to receive");
  }
  if (config.tx_latency_ns < 0 || config.rx_latency_ns < 0) refuse("port \"" + config.name + "\": latency below 0 ns", "use 0 or more");
  nodes_.push_back(std::make_unique<Port>(*this, std::move(config), static_cast<int>(nodes_.size())));
  port_count_ = nodes_.size();
  return *nodes_.back();
}

void VirtualBus::attach(BusController& controller, std::string name) {
  attach(PortConfig{.name = std::move(name), .tx_depth = 1, .rx_depth = 1});
  nodes_.back()->controller = &controller;
}

// The set of nodes is complete: check what faults point at, and start the devices of extra_traffic faults.
void VirtualBus::seal() {
  sealed_ = true;
  for (FaultState& state : faults_) {
    const BusFault& fault = state.fault;
    if (fault.port != kEveryPort && (fault.port < 0 || static_cast<std::size_t>(fault.port) >= port_count_)) {
      refuse("fault " + std::string(name(fault.kind)) + " names port " + std::to_string(fault.port) + ", the bus has " +
                 std::to_string(port_count_) + " ports (0, 1, …)",
             "count ports in the order of attach()");
    }
    if (fault.kind != BusFaultKind::extra_traffic) continue;
    if (nodes_.size() >= kMaxNodes) refuse("more than 64 nodes with the extra_traffic devices", "use a second bus");
    nodes_.push_back(std::make_unique<Port>(*this, PortConfig{.name = "extra traffic", .tx_depth = 1, .rx_depth = 1}, -1));
    nodes_.back()->traffic = &state;
    nodes_.back()->traffic_due_ns = std::max(fault.at_ns, config_.start_ns);
    refill(*nodes_.back(), nodes_.back()->traffic_due_ns);
  }
  update_wake();
}

void VirtualBus::set_now(std::int64_t time_ns) {
  if (time_ns < processed_ns_) throw std::logic_error("VirtualBus::set_now: that time has already been simulated");
  now_ns_ = time_ns;
}

const std::string& VirtualBus::port_name(std::size_t port) const { return nodes_.at(port)->config.name; }
CanBus& VirtualBus::port(std::size_t port) { return *nodes_.at(port); }
ErrorCounters VirtualBus::error_counters(std::size_t port) const { return nodes_.at(port)->errors; }

void VirtualBus::process(std::int64_t time_ns) {
  if (time_ns < processed_ns_) throw std::logic_error("VirtualBus::advance_to: time runs forward only");
  if (!sealed_) seal();
  while (true) {
    if (in_flight_) {
      if (flight_.end_ns > time_ns) break;
      finish();
      continue;
    }
    const std::int64_t start_ns = next_start_ns();
    if (restart_recovered(std::min(start_ns, time_ns))) continue;  // one that is back may have something to send
    if (start_ns >= time_ns) break;
    start(start_ns);
  }
  now_ns_ = processed_ns_ = time_ns;
  update_wake();
}

SendStatus VirtualBus::send(Port& port, const CanFrame& frame) {
  check_frame(frame);
  if (!sealed_) seal();
  if (config_.ideal) {
    send_ideal(port, frame);
    return SendStatus::queued;
  }
  if (port.off()) {
    ++port.counted.dropped_tx;
    return SendStatus::bus_off;
  }
  const std::int64_t ready_ns = now_ns_ + port.config.tx_latency_ns;
  if (!port.tx.push(tx_entry(frame, ready_ns))) {
    ++port.counted.dropped_tx;
    return SendStatus::queue_full;
  }
  if (!in_flight_) wake_ns_ = std::min(wake_ns_, std::max({idle_from_ns_, ready_ns, port.suspended_until_ns}) + 1);
  return SendStatus::queued;
}

void VirtualBus::send_ideal(Port& port, const CanFrame& frame) {
  if (muted(port, now_ns_)) {
    ++port.counted.dropped_tx;
    return;
  }
  const TxEntry entry = tx_entry(frame, now_ns_);
  ++port.counted.sent;
  count_delivery(entry, now_ns_, now_ns_);
  deliver({.frame = frame, .time_ns = now_ns_}, std::uint64_t{1} << port.number);
  if (tap_) tap_({.frame = frame, .start_ns = now_ns_, .end_ns = now_ns_, .port = port.number});
}

std::int64_t VirtualBus::next_start_ns() const {
  std::int64_t earliest_ns = kNever_ns;
  for (const auto& node : nodes_) {
    const std::int64_t ready_ns = node->ready_ns();
    if (ready_ns != kNever_ns) earliest_ns = std::min(earliest_ns, std::max({ready_ns, idle_from_ns_, node->suspended_until_ns}));
  }
  return earliest_ns;
}

// Arbitration at time_ns: the lowest key among the nodes that have a frame ready.
void VirtualBus::start(std::int64_t time_ns) {
  const TxEntry* best = nullptr;
  std::uint64_t senders = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Port& node = *nodes_[i];
    const TxEntry* entry = node.suspended_until_ns > time_ns ? nullptr : node.enter_arbitration(time_ns);
    if (entry == nullptr) continue;
    if (muted(node, time_ns)) {
      if (node.controller != nullptr) node.suspended_until_ns = time_ns + bits_ns(kRecoveryBits);  // it keeps its frame
      node.counted.dropped_tx += node.tx.clear();
      continue;
    }
    if (best == nullptr || entry->key < best->key) {
      best = entry;
      senders = std::uint64_t{1} << i;
    } else if (entry->key == best->key) {
      senders |= std::uint64_t{1} << i;
    }
  }
  if (best == nullptr) return;
  const int idle_sequences = static_cast<int>((time_ns - idle_from_ns_) / bits_ns(kRecoveryBits));
  for (const auto& node : nodes_) node->recovery_left = std::max(0, node->recovery_left - idle_sequences);

  flight_ = {.entry = *best, .start_ns = time_ns, .end_ns = 0, .senders = senders, .error = false, .ack_error = false};
  int error_at = flight_.entry.bits;  // beyond the last bit: none
  bool acknowledged = false;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Port& node = *nodes_[i];
    if ((senders >> i & 1u) == 0) {
      acknowledged = acknowledged || acknowledges(node, time_ns);
    } else if (node.racing->frame != flight_.entry.frame) {
      error_at = std::min(error_at, first_difference_bit(node.racing->frame, flight_.entry.frame));
    }
    if (node.controller == nullptr) continue;
    const bool sends = (senders >> i & 1u) != 0;
    acknowledged = acknowledged || (sends && node.controller->takes_own_acknowledge());
    if (out_of_time(node, sends)) error_at = std::min(error_at, kFirstErrorBit);
  }
  if ((senders & (senders - 1)) != 0) ++id_collisions_;
  for (FaultState& state : faults_) {
    if (state.fault.kind != BusFaultKind::corrupt) continue;
    const bool hit = state.fault.port == kEveryPort || (senders >> state.fault.port & 1u) != 0;
    if (hit && strikes(state, flight_.entry.frame, time_ns)) error_at = std::min(error_at, error_bit(state, flight_.entry.bits));
  }
  if (!acknowledged && error_at >= flight_.entry.bits - kAfterAckBits) {
    error_at = flight_.entry.bits - kAfterAckBits;
    flight_.ack_error = true;
  }
  flight_.error = error_at < flight_.entry.bits;
  const int length_bits = flight_.error ? error_at + 1 + kErrorFrameBits : flight_.entry.bits;
  flight_.end_ns = time_ns + bits_ns(length_bits);
  idle_from_ns_ = flight_.end_ns + bits_ns(kIntermissionBits);
  load_.add_busy(time_ns, idle_from_ns_);
  in_flight_ = true;
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i]->controller != nullptr) nodes_[i]->controller->on_start(time_ns, (senders >> i & 1u) != 0);
}

// A node with another bit time than the bus: it disturbs what it sends, and while it is error active also what it hears.
bool VirtualBus::out_of_time(const Port& node, bool sends) const {
  const BusController& controller = *node.controller;
  return !controller.in_time(bit_ns_) && (sends || (controller.acknowledges(flight_.start_ns) && !controller.passive()));
}

void VirtualBus::tell_controllers() {
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i]->controller != nullptr && !unplugged(*nodes_[i], flight_.end_ns))
      nodes_[i]->controller->on_end({.frame = &flight_.entry.frame,
                                     .start_ns = flight_.start_ns,
                                     .end_ns = flight_.end_ns,
                                     .own = (flight_.senders >> i & 1u) != 0,
                                     .error = flight_.error,
                                     .acknowledge_missing = flight_.ack_error});
}

void VirtualBus::finish() {
  in_flight_ = false;
  if (flight_.error) {
    finish_with_error();
  } else {
    finish_well();
  }
  tell_controllers();
  // ACK delimiter, end of frame and intermission (or error delimiter and intermission) are 11 recessive bits to a bus-off node.
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i]->recovery_left > 0 && (flight_.senders >> i & 1u) == 0) --nodes_[i]->recovery_left;
  }
}

void VirtualBus::finish_well() {
  int sender_port = -1;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if ((flight_.senders >> i & 1u) == 0) continue;
    Port& node = *nodes_[i];
    sender_port = node.number;
    ++node.counted.sent;
    if (node.controller == nullptr) node.tx.pop_best();
    node.count_good_transmission();
    if (node.passive()) node.suspended_until_ns = idle_from_ns_ + bits_ns(kSuspendBits);
    if (node.traffic != nullptr) refill(node, flight_.end_ns);
  }
  count_delivery(flight_.entry, flight_.start_ns, flight_.end_ns);
  deliver({.frame = flight_.entry.frame, .time_ns = flight_.end_ns}, flight_.senders);
  if (tap_) tap_({.frame = flight_.entry.frame, .start_ns = flight_.start_ns, .end_ns = flight_.end_ns, .port = sender_port});
}

void VirtualBus::finish_with_error() {
  ++error_frames_;
  int sender_port = -1;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Port& node = *nodes_[i];
    if ((flight_.senders >> i & 1u) != 0) {
      sender_port = node.number;
      ++node.counted.error_frames;
      node.count_transmit_error(flight_.ack_error);
      if (node.off()) node.counted.dropped_tx += node.tx.clear();
      if (node.passive()) node.suspended_until_ns = idle_from_ns_ + bits_ns(kSuspendBits);
    } else if (acknowledges(node, flight_.end_ns)) {
      node.count_receive_error();
    }
  }
  if (tap_)
    tap_({.frame = flight_.entry.frame, .start_ns = flight_.start_ns, .end_ns = flight_.end_ns, .port = sender_port, .error = true});
}

void VirtualBus::count_delivery(const TxEntry& entry, std::int64_t start_ns, std::int64_t end_ns) {
  ++frames_;
  const std::int64_t wait_ns = start_ns - entry.ready_ns;
  worst_wait_ns_ = std::max(worst_wait_ns_, wait_ns);
  IdStatistics* row = ids_.find_or_add(entry.frame.id, entry.frame.extended);
  if (row == nullptr) {
    ++ids_not_counted_;
    return;
  }
  ++row->frames;
  row->bus_bits += static_cast<std::uint64_t>(entry.bits + kIntermissionBits);
  row->worst_wait_ns = std::max(row->worst_wait_ns, wait_ns);
  row->worst_response_ns = std::max(row->worst_response_ns, end_ns - entry.ready_ns);
}

// Nodes whose bus-off time is over by time_ns, on a bus that has been idle since idle_from_ns_, return.
bool VirtualBus::restart_recovered(std::int64_t time_ns) {
  bool any = false;
  for (const auto& node : nodes_) {
    const std::int64_t back_ns = recovered_at_ns(*node);
    if (back_ns > time_ns) continue;
    any = true;
    node->restart();
    if (node->traffic != nullptr) refill(*node, back_ns);
  }
  return any;
}

std::int64_t VirtualBus::recovered_at_ns(const Port& node) const {
  if (!node.off() || !config_.recover_from_bus_off) return kNever_ns;
  return idle_from_ns_ + bits_ns(std::int64_t{kRecoveryBits} * node.recovery_left);
}

void VirtualBus::update_wake() {
  if (in_flight_) {
    wake_ns_ = flight_.end_ns;
    return;
  }
  const std::int64_t start_ns = next_start_ns();
  wake_ns_ = start_ns == kNever_ns ? kNever_ns : start_ns + 1;
  for (const auto& node : nodes_) wake_ns_ = std::min(wake_ns_, recovered_at_ns(*node));
}

std::int64_t VirtualBus::next_event_ns() const {
  std::int64_t next_ns = kNever_ns;
  if (in_flight_) {
    next_ns = flight_.end_ns;
  } else {
    const std::int64_t start_ns = next_start_ns();
    if (start_ns != kNever_ns) next_ns = start_ns + bits_ns(1 + kErrorFrameBits);  // nothing on the bus is shorter
    for (const auto& node : nodes_) next_ns = std::min(next_ns, recovered_at_ns(*node));
  }
  for (std::size_t i = 0; i < port_count_; ++i) {
    if (nodes_[i]->config.rx_latency_ns > 0) next_ns = std::min(next_ns, nodes_[i]->next_visible_ns(processed_ns_));
  }
  return next_ns;
}

BusStatistics VirtualBus::statistics() {
  load_.advance_to(processed_ns_);
  BusStatistics s;
  s.elapsed_ns = processed_ns_ - config_.start_ns;
  s.busy_ns = load_.busy_until_ns(processed_ns_);
  s.mean_load_percent = s.elapsed_ns > 0 ? 100.0 * static_cast<double>(s.busy_ns) / static_cast<double>(s.elapsed_ns) : 0.0;
  s.max_load_percent = load_.max_load_percent();
  s.frames = frames_;
  s.error_frames = error_frames_;
  s.id_collisions = id_collisions_;
  s.lost_by_fault = lost_by_fault_;
  s.missed_while_off = missed_while_off_;
  s.ids_not_counted = ids_not_counted_;
  s.worst_wait_ns = worst_wait_ns_;
  s.ids = ids_.rows();
  return s;
}

std::span<const float> VirtualBus::load_by_window_percent() {
  load_.advance_to(processed_ns_);
  return load_.window_load_percent();
}

}  // namespace rotorloop::sim
