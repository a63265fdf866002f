// The queue holds slot numbers, not frames: moving an entry in the order costs two bytes per place.
#include "sim/world/tx_queue.hpp"

#include <algorithm>
#include <limits>

#include "host/bus/frame_bits.hpp"
#include "sim/world/virtual_time.hpp"

namespace rotorloop::sim {

TxEntry tx_entry(const CanFrame& frame, std::int64_t ready_ns) {
  return {.frame = frame, .key = arbitration_key(frame), .bits = frame_bits(frame), .ready_ns = ready_ns};
}

TxQueue::TxQueue(std::size_t depth) : slots_(depth), waiting_(depth) {
  free_.reserve(depth);
  sorted_.reserve(depth);
  for (std::size_t i = depth; i > 0; --i) free_.push_back(static_cast<std::uint16_t>(i - 1));
}

bool TxQueue::push(const TxEntry& entry) {
  if (free_.empty()) return false;
  const std::uint16_t slot = free_.back();
  free_.pop_back();
  slots_[slot] = entry;
  last_ready_ns_ = std::max(last_ready_ns_, entry.ready_ns);
  slots_[slot].ready_ns = last_ready_ns_;
  std::size_t tail = waiting_head_ + waiting_count_;
  if (tail >= waiting_.size()) tail -= waiting_.size();
  waiting_[tail] = slot;
  ++waiting_count_;
  return true;
}

void TxQueue::admit(std::int64_t time_ns) {
  while (waiting_count_ > 0) {
    const std::uint16_t slot = waiting_[waiting_head_];
    if (slots_[slot].ready_ns > time_ns) return;
    if (++waiting_head_ == waiting_.size()) waiting_head_ = 0;
    --waiting_count_;
    // Behind every entry of equal key (they are older), before every entry of a higher key.
    const auto place = std::find_if(sorted_.begin(), sorted_.end(), [&](std::uint16_t s) { return slots_[s].key <= slots_[slot].key; });
    sorted_.insert(place, slot);
  }
}

void TxQueue::pop_best() {
  free_.push_back(sorted_.back());
  sorted_.pop_back();
}

std::size_t TxQueue::clear() {
  const std::size_t thrown = size();
  while (!sorted_.empty()) pop_best();
  for (; waiting_count_ > 0; --waiting_count_) {
    free_.push_back(waiting_[waiting_head_]);
    if (++waiting_head_ == waiting_.size()) waiting_head_ = 0;
  }
  return thrown;
}

std::int64_t TxQueue::earliest_ns() const {
  if (!sorted_.empty()) return std::numeric_limits<std::int64_t>::min();
  return waiting_count_ > 0 ? slots_[waiting_[waiting_head_]].ready_ns : kNever_ns;
}

}  // namespace rotorloop::sim
