// Which order the motor follows now: arming, freshness and limits of the DroneCAN commands and of the fast channel. No frames
// here, only their content, so that the rules can be read and tested by themselves:
//  - no order without arming (if required); ArmingStatus 0 always stops and asks for a new 255
//  - an order lives as long as its own time-out, and only orders for this ESC of its own kind renew it
//  - the fast channel goes before DroneCAN while it is fresh; when it expires, a fresh DroneCAN command takes over, else stop
//  - a fast set-point whose sequence is the same or older than half the range is refused
//  - orders beyond the parameters are clamped; an order of zero speed or zero duty is a stop
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "firmware/core/interface.hpp"
#include "protocols/fast_channel.hpp"
#include "protocols/types.hpp"

namespace rotorloop::firmware {

// Compiled in, not switchable on a target: tests build a node without one rule to show the damage it prevents.
struct NodeRules {
  bool command_timeout = true;             // DroneCAN commands expire
  bool fast_timeout = true;                // fast set-points expire
  bool only_active_setpoint_feeds = true;  // other traffic renews nothing
  bool refuse_old_sequence = true;
  bool disarm_latches = true;  // after ArmingStatus 0 nothing runs before the next 255
};

struct CommandCounters {
  std::uint32_t raw_commands = 0, rpm_commands = 0, fast_setpoints = 0;  // accepted, for this ESC
  std::uint32_t not_addressed = 0;                                       // command array too short for this ESC
  std::uint32_t fast_no_order = 0;                                       // fast set-point without an order for this ESC
  std::uint32_t fast_duplicate = 0;                                      // refused: same sequence again
  std::uint32_t fast_old_sequence = 0;                                   // refused: older than half the range
  std::uint32_t fast_lost = 0;                                           // set-points missing by sequence number
  std::uint32_t not_armed = 0;                                           // orders ignored for want of arming
  std::uint32_t clamped = 0;                                             // orders beyond the limits of the parameters
  std::uint32_t command_timeouts = 0, fast_timeouts = 0;
  std::uint32_t fallbacks = 0;       // fast channel expired and a DroneCAN command took over
  std::uint32_t disarmed = 0;        // ArmingStatus 0 while armed
  std::uint32_t arming_unknown = 0;  // ArmingStatus neither 0 nor 255: taken as 0
};

template <NodeRules kRules>
class CommandInput {
 public:
  explicit constexpr CommandInput(const Parameters& p) : p_(p), armed_(!p.require_arming) {}

  constexpr bool armed() const { return armed_; }
  constexpr const CommandCounters& counters() const { return counters_; }
  // Sequence of the last accepted fast set-point.
  constexpr std::uint8_t fast_sequence() const { return sequence_; }

  constexpr void on_arming(std::uint8_t status) {
    using protocols::ArmingStatus;
    if (status == ArmingStatus::kFullyArmed) {
      armed_ = true;
      return;
    }
    if (status != ArmingStatus::kDisarmed) ++counters_.arming_unknown;
    if (armed_) ++counters_.disarmed;
    if (kRules.disarm_latches) armed_ = false;
    command_.present = fast_.present = false;
  }

  constexpr void on_raw(const protocols::RawCommand& c, std::uint64_t now_us) {
    if (p_.esc_index >= c.count) {
      ++counters_.not_addressed;
      return;
    }
    ++counters_.raw_commands;
    take(command_, Mode::duty, static_cast<float>(c.command[p_.esc_index]) / static_cast<float>(protocols::RawCommand::kFullScale), now_us);
  }

  constexpr void on_rpm(const protocols::RpmCommand& c, std::uint64_t now_us) {
    if (p_.esc_index >= c.count) {
      ++counters_.not_addressed;
      return;
    }
    ++counters_.rpm_commands;
    take(command_, Mode::speed, static_cast<float>(c.rpm[p_.esc_index]) * protocols::fast::kRadPerSecondPerRpm, now_us);
  }

