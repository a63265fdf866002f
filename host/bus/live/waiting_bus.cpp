#include "host/bus/live/waiting_bus.hpp"

#include <utility>

#include "host/bus/live/live_clock.hpp"

namespace rotorloop {
namespace {

PortCounters sum(PortCounters a, const PortCounters& b) {
  a.sent += b.sent;
  a.received += b.received;
  a.dropped_tx += b.dropped_tx;
  a.dropped_rx += b.dropped_rx;
  a.error_frames += b.error_frames;
  a.filtered += b.filtered;
  return a;
}

LinkCounters sum(LinkCounters a, const LinkCounters& b) {
  a.malformed += b.malformed;
  a.remote += b.remote;
  a.error_reports += b.error_reports;
  a.own_echo += b.own_echo;
  a.fd_passed_over += b.fd_passed_over;
  a.refused_by_peer += b.refused_by_peer;
  a.receive_buffer_B = b.receive_buffer_B;
  a.no_buffer += b.no_buffer;
  a.stale += b.stale;
  a.fd_refused += b.fd_refused;
  a.unconfirmed += b.unconfirmed;
  return a;
}

}  // namespace

WaitingBus::WaitingBus(std::string name, std::function<std::unique_ptr<TimedBus>()> open) : name_(std::move(name)), open_(std::move(open)) {
  try_to_open();
}

void WaitingBus::try_to_open() {
  if (live_now_ns() < next_try_ns_) return;
  try {
    bus_ = open_();
    bus_->set_filters(filters_);
    next_try_ns_ = 0;
    if (!std::exchange(reported_, {}).empty()) notices_.push_back("it is there, going on");
  } catch (const Error& e) {
    if (e.exit_code() != ExitCode::device) throw;
    let_go(e);
  }
}

void WaitingBus::let_go(const Error& why) {
  before_ = counters();
  link_before_ = link_counters();
  bus_.reset();
  next_try_ns_ = live_now_ns() + kRetry_ns;
  if (std::exchange(reported_, why.text().what) != why.text().what) notices_.push_back(why.text().what + "; waiting for it");
}

SendStatus WaitingBus::send_any(const BusFrame& frame) {
  if (bus_) return bus_->send_any(frame);
  ++before_.dropped_tx;
  return SendStatus::bus_off;
}

std::optional<StampedBusFrame> WaitingBus::receive_any() {
  if (!bus_) try_to_open();
  if (!bus_) return std::nullopt;
  try {
    return bus_->receive_any();
  } catch (const Error& e) {
    if (e.exit_code() != ExitCode::device) throw;
    let_go(e);
    return std::nullopt;
  }
}

std::int64_t WaitingBus::now_ns() const { return live_now_ns(); }

void WaitingBus::wait_until(std::int64_t deadline_ns) {
  TimedBus* const alone = this;
  wait_for_any({&alone, 1}, deadline_ns);
}

PortCounters WaitingBus::counters() const { return bus_ ? sum(before_, bus_->counters()) : before_; }

LinkCounters WaitingBus::link_counters() const {
  LinkCounters c = bus_ ? sum(link_before_, bus_->link_counters()) : link_before_;
  c.fd_passed_over += fd_passed_over_;
  return c;
}

bool WaitingBus::set_filters(std::span<const CanFilter> filters) {
  if (filters.size() > kFilters) return false;
  filters_.assign(filters.begin(), filters.end());
  return !bus_ || bus_->set_filters(filters);
}

void WaitingBus::flush() {
  if (bus_) bus_->flush();
}

std::optional<std::string> WaitingBus::next_notice() {
  if (!notices_.empty()) {
    std::string notice = std::move(notices_.front());
    notices_.pop_front();
    return notice;
  }
  return bus_ ? bus_->next_notice() : std::nullopt;
}

}  // namespace rotorloop
