// A whole board without hardware: the power stage of fake_board.hpp, a CAN controller with three transmit mailboxes and a queue of 64
// received frames, classic and FD, and a watchdog that counts. The test plays the bus and the clock.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/board/application_board.hpp"
#include "firmware/board/fake/fake_board.hpp"
#include "firmware/core/node/transmit_queue.hpp"

namespace rotorloop::firmware {

class FakeCan {
 public:
  static constexpr bool kFd = true;
  static constexpr std::size_t kMailboxes = 3, kFilters = 14, kReceived = 64;
  static constexpr std::uint64_t kRecovery_us = 128 * 11;  // at 1 Mbit/s on an idle bus

  // The board's side.
  bool ready() const { return state_ != BusState::bus_off && mailboxes_.room() > 0; }
  bool send(const CanFrame& frame) { return ready() && mailboxes_.push(frame, now_us_); }
  bool send(const CanFdFrame& frame) {
    if (state_ == BusState::bus_off || fd_mailbox_) return false;
    fd_mailbox_ = frame;
    return true;
  }
  std::optional<Received<CanFrame>> receive() {
    if (read_ == written_) return std::nullopt;
    return received_[read_++ % kReceived];
  }
  std::optional<Received<CanFdFrame>> receive_fd() {
    const auto frame = received_fd_;
    received_fd_.reset();
    return frame;
  }
  bool set_filters(std::span<const CanFilter> filters) {
    if (filters.size() > kFilters) return false;
    std::copy(filters.begin(), filters.end(), filters_.begin());
    filter_count_ = filters.size();
    return true;
  }
  BusState state() const { return state_; }
  void recover() {
    if (state_ == BusState::bus_off && !recovered_at_us_) recovered_at_us_ = now_us_ + kRecovery_us;
  }

  // The test's side.
  void advance_to(std::uint64_t now_us) {
    now_us_ = now_us;
    if (!recovered_at_us_ || now_us < *recovered_at_us_) return;
    recovered_at_us_.reset();
    state_ = BusState::error_active;
  }
  void fail() {  // too many errors: what waits is lost
    state_ = BusState::bus_off;
    mailboxes_.clear();
    fd_mailbox_.reset();
  }
  std::optional<CanFrame> take_sent() { return mailboxes_.pop(); }
  std::optional<CanFdFrame> take_sent_fd() {
    const auto frame = fd_mailbox_;
    fd_mailbox_.reset();
    return frame;
  }
  bool deliver(const CanFrame& frame) {
    if (!hears(frame.id, frame.extended) || written_ - read_ == kReceived) return false;
    received_[written_++ % kReceived] = {frame, now_us_};
    return true;
  }
  bool deliver(const CanFdFrame& frame) {
    if (!hears(frame.id, frame.extended) || received_fd_) return false;
    received_fd_ = {frame, now_us_};
    return true;
  }

 private:
  bool hears(std::uint32_t id, bool extended) const {
    const auto end = filters_.begin() + static_cast<std::ptrdiff_t>(filter_count_);
    return state_ != BusState::bus_off &&
           (filter_count_ == 0 || std::any_of(filters_.begin(), end, [&](const CanFilter& f) { return f.fits(id, extended); }));
  }

  TransmitQueue<kMailboxes> mailboxes_;
  std::array<Received<CanFrame>, kReceived> received_{};
  std::optional<Received<CanFdFrame>> received_fd_{};
  std::optional<CanFdFrame> fd_mailbox_{};
  std::array<CanFilter, kFilters> filters_{};
  std::size_t filter_count_ = 0, read_ = 0, written_ = 0;
  std::optional<std::uint64_t> recovered_at_us_{};
  std::uint64_t now_us_ = 0;
  BusState state_ = BusState::error_active;
};
static_assert(CanPort<FakeCan>);

class FakeEscBoard : public FakeBoard {
 public:
  static constexpr std::uint32_t kUpdateRecordPage = 2;
  FakeCan& can() { return can_; }
  ResetCause reset_cause() const { return cause; }
  void restart() { restart_wanted = true; }
  void kick_watchdog() { ++kicks; }
  void advance_to(std::uint64_t time_us) {
    now_us = time_us;
    can_.advance_to(time_us);
  }

  ResetCause cause = ResetCause::power_on;
  bool restart_wanted = false;
  std::uint64_t kicks = 0;

 private:
  FakeCan can_;
};
static_assert(EscBoard<FakeEscBoard>);

}  // namespace rotorloop::firmware
