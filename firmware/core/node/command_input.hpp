// Which order the motor follows now: arming, freshness and limits of the DroneCAN commands and of the fast channel. No frames
// here, only their content, so that the rules can be read and tested by themselves:
//  - no order without arming (if required); ArmingStatus 0 always stops and asks for a new 255
//  - an order lives as long as its own time-out, and only orders for this ESC of its own kind renew it; a DroneCAN command is taken to
//    have been on its way for a while already when it arrives
//  - the fast channel goes before DroneCAN while it is fresh; when it expires, a fresh DroneCAN command takes over, else stop
//  - a fast set-point whose sequence is the same or older than half the range is refused
//  - orders beyond the parameters are clamped; an order of zero speed or zero duty is a stop
//  - negative orders of speed and duty stop unless `bidirectional`; a negative current brakes, and turns no resting rotor backwards
//  - without an index no command is for this ESC
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "firmware/core/interface.hpp"
#include "firmware/core/node/main_loop.hpp"
#include "protocols/fast_channel.hpp"
#include "protocols/types.hpp"

namespace rotorloop::firmware {

// No parameter and nothing on the bus switches them: tests build a node without one rule to show the damage it prevents.
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
  std::uint32_t fallbacks = 0;         // fast channel expired and a DroneCAN command took over
  std::uint32_t disarmed = 0;          // ArmingStatus 0 while armed
  std::uint32_t arming_unknown = 0;    // ArmingStatus neither 0 nor 255: taken as 0
  std::uint32_t negative = 0;          // orders to turn backwards while that is not allowed
  std::uint32_t zero_awaited = 0;      // orders before the first zero after arming, where one is asked for
  std::uint32_t second_commander = 0;  // orders from another node than the last one, within a second of it
};

// Why no order is followed now.
enum class OrderState : std::uint8_t { following, not_armed, none_yet, expired, zero, zero_awaited };

class CommandInput {
 public:
  explicit constexpr CommandInput(const Parameters& p, const NodeRules& rules = {})
      : rules_(rules), p_(p), armed_(!p.require_arming), zero_seen_(!p.zero_first) {
    set_lives();
  }

