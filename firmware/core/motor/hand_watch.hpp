// Feels whether the rotor is turned by hand while the motor is off, for the enumeration of ESCs: without dividers on its phases a board
// measures nothing with the bridge off, so the windings are shorted through the low sides and the shunts are read (turn_decoder.hpp). No
// other gate is ever driven. Every half second without a turn under way the bridge opens for 20 ms and the motor control has its
// interrupt again: zeros, bus voltage and temperature stay fresh.
//
//   if (!watch.on_sample(board, motor.variables())) motor.on_sample(board);          interrupt
//   watch.want(node.feels_for_hand()); node.on_hand(watch.turned());                main loop, every poll
#pragma once
#include <array>
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/mailbox.hpp"
#include "firmware/core/motor/turn_decoder.hpp"
#include "firmware/core/motor/variables.hpp"

namespace rotorloop::firmware {

template <Board B>
class HandWatch {
 public:
  explicit HandWatch(const Parameters& p) : turn_(configure_turn(p.pole_pairs)) {}

  // From the main loop, again and again: what is not renewed within 20 ms is over.
  void want(bool wanted) { wanted_.write(wanted); }
  // A whole turn was felt; stays until the asking ends.
  bool turned() const { return __atomic_load_n(&turned_, __ATOMIC_ACQUIRE); }
  // More current than the board can measure: whatever turns that rotor is no hand. The bridge stays open until the asking ends.
  bool too_fast() const { return too_fast_; }
  bool shorted() const { return phase_ == Phase::shorted; }
  TurnConfig& config() { return turn_; }  // tests that ask for less than a turn to show what that lets through

  // In the sample interrupt, before the motor control; true: it has taken its place. Only a motor that is off is shorted, and none whose
  // bridge is being tested.
  bool on_sample(B& board, const MotorVariables& motor) {
    if (!asked() || motor.state != MotorState::off || motor.blocked == Blocked::self_test) {
      if (phase_ != Phase::idle) forget(board);
      return false;
    }
    switch (phase_) {
      case Phase::idle:
        open(board, Phase::open);
        return false;
      case Phase::open:
        if (turned_ || too_fast_ || ++samples_ < kOpen) return false;
        // The compares act from the next sample on; only then may a gate be driven.
        board.set_compare({});
        phase_ = Phase::closing;
        return true;
      case Phase::closing:
        board.bridge_on();
        phase_ = Phase::shorted;
        samples_ = in_block_ = used_ = 0;
        turn_state_ = {};
        return true;
      case Phase::shorted:
        return watch(board);
    }
    return false;
  }

 private:
  enum class Phase : std::uint8_t { idle, open, closing, shorted };
  static constexpr std::uint32_t kSample_Hz = B::kPwm_Hz / B::kPwmPeriodsPerSample;
  static constexpr std::uint32_t kBlock = kSample_Hz / TurnConfig::kBlocks_Hz, kOpen = kSample_Hz / 50, kShorted = kSample_Hz / 2,
                                 kOrderLife = kSample_Hz / 50;
  // Three currents sum to zero, so the counts sum to the three zeros: noise spreads by 4, gains 1 % apart by 15 at the range's end.
  static constexpr float kSumSpread_counts = 40.0f;
  static constexpr float kTrip_counts = B::kTripCurrent_A / magnitude(B::kCurrent_A_per_count);

  bool asked() {
    const std::uint32_t sequence = wanted_.sequence();
    if (sequence != sequence_) {
      sequence_ = sequence;
      age_ = 0;
      asked_ = wanted_.read();
    } else if (asked_ && ++age_ > kOrderLife) {
      asked_ = false;
    }
    return asked_;
  }

  void open(B& board, Phase phase) {
    board.bridge_off();
    phase_ = phase;
    samples_ = 0;
  }

  void forget(B& board) {
    if (phase_ != Phase::open) board.bridge_off();  // open: off already, and the gates may be the self-test's by now
    phase_ = Phase::idle;
    __atomic_store_n(&turned_, false, __ATOMIC_RELEASE);
    too_fast_ = far_ = false;
  }

  bool watch(B& board) {
    const AdcCounts adc = board.adc();
    Phases x{};
    for (std::size_t k = 0; k < 3; ++k) x[k] = static_cast<float>(adc.phase[k]) - B::kCurrentZero_counts;
    // Two in a row: a single one may be a conversion that went wrong.
    const bool far = magnitude(x[0]) > kTrip_counts || magnitude(x[1]) > kTrip_counts || magnitude(x[2]) > kTrip_counts;
    too_fast_ = far && far_;
    far_ = far;
    if (too_fast_) return open(board, Phase::open), true;
    const float sum = x[0] + x[1] + x[2];
    if (in_block_ == 0) {
      block_ = {};
      used_ = 0;
    }
    // The first sample after closing says what the zeros sum to. If that one was wrong, all of its block fall out, and the next begins
    // anew.
    if (samples_ == 0) sum_counts_ = sum;
    if (magnitude(sum - sum_counts_) < kSumSpread_counts) {
      block_ = block_ + clarke(x);
      ++used_;
    }
    ++samples_;
    if (++in_block_ < kBlock) return true;
    in_block_ = 0;
    if (2 * used_ < kBlock) {
      samples_ = 0;
      turn_state_ = {};
      return true;
    }
    if (step(turn_, turn_state_, (1.0f / static_cast<float>(used_)) * block_)) __atomic_store_n(&turned_, true, __ATOMIC_RELEASE);
    if (turned_ || (samples_ >= kShorted && turn_state_.steps == 0)) open(board, Phase::open);
    return true;
  }

  TurnConfig turn_;
  TurnState turn_state_{};
  Mailbox<bool> wanted_{};
  Stator block_{};
  float sum_counts_ = 0.0f;
  std::uint32_t sequence_ = 0, age_ = 0, samples_ = 0, in_block_ = 0, used_ = 0;
  Phase phase_ = Phase::idle;
  bool asked_ = false, turned_ = false, too_fast_ = false, far_ = false;
};

}  // namespace rotorloop::firmware
