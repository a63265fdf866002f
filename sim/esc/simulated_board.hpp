// The board of a simulated ESC as its main loop sees it (firmware/board/application_board.hpp): a port of a bus, the time of the simulation
// and a flash. `Flash`: pages 0 and 1 parameters, 2 the record of an update.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "firmware/board/application_board.hpp"
#include "firmware/board/fake/memory_flash.hpp"
#include "host/bus/can_bus.hpp"

namespace rotorloop::sim {

// A CAN controller on a port of any bus. The queue of the port is the controller's: it drops what is sent while it is full or bus off.
class SimulatedCan {
 public:
  static constexpr bool kFd = false;
  SimulatedCan(CanBus& bus, std::int64_t delay_us) : bus_(&bus), delay_us_(delay_us) {}

  bool ready() const { return true; }
  bool send(const CanFrame& frame) {
    if (delay_us_ == 0) return bus_->send(frame) == SendStatus::queued;
    held_.push_back({now_us_ + delay_us_, frame});
    return true;
  }
  std::optional<firmware::Received<CanFrame>> receive() {
    const auto received = bus_->receive();
    if (!received) return std::nullopt;
    // The port's stamp is of another clock than the board's (of the machine on a live bus): the turn that takes a frame counts as its end.
    return firmware::Received<CanFrame>{received->frame, static_cast<std::uint64_t>(now_us_)};
  }
  bool set_filters(std::span<const CanFilter> filters) { return bus_->set_filters(filters); }
  BusState state() const { return bus_->state(); }
  void recover() {}  // every bus of the toolkit lets a port take part again by itself

  void advance_to(std::int64_t now_us) {
    now_us_ = now_us;
    release();
  }
  // Sends the frames whose delay is over.
  void release() {
    for (; !held_.empty() && held_.front().due_us <= now_us_; held_.pop_front()) bus_->send(held_.front().frame);
  }

 private:
  struct Held {
    std::int64_t due_us;
    CanFrame frame;
  };
  CanBus* bus_;
  std::int64_t delay_us_, now_us_ = 0;
  std::deque<Held> held_;  // frames on their way through a slow gateway
};

template <class Flash = firmware::MemoryFlash>
class SimulatedBoard : public Flash {
 public:
  static constexpr std::uint32_t kUpdateRecordPage = 2;
  SimulatedBoard(CanBus& bus, std::int64_t report_delay_us, Flash pages) : Flash(pages), can_(bus, report_delay_us) {}

  SimulatedCan& can() { return can_; }
  std::uint64_t time_us() const { return now_us_; }
  firmware::ResetCause reset_cause() const { return cause_; }
  void restart() { restart_wanted_ = true; }
  void kick_watchdog() { ++kicks_; }

  void advance_to(std::int64_t now_us) {
    now_us_ = static_cast<std::uint64_t>(now_us);
    can_.advance_to(now_us);
  }
  bool restart_wanted() const { return restart_wanted_; }
  void started_by(firmware::ResetCause cause) {
    cause_ = cause;
    restart_wanted_ = false;
  }
  std::uint64_t kicks() const { return kicks_; }

 private:
  SimulatedCan can_;
  std::uint64_t now_us_ = 0, kicks_ = 0;
  firmware::ResetCause cause_ = firmware::ResetCause::power_on;
  bool restart_wanted_ = false;
};
static_assert(firmware::ApplicationBoard<SimulatedBoard<>>);

}  // namespace rotorloop::sim
