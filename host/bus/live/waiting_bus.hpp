// A bus that may come and go: opened when it is there, and again after it went away (an interface set down, an adapter unplugged). For
// whoever listens or is an ESC; what commands motors must end with its bus instead.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/base/error.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop {

class WaitingBus final : public TimedBus {
 public:
  static constexpr std::int64_t kRetry_ns = 100'000'000;

  // `open` throws Error: of ExitCode::device while the bus cannot be had, which is waited for; of any other code for what waiting does not
  // mend, which is passed on.
  WaitingBus(std::string name, std::function<std::unique_ptr<TimedBus>()> open);

  SendStatus send_any(const BusFrame& frame) override;  // bus_off while it is away
  std::optional<StampedBusFrame> receive_any() override;
  std::int64_t now_ns() const override;
  void wait_until(std::int64_t deadline_ns) override;
  BusState state() const override { return bus_ ? bus_->state() : BusState::bus_off; }
  PortCounters counters() const override;  // of all connections together
  LinkCounters link_counters() const override;
  bool set_filters(std::span<const CanFilter> filters) override;
  std::string name() const override { return name_; }
  int descriptor() const override { return bus_ ? bus_->descriptor() : -1; }
  bool output_waits() const override { return bus_ && bus_->output_waits(); }
  void flush() override;
  std::int64_t next_flush_ns() const override { return bus_ ? bus_->next_flush_ns() : next_try_ns_; }
  bool input_waits() const override { return bus_ && bus_->input_waits(); }
  std::optional<std::string> next_notice() override;

 private:
  void try_to_open();
  void let_go(const Error& why);

  std::string name_;
  std::function<std::unique_ptr<TimedBus>()> open_;
  std::unique_ptr<TimedBus> bus_;
  std::vector<CanFilter> filters_;
  std::int64_t next_try_ns_ = 0;
  std::string reported_;  // why it is away
  std::deque<std::string> notices_;
  PortCounters before_;  // of connections that ended, and of frames while there was none
  LinkCounters link_before_;
};

}  // namespace rotorloop
