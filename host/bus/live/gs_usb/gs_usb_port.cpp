#include "host/bus/live/gs_usb/gs_usb_port.hpp"

#include <algorithm>
#include <utility>

#include "host/bus/live/live_clock.hpp"

namespace rotorloop::gs_usb {

GsUsbPort::GsUsbPort(const Settings& settings, std::shared_ptr<Adapter> adapter, std::function<std::int64_t()> now_ns)
    : settings_(settings), adapter_(std::move(adapter)), now_ns_(std::move(now_ns)) {
  const ChannelInfo info = adapter_->channel(settings_);
  timing_ = choose_timing(settings_, info);
  const bool stamped = info.has(kHardwareStamp);
  layout_ = {.fd = timing_.data.has_value(), .quirk = info.has(kQuirkLpc546xx)};
  mode_flags_ = (stamped ? kHardwareStamp : 0u) | (layout_.fd ? kFd : 0u) | (layout_.quirk ? kQuirkLpc546xx : 0u);
  if (!adapter_->attach(settings_.channel, *this, stamped))
    throw refusal(settings_, "channel " + std::to_string(settings_.channel) + " of this adapter is open in this program already", "",
                  "name another channel, as in gsusb:" + settings_.adapter + "/1");
  try {
    start();
  } catch (...) {
    adapter_->detach(settings_.channel);
    throw;
  }
}

// What a program sends last is a disarm: closing the channel at once would throw it away.
GsUsbPort::~GsUsbPort() {
  const std::int64_t end_ns = now_ns_() + kLastFrames_ns;
  while (!lost_ && state() != BusState::bus_off && (in_flight_.unconfirmed() > 0 || !queue_.empty()) && now_ns_() < end_ns) {
    adapter_->wait(end_ns - now_ns_());
    adapter_->pump();
  }
  adapter_->order_unheard(settings_.channel, Request::mode, encode_mode(kModeReset, 0));
  adapter_->detach(settings_.channel);
}

void GsUsbPort::start() {
  adapter_->order(settings_, Request::mode, encode_mode(kModeReset, 0));  // a program that was killed may have left it started
  adapter_->order(settings_, Request::bit_timing, encode_timing(timing_.nominal));
  if (timing_.data) adapter_->order(settings_, Request::data_bit_timing, encode_timing(*timing_.data));
  adapter_->order(settings_, Request::mode, encode_mode(kModeStart, mode_flags_));
}

SendStatus GsUsbPort::send_any(const BusFrame& frame) {
  if (lost_ || state() == BusState::bus_off) {
    ++counted_.dropped_tx;
    return SendStatus::bus_off;
  }
  const bool refused = frame.fd && !layout_.fd;
  link_.fd_refused += refused ? 1 : 0;
  if (refused || !queue_.push(frame, now_ns_())) {
    ++counted_.dropped_tx;
    return SendStatus::queue_full;
  }
  send_waiting();
  return SendStatus::queued;
}

// Echoes may wait in the system, for a caller that only sends.
void GsUsbPort::send_waiting() {
  submit_waiting();
  if (queue_.empty()) return;
  adapter_->pump();
  submit_waiting();
}

void GsUsbPort::submit_waiting() {
  if (queue_.empty() || lost_ || state() == BusState::bus_off) return;
  const std::size_t stale = queue_.drop_stale(now_ns_());
  link_.stale += stale;
  counted_.dropped_tx += stale;
  while (!queue_.empty() && !lost_) {
    const auto echo_id = in_flight_.begin(now_ns_());
    if (!echo_id) return;
    std::array<std::uint8_t, kLargest_B> bytes{};
    const std::size_t size = encode_frame(queue_.front(), *echo_id, settings_.channel, layout_, bytes);
    queue_.pop();
    const UsbStatus status = adapter_->submit(settings_.channel, *echo_id, std::span(bytes).first(size));
    if (status != UsbStatus::ok) transferred(*echo_id, false);
  }
}

void GsUsbPort::flush() {
  restart_when_due();
  send_waiting();
}

void GsUsbPort::transferred(std::uint32_t echo_id, bool whole) {
  if (!in_flight_.transferred(echo_id, whole)) return;
  ++link_.refused_by_peer;
  ++counted_.dropped_tx;
}

void GsUsbPort::take(const Message& m) {
  if (m.overflow) {
    ++counted_.dropped_rx;
    if (auto notice = errors_.take({.state = {}, .receive_overflow = true, .errors_tx_rx = {}})) notices_.push_back(std::move(*notice));
  }
  switch (m.content) {
    case Content::frame:
      return take_frame(m);
    case Content::echo:
      if (!in_flight_.confirmed(m.echo_id)) return malformed();
      ++counted_.sent;
      errors_.confirmed();
      lost_echoes_ += in_flight_.give_up_lost();
      return submit_waiting();
    case Content::remote:
      ++link_.remote;
      return;
    case Content::error_report:
      return take_report(m.report);
    case Content::malformed:
      return malformed();
  }
}

void GsUsbPort::take_frame(const Message& m) {
  StampedBusFrame received{.frame = m.frame, .time_ns = now_ns_()};
  if (m.stamp_us) received.time_ns = adapter_clock_.on_the_bus_ns(stamps_.unwrapped_ns(*m.stamp_us), received.time_ns);
  if (!wanted(m.frame.id, m.frame.extended)) {
    ++counted_.filtered;
  } else if (received_.size() >= kReceiveQueue) {
    ++counted_.dropped_rx;
  } else {
    received_.push_back(received);
  }
}

void GsUsbPort::take_report(const ErrorReport& report) {
  ++link_.error_reports;
  ++counted_.error_frames;
  if (auto notice = errors_.take(report)) notices_.push_back(std::move(*notice));
  if (state() != BusState::bus_off || restart_ns_ != INT64_MAX) return;
  restart_ns_ = now_ns_() + kRestart_ns;
  drop_waiting();
}

void GsUsbPort::drop_waiting() { counted_.dropped_tx += queue_.clear() + in_flight_.clear(); }

void GsUsbPort::restart_when_due() {
  if (restart_ns_ == INT64_MAX || lost_ || now_ns_() < restart_ns_) return;
  restart_ns_ = INT64_MAX;
  start();
  if (auto notice = errors_.take({.state = BusState::error_active, .restarted = true, .errors_tx_rx = {}}))
    notices_.push_back(std::move(*notice));
}

void GsUsbPort::lost(const std::string& why) {
  lost_ = why;
  restart_ns_ = INT64_MAX;
  drop_waiting();
}

std::optional<StampedBusFrame> GsUsbPort::receive_any() {
  restart_when_due();
  if (received_.empty()) adapter_->pump();
  if (!received_.empty()) {
    const StampedBusFrame first = received_.front();
    received_.pop_front();
    ++counted_.received;
    return first;
  }
  if (lost_)
    throw refusal(settings_, "the adapter is gone: " + *lost_, "", "plug it in and start again; commands with --wait go on by themselves");
  return std::nullopt;
}

void GsUsbPort::wait_until(std::int64_t deadline_ns) {
  TimedBus* const alone = this;
  wait_for_any({&alone, 1}, deadline_ns);
}

LinkCounters GsUsbPort::link_counters() const {
  LinkCounters counters = link_;
  counters.fd_passed_over = fd_passed_over_;
  counters.unconfirmed = in_flight_.unconfirmed() + lost_echoes_;
  return counters;
}

std::optional<std::string> GsUsbPort::next_notice() {
  if (notices_.empty()) return std::nullopt;
  std::string notice = std::move(notices_.front());
  notices_.pop_front();
  return notice;
}

}  // namespace rotorloop::gs_usb
