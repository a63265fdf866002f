// The host's end of the fast channel for one group of four ESCs: set-points with a running sequence, and what came back of
// each ESC (age, loss, round trip). No heap, no clock: made for the 1 kHz path.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "protocols/can_frame.hpp"
#include "protocols/fast_channel.hpp"

namespace rotorloop::host {

struct EscFeedback {
  protocols::fast::Feedback last;   // as received; see its helpers for SI
  std::int64_t arrival_us = 0;      // of the last feedback
  std::int64_t round_trip_us = -1;  // set-point handed to the bus until its feedback arrived; -1 before the first
  std::int64_t worst_round_trip_us = -1;
  std::uint32_t received = 0;
  std::uint32_t lost = 0;        // answers missing by sequence number
  std::uint32_t unexpected = 0;  // answers to a set-point that was not sent lately
  bool heard = false;

  // Time since the last feedback; the largest value before the first.
  std::int64_t age_us(std::int64_t now_us) const;
};

class EscGroup {
 public:
  // A set-point older than this is not what an answer refers to: its number has been used again, or sending had stopped.
  static constexpr std::int64_t kAnswerWindow_us = 50'000;

  // `feedback_divider`: every n-th set-point is answered (1000 / fast_feedback_Hz of the ESCs: 1, 2 or 4).
  explicit EscGroup(std::uint8_t group, int feedback_divider = 1);

  // The next set-point frame, with the time at which it is handed to the bus. rad/s, duty -1..1 or A; NaN is "no order".
  CanFrame encode(protocols::fast::SetpointMode mode, const std::array<float, 4>& values, std::int64_t now_us);

  // True when the frame was feedback of this group.
  bool on_frame(const CanFrame& frame, std::int64_t arrival_us);

  const EscFeedback& esc(int slot) const { return escs_[static_cast<std::size_t>(slot)]; }
  std::uint8_t group() const { return group_; }
  std::uint8_t sequence() const { return sequence_; }  // of the last set-point

 private:
  std::array<EscFeedback, 4> escs_{};
  std::array<std::int64_t, protocols::fast::kSequenceModulo> sent_us_{};
  std::array<bool, protocols::fast::kSequenceModulo> sent_{};
  std::uint8_t group_;
  std::uint8_t divider_;
  std::uint8_t sequence_ = 0;
};

}  // namespace rotorloop::host
