// What one CAN controller has to send: bounded, no allocation after construction, ordered by identifier and, for equal
// identifiers, by age (a multi-frame transfer falls apart if its frames overtake each other). A frame is entered with the time
// from which it may take part in arbitration; until then it cannot win.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocols/can_frame.hpp"

namespace rotorloop::sim {

struct TxEntry {
  CanFrame frame;
  std::uint32_t key = 0;      // arbitration field, lower wins
  std::int32_t bits = 0;      // start to end of frame, stuff bits included
  std::int64_t ready_ns = 0;  // the controller has it
};

TxEntry tx_entry(const CanFrame& frame, std::int64_t ready_ns);

class TxQueue {
 public:
  explicit TxQueue(std::size_t depth);

  bool push(const TxEntry& entry);   // false: full. ready_ns is raised to that of the entry before, if earlier
  void admit(std::int64_t time_ns);  // entries ready at time_ns take part from now on
  const TxEntry* best() const { return sorted_.empty() ? nullptr : &slots_[sorted_.back()]; }
  void pop_best();
  std::size_t clear();  // returns how many were thrown away
  std::size_t size() const { return sorted_.size() + waiting_count_; }
  // Earliest time at which an entry can take part: below any clock when one already does, kNever_ns when empty.
  std::int64_t earliest_ns() const;

 private:
  std::vector<TxEntry> slots_;
  std::vector<std::uint16_t> free_;
  std::vector<std::uint16_t> sorted_;   // admitted; best at the back
  std::vector<std::uint16_t> waiting_;  // ring, in the order of push
  std::size_t waiting_head_ = 0;
  std::size_t waiting_count_ = 0;
  std::int64_t last_ready_ns_ = 0;
};

}  // namespace rotorloop::sim