  // New parameters, while the motor is off: orders from before are forgotten.
  constexpr void apply(const Parameters& p) {
    if (p.require_arming && !p_.require_arming) armed_ = false;
    if (!p.require_arming) armed_ = true;
    p_ = p;
    set_lives();
    command_.present = fast_.present = false;
  }
  // The node whose order was taken last; 0: none yet.
  constexpr std::uint8_t commander() const { return commander_; }
  // The other one of two that order at the same time; 0: there is none.
  constexpr std::uint8_t second_commander(std::uint64_t now_us) const {
    return second_ != 0 && now_us - second_us_ <= kTwoCommanders_us ? second_ : std::uint8_t{0};
  }
  // Somebody asks this ESC to turn, followed or not.
  constexpr bool wanted(std::uint64_t now_us) const { return asked_us_ != 0 && now_us - asked_us_ <= command_timeout_us(); }
  // Orders for this ESC arrive, of whatever value, followed or not.
  constexpr bool commanded(std::uint64_t now_us) const { return ordered_us_ != 0 && now_us - ordered_us_ <= command_timeout_us(); }
  constexpr OrderState order_state(std::uint64_t now_us) const {
    if (!armed_) return OrderState::not_armed;
    if (!zero_seen_) return OrderState::zero_awaited;
    if (setpoint(now_us).mode != Mode::off) return OrderState::following;
    const bool fresh_zero = fresh(fast_, now_us, fast_life_us_) || fresh(command_, now_us, command_life_us_);
    return fresh_zero ? OrderState::zero : ever_ ? OrderState::expired : OrderState::none_yet;
  }

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
    zero_seen_ = !p_.zero_first;
    if (status != ArmingStatus::kDisarmed) ++counters_.arming_unknown;
    if (armed_) ++counters_.disarmed;
    if (rules_.disarm_latches) armed_ = false;
    command_.present = fast_.present = false;
  }

  constexpr void on_raw(const protocols::RawCommand& c, std::uint64_t now_us, std::uint8_t source = 0) {
    if (p_.esc_index >= c.count) {
      ++counters_.not_addressed;
      return;
    }
    ++counters_.raw_commands;
    note_commander(source, now_us);
    float share = static_cast<float>(c.command[p_.esc_index]) / static_cast<float>(protocols::RawCommand::kFullScale);
    if (std::fabs(share) < p_.raw_deadband) share = 0.0f;
    // Autopilots arm with the least command above zero and expect propellers that turn: a duty that could not hold the minimum speed asks
    // for that speed. At the bus voltage that brings max_speed, duty and speed go with each other; below kLeastDuty no motor starts.
    if (p_.raw_mode == RawMode::duty && share != 0.0f && std::fabs(share) < std::max(kLeastDuty, p_.min_speed_rad_s / p_.max_speed_rad_s))
      return take(command_, Mode::speed, std::copysign(p_.min_speed_rad_s, share), now_us);
    if (p_.raw_mode == RawMode::duty) return take(command_, Mode::duty, share, now_us);
    const float of_max = p_.raw_mode == RawMode::speed ? share : std::copysign(std::sqrt(std::fabs(share)), share);
    take(command_, Mode::speed, of_max * p_.max_speed_rad_s, now_us);
  }

  constexpr void on_rpm(const protocols::RpmCommand& c, std::uint64_t now_us, std::uint8_t source = 0) {
    if (p_.esc_index >= c.count) {
      ++counters_.not_addressed;
      return;
    }
    ++counters_.rpm_commands;
    note_commander(source, now_us);
    take(command_, Mode::speed, static_cast<float>(c.rpm[p_.esc_index]) * protocols::fast::kRadPerSecondPerRpm, now_us);
  }

  // For the group of this ESC. False when it is refused by its sequence.
  constexpr bool on_fast(const protocols::fast::Setpoint& s, std::uint64_t now_us) {
    namespace fast = protocols::fast;
    // After a silence any sequence starts anew: the sender may have restarted.
    const bool running = heard_ && now_us - heard_us_ <= fast_timeout_us();
    if (running) {
      const std::uint8_t ahead = fast::sequence_ahead(s.sequence, sequence_);
      if (rules_.refuse_old_sequence && (ahead == 0 || ahead >= fast::kSequenceHalfRange)) {
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

  // Anything heard on the bus; renews an order only when the rule against it is off.
  constexpr void on_other_traffic(std::uint64_t now_us) {
    if (rules_.only_active_setpoint_feeds) return;
    command_.time_us = fast_.time_us = now_us;
  }

  // What the motor shall do at this instant, in its own sense of rotation. Pure: may be called from the control loop as often as it
  // likes.
  constexpr Setpoint setpoint(std::uint64_t now_us) const {
    if (!armed_) return {};
    if (fresh(fast_, now_us, fast_life_us_)) return to_motor(fast_);
    if (fresh(command_, now_us, command_life_us_)) return to_motor(command_);
    return {};
  }
  // The speed in the sense of the orders, for the rule on negative currents.
  constexpr void set_speed(float omega_rad_s) { omega_rad_s_ = omega_rad_s; }

  // Forgets expired orders and counts them; call at least every time-out.
  constexpr void expire(std::uint64_t now_us) {
    const bool command_ok = fresh(command_, now_us, command_life_us_);
    if (fast_.present && !fresh(fast_, now_us, fast_life_us_)) {
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

  constexpr std::uint64_t command_timeout_us() const { return p_.command_timeout_ms * std::uint64_t{1000} - kOnItsWay_us; }
  constexpr std::uint64_t fast_timeout_us() const { return p_.fast_timeout_ms * std::uint64_t{1000}; }

  // A time stamp ahead of `now` wraps to a huge age and counts as stale: the safe side.
  static constexpr bool fresh(const Order& o, std::uint64_t now_us, std::uint64_t life_us) {
    return o.present && now_us - o.time_us <= life_us;
  }
  // Computed once, as the control loop asks at every sample. Without the rule of its time-out an order lives for ever.
  constexpr void set_lives() {
    constexpr std::uint64_t kForEver_us = ~std::uint64_t{0};
    command_life_us_ = rules_.command_timeout ? command_timeout_us() : kForEver_us;
    fast_life_us_ = rules_.fast_timeout ? fast_timeout_us() : kForEver_us;
  }

  constexpr Setpoint to_motor(const Order& o) const {
    if (o.mode == Mode::current && o.value < 0.0f && !p_.bidirectional && omega_rad_s_ < p_.min_speed_rad_s) return {};
    return {o.mode, p_.dir_reversed ? -o.value : o.value};
  }

  constexpr void note_commander(std::uint8_t source, std::uint64_t now_us) {
    if (source == 0) return;
    if (commander_ != 0 && source != commander_ && now_us - commander_us_ <= kTwoCommanders_us) {
      ++counters_.second_commander;
      second_ = commander_;
      second_us_ = now_us;
    }
    commander_ = source;
    commander_us_ = now_us;
  }

  constexpr void take(Order& order, Mode mode, float value, std::uint64_t now_us) {
    ordered_us_ = now_us;
    if (value != 0.0f) asked_us_ = now_us;
    if (!armed_) {
      ++counters_.not_armed;
      order.present = false;
      return;
    }
    ever_ = true;
    if (value == 0.0f) zero_seen_ = true;
    if (!zero_seen_) {
      ++counters_.zero_awaited;
      order.present = false;
      return;
    }
    if (mode != Mode::current && value < 0.0f && !p_.bidirectional) {
      ++counters_.negative;
      value = 0.0f;
    }
    const float limit = mode == Mode::duty ? 1.0f : mode == Mode::speed ? p_.max_speed_rad_s : p_.phase_current_limit_A;
    float v = std::clamp(value, -limit, limit);
    if (mode == Mode::speed && v != 0.0f && std::fabs(v) < p_.min_speed_rad_s) v = std::copysign(p_.min_speed_rad_s, v);
    if (v != value) ++counters_.clamped;
    if (mode != Mode::current && v == 0.0f) mode = Mode::off;
    order = {.time_us = now_us, .value = v, .mode = mode, .present = true};
  }

  NodeRules rules_;
  Parameters p_;
  Order command_{}, fast_{};
  CommandCounters counters_{};
  static constexpr std::uint64_t kTwoCommanders_us = 1'000'000;
  static constexpr float kLeastDuty = 0.03f;
  std::uint64_t command_life_us_ = 0, fast_life_us_ = 0;
  std::uint64_t heard_us_ = 0, commander_us_ = 0, second_us_ = 0, asked_us_ = 0, ordered_us_ = 0;
  float omega_rad_s_ = 0.0f;
  std::uint8_t sequence_ = 0;
  std::uint8_t commander_ = 0, second_ = 0;
  bool heard_ = false;
  bool ever_ = false;  // an order was heard while armed
  bool armed_;
  bool zero_seen_;
};

}  // namespace rotorloop::firmware