  // For the group of this ESC. False when it is refused by its sequence.
  constexpr bool on_fast(const protocols::fast::Setpoint& s, std::uint64_t now_us) {
    namespace fast = protocols::fast;
    // After a silence any sequence starts anew: the sender may have restarted.
    const bool running = heard_ && now_us - heard_us_ <= fast_timeout_us();
    if (running) {
      const std::uint8_t ahead = fast::sequence_ahead(s.sequence, sequence_);
      if (kRules.refuse_old_sequence && (ahead == 0 || ahead >= fast::kSequenceHalfRange)) {
        ++(ahead == 0 ? counters_.fast_duplicate : counters_.fast_old_sequence);
        return false;
      }
      if (ahead > 1 && ahead < fast::kSequenceHalfRange) counters_.fast_lost += ahead - 1u;
    }
    heard_ = true;
    heard_us_ = now_us;
    sequence_ = s.sequence;
    const int slot = p_.esc_index % fast::kEscsPerGroup;
    if (s.raw[static_cast<std::size_t>(slot)] == fast::kNoOrder) {
      ++counters_.fast_no_order;
      return true;
    }
    ++counters_.fast_setpoints;
    const Mode mode = s.mode == fast::SetpointMode::rpm ? Mode::speed : s.mode == fast::SetpointMode::duty ? Mode::duty : Mode::current;
    take(fast_, mode, s.get(slot), now_us);
    return true;
  }

  // Anything heard on the bus; renews an order only when the rule against it is compiled out.
  constexpr void on_other_traffic(std::uint64_t now_us) {
    if (kRules.only_active_setpoint_feeds) return;
    command_.time_us = fast_.time_us = now_us;
  }

  // What the motor shall do at this instant. Pure: may be called from the control loop as often as it likes.
  constexpr Setpoint setpoint(std::uint64_t now_us) const {
    if (!armed_) return {};
    if (fresh(fast_, now_us, fast_timeout_us(), kRules.fast_timeout)) return {fast_.mode, fast_.value};
    if (fresh(command_, now_us, command_timeout_us(), kRules.command_timeout)) return {command_.mode, command_.value};
    return {};
  }

  // Forgets expired orders and counts them; call at least every time-out.
  constexpr void expire(std::uint64_t now_us) {
    const bool command_ok = fresh(command_, now_us, command_timeout_us(), kRules.command_timeout);
    if (fast_.present && !fresh(fast_, now_us, fast_timeout_us(), kRules.fast_timeout)) {
      fast_.present = false;
      ++counters_.fast_timeouts;
      if (command_ok) ++counters_.fallbacks;
    }
    if (command_.present && !command_ok) {
      command_.present = false;
      ++counters_.command_timeouts;
    }
  }

 private:
  struct Order {
    std::uint64_t time_us = 0;
    float value = 0.0f;
    Mode mode = Mode::off;
    bool present = false;
  };

  constexpr std::uint64_t command_timeout_us() const { return p_.command_timeout_ms * std::uint64_t{1000}; }
  constexpr std::uint64_t fast_timeout_us() const { return p_.fast_timeout_ms * std::uint64_t{1000}; }

  // A time stamp ahead of `now` wraps to a huge age and counts as stale: the safe side.
  static constexpr bool fresh(const Order& o, std::uint64_t now_us, std::uint64_t timeout_us, bool rule) {
    return o.present && (!rule || now_us - o.time_us <= timeout_us);
  }

  constexpr void take(Order& order, Mode mode, float value, std::uint64_t now_us) {
    if (!armed_) {
      ++counters_.not_armed;
      order.present = false;
      return;
    }
    const float limit = mode == Mode::duty ? 1.0f : mode == Mode::speed ? p_.max_speed_rad_s : p_.phase_current_limit_A;
    float v = std::clamp(value, -limit, limit);
    if (mode == Mode::speed && v != 0.0f && std::fabs(v) < p_.min_speed_rad_s) v = std::copysign(p_.min_speed_rad_s, v);
    if (v != value) ++counters_.clamped;
    if (mode != Mode::current && v == 0.0f) mode = Mode::off;
    order = {.time_us = now_us, .value = v, .mode = mode, .present = true};
  }

  Parameters p_;
  Order command_{}, fast_{};
  CommandCounters counters_{};
  std::uint64_t heard_us_ = 0;
  std::uint8_t sequence_ = 0;
  bool heard_ = false;
  bool armed_;
};

}  // namespace rotorloop::firmware
