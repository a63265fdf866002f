// The receiving end of the state channel: collects the frames of a sample, delivers a sample only when all of its frames
// came, counts what was lost, and completes the shortened time stamps. Bounded, no clock of its own: the caller passes the
// arrival time of each frame on any steady clock of the receiver.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocols/state_channel.hpp"

namespace rotorloop::protocols::state {

// Completes the low bits of an airframe time stamp to 64 bits by the nearest value to the expected one. The expectation runs
// on with the receiver's clock, so a gap of any length is bridged as long as both clocks agree to half the range (0.52 s for
// 20 bits). Unanchored until a full stamp (a pose) or anchor() gave the upper bits.
struct AirframeClock {
  std::int64_t airframe_us = 0;
  std::int64_t receiver_us = 0;
  bool anchored = false;

  constexpr void anchor(std::int64_t airframe_time_us, std::int64_t receiver_time_us) {
    airframe_us = airframe_time_us;
    receiver_us = receiver_time_us;
    anchored = true;
  }
  constexpr std::int64_t complete(std::uint32_t low, unsigned bits, std::int64_t receiver_time_us) const {
    const std::int64_t expected = airframe_us + (receiver_time_us - receiver_us);
    const std::int64_t range = std::int64_t{1} << bits;
    std::int64_t ahead = (static_cast<std::int64_t>(low) - expected) & (range - 1);
    if (ahead >= range / 2) ahead -= range;
    return expected + ahead;
  }
};

struct AssemblyCounters {
  std::uint32_t complete = 0;    // samples delivered
  std::uint32_t incomplete = 0;  // samples given up because a frame of a later one came first, or too late
  std::uint32_t lost = 0;        // samples missing between delivered ones, by sequence number (contains the incomplete ones)
  std::uint32_t duplicate = 0;   // a frame that had come before
  std::uint32_t malformed = 0;   // wrong length
};

// Frames of one sample must come within this time: less than half of the shortest sequence wrap (64 ms), far above the
// longest wait for the bus.
inline constexpr std::int64_t kAssemblyWindow_us = 20'000;

template <std::size_t N>
class Assembler {
 public:
  explicit constexpr Assembler(std::uint8_t sequence_modulo) : modulo_(sequence_modulo) {}

  // True when this frame completed a sample; frames() holds it until the next call.
  constexpr bool add(std::size_t index, std::uint8_t sequence, const CanFrame& frame, std::int64_t receiver_time_us) {
    const std::uint32_t bit = 1u << index;
    const bool in_time = receiver_time_us - first_us_ <= kAssemblyWindow_us;
    if (have_ == 0 && started_ && in_time && sequence == last_sequence_) {
      ++counters_.duplicate;  // of the sample just delivered
      return false;
    }
    if (have_ != 0 && sequence == sequence_ && in_time && (have_ & bit) != 0) {
      ++counters_.duplicate;
      return false;
    }
    if (have_ != 0 && (sequence != sequence_ || !in_time)) {
      ++counters_.incomplete;
      have_ = 0;
    }
    if (have_ == 0) {
      sequence_ = sequence;
      first_us_ = receiver_time_us;
    }
    have_ |= bit;
    frames_[index] = frame;
    if (have_ != (1u << N) - 1u) return false;
    have_ = 0;
    if (started_) counters_.lost += static_cast<std::uint32_t>((sequence + modulo_ - last_sequence_ - 1) % modulo_);
    last_sequence_ = sequence;
    started_ = true;
    ++counters_.complete;
    return true;
  }
  constexpr void count_malformed() { ++counters_.malformed; }
  constexpr const std::array<CanFrame, N>& frames() const { return frames_; }
  constexpr const AssemblyCounters& counters() const { return counters_; }

 private:
  std::array<CanFrame, N> frames_{};
  AssemblyCounters counters_{};
  std::int64_t first_us_ = 0;
  std::uint32_t have_ = 0;
  std::uint8_t sequence_ = 0, last_sequence_ = 0, modulo_;
  bool started_ = false;
};

// Both directions in one: a flight computer reads IMU and pose, a bench reads set-point and status.
// At most one of the four is filled by a frame.
struct StateEvent {
  std::optional<ImuReading> imu;
  std::optional<PoseReading> pose;
  std::optional<TrackingSetpoint> setpoint;
  std::optional<ControllerStatus> status;
};

class StateReceiver {
 public:
  // The airframe's time is known beforehand (lockstep: both 0). Without it, IMU samples before the first pose carry times
  // that are right only modulo 2^20 µs; see clock().anchored.
  constexpr void anchor(std::int64_t airframe_time_us, std::int64_t receiver_time_us) { clock_.anchor(airframe_time_us, receiver_time_us); }
  constexpr const AirframeClock& clock() const { return clock_; }

