// What a CAN controller reports of its bus: error frames as Linux has them (linux/can/error.h; gs_usb adapters send the same) into a state,
// and one sentence a change. Pure.
#pragma once
#include <linux/can.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "protocols/can_controller.hpp"

namespace rotorloop {

struct ErrorReport {
  std::optional<BusState> state;  // where the report says one
  bool warning = false;           // a counter of errors is above 96: still active
  bool receive_overflow = false;  // the controller's own buffer was full
  bool no_acknowledge = false;    // nobody heard the frame
  bool restarted = false;
  bool bus_error = false;                                   // bit, stuff, form or CRC error, or the transceiver
  std::optional<std::array<std::uint8_t, 2>> errors_tx_rx;  // the controller's counters; where the kernel gives them
};

// `raw`: a frame with CAN_ERR_FLAG.
ErrorReport decode_error_report(const canfd_frame& raw);

class ErrorState {
 public:
  // `after_bus_off`: what brings this backend back to the bus, for people.
  explicit ErrorState(std::string after_bus_off) : after_bus_off_(std::move(after_bus_off)) {}
  BusState state() const { return state_; }
  // One sentence when something changed, none for a report that says what was known.
  std::optional<std::string> take(const ErrorReport& report);
  // A frame of ours was on the bus: somebody acknowledged it.
  void confirmed() { nobody_ = false; }

 private:
  std::string after_bus_off_;
  BusState state_ = BusState::error_active;
  bool warning_ = false, nobody_ = false, overflow_reported_ = false;
};

}  // namespace rotorloop
