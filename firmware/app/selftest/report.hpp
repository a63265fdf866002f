// What a check found, as one line of JSON: over the serial line, and as LogMessage over the bus.
#pragma once
#include <cstdint>

#include "protocols/transfer.hpp"
#include "protocols/types/debug.hpp"

namespace rotorloop::selftest {

struct Finding {
  const char* check;
  std::int32_t value, low, high;
  const char* unit;
  constexpr bool ok() const { return value >= low && value <= high; }
};

class Report {
 public:
  static constexpr std::uint8_t kNodeId = 100;  // fixed: nothing is allocated on a bus that is not known to work
  // Returns when the line is out and the frames are sent, or nobody has acknowledged them for kBus_us.
  void tell(const Finding& f);
  // The last line: how many checks failed. It is no check, and is not counted as one.
  void tell_failed();
  // NodeStatus, so that a tool lists the node.
  void tell_status();
  std::int32_t failed() const { return failed_; }

 private:
  static constexpr std::uint32_t kLine_us = 10'000;  // 92 characters at 115 200 Bd: 8 ms
  static constexpr std::uint32_t kBus_us = 20'000;
  void say(const Finding& f);
  template <class Message>
  void broadcast(const Message& m, std::uint8_t priority, protocols::TransferIdCounter& ids);
  protocols::TransferIdCounter log_ids_, status_ids_;
  std::int32_t failed_ = 0;
};

}  // namespace rotorloop::selftest