  StateEvent on_frame(const CanFrame& f, std::int64_t receiver_time_us) {
    StateEvent event;
    if (f.extended) return event;
    switch (f.id) {
      case kGyroId:
      case kAccelId:
        if (add(imu_, f, f.id - kGyroId, 58, receiver_time_us)) {
          event.imu = decode(imu_.frames());
          event.imu->time_us = clock_.complete(static_cast<std::uint32_t>(event.imu->time_us), 20, receiver_time_us);
          // IMU samples are the freshest there are: the expectation follows them, and with them a drifting receiver clock.
          clock_.airframe_us = event.imu->time_us;
          clock_.receiver_us = receiver_time_us;
        }
        break;
      case kPoseStampId:
      case kPosePositionId:
      case kPoseAttitudeId:
      case kPoseVelocityId:
        if (add(pose_, f, f.id - kPoseStampId, 60, receiver_time_us) && same_version(pose_.frames()[1])) {
          event.pose = decode(pose_.frames());
          if (clock_.anchored) {
            event.pose->time_us = clock_.complete(static_cast<std::uint32_t>(event.pose->time_us), 32, receiver_time_us);
          } else {
            clock_.anchor(event.pose->time_us, receiver_time_us);
          }
        }
        break;
      case kSetpointPositionId:
      case kSetpointStampId:
      case kSetpointVelocityId:
        if (add(setpoint_, f, f.id - kSetpointPositionId, 60, receiver_time_us)) {
          event.setpoint = decode(setpoint_.frames());
          event.setpoint->time_us = clock_.complete(static_cast<std::uint32_t>(event.setpoint->time_us), 20, receiver_time_us);
        }
        break;
      case kStatusId:
      case kStatusCountersId:
        if (add(status_, f, f.id - kStatusId, 60, receiver_time_us) && same_version(status_.frames()[1])) {
          event.status = decode_status(status_.frames());
          event.status->time_us = clock_.complete(static_cast<std::uint32_t>(event.status->time_us), 20, receiver_time_us);
        }
        break;
      default:
        break;
    }
    return event;
  }

  // The version of the last pose or status that was refused for it; kVersion: none was.
  constexpr std::uint8_t foreign_version() const { return foreign_version_; }
  constexpr std::uint32_t refused_for_version() const { return refused_for_version_; }
  constexpr const AssemblyCounters& imu_counters() const { return imu_.counters(); }
  constexpr const AssemblyCounters& pose_counters() const { return pose_.counters(); }
  constexpr const AssemblyCounters& setpoint_counters() const { return setpoint_.counters(); }
  constexpr const AssemblyCounters& status_counters() const { return status_.counters(); }

 private:
  template <std::size_t N>
  static constexpr bool add(Assembler<N>& a, const CanFrame& f, std::uint32_t index, unsigned sequence_at, std::int64_t receiver_time_us) {
    if (f.length != 8) {
      a.count_malformed();
      return false;
    }
    return a.add(index, static_cast<std::uint8_t>(detail::frame_word(f) >> sequence_at), f, receiver_time_us);
  }
  constexpr bool same_version(const CanFrame& f) {
    const auto version = static_cast<std::uint8_t>(detail::unsigned_field(detail::frame_word(f), kVersionBits, kVersionAt));
    if (version == kVersion) return true;
    foreign_version_ = version;
    ++refused_for_version_;
    return false;
  }
  AirframeClock clock_;
  std::uint32_t refused_for_version_ = 0;
  std::uint8_t foreign_version_ = kVersion;
  Assembler<2> imu_{kImuSequenceModulo};
  Assembler<4> pose_{kSequenceModulo};
  Assembler<3> setpoint_{kSequenceModulo};
  Assembler<2> status_{kSequenceModulo};
};

}  // namespace rotorloop::protocols::state
