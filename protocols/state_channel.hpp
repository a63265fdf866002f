// The state channel: what a flight computer under test is shown of the (simulated) airframe, and what it shows of itself, on
// a CAN bus of its own with 11-bit identifiers (docs/wire.md §4). Encoding and decoding of single frames; the receiver that
// puts frames together again is state_receiver.hpp.
//   airframe -> controller   IMU 1 kHz (2 frames), pose and velocity 200 Hz (4 frames)
//   controller -> airframe   tracking set-point 100 Hz (3 frames), controller status 100 Hz (2 frames)
// Worst-case load at 1 Mbit/s: 27.0 + 10.8 + 4.05 + 2.7 = 44.55 %. Faster and more urgent streams have the smaller ids:
// a frame waits for the one being sent and for those above it, so IMU data never waits longer than one frame.
// SI units; W world and B body frame (x-forward, y-left, z-up); quaternion w, x, y, z from sensor to world. Values beyond the
// range of a field clamp.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocols/can_frame.hpp"
#include "protocols/word_frame.hpp"

namespace rotorloop::protocols::state {

inline constexpr std::uint32_t kGyroId = 0x100, kAccelId = 0x101;
inline constexpr std::uint32_t kPoseStampId = 0x110, kPosePositionId = 0x111, kPoseAttitudeId = 0x112, kPoseVelocityId = 0x113;
inline constexpr std::uint32_t kSetpointPositionId = 0x120, kSetpointStampId = 0x121, kSetpointVelocityId = 0x122;
inline constexpr std::uint32_t kStatusId = 0x130, kStatusCountersId = 0x131;

// Of this layout; it stands in every pose and every controller status. A receiver refuses samples of another one (StateReceiver).
inline constexpr std::uint8_t kVersion = 1;
inline constexpr unsigned kVersionAt = 48, kVersionBits = 8;  // in the frames kPosePositionId and kStatusCountersId

inline constexpr int kImu_Hz = 1000, kPose_Hz = 200, kSetpoint_Hz = 100, kStatus_Hz = 100;

// One LSB on the wire.
inline constexpr double kGyroLsb_rad_s = 35.0 / 32767.0;                     // int16: ±35 rad/s
inline constexpr double kAccelLsb_m_s2 = 160.0 / 32767.0;                    // int16: ±160 m/s²
inline constexpr double kPositionLsb_m = 0.05e-3;                            // int24: ±419.43 m
inline constexpr double kVelocityLsb_m_s = 1.0e-3;                           // int16: ±32.767 m/s
inline constexpr double kYawLsb_rad = 3.14159265358979323846 / 32768.0;      // int16: one turn
inline constexpr double kQuaternionLsb = 0.70710678118654752440 / 262143.0;  // int19: the three smaller components, ±1/√2

inline constexpr std::uint8_t kImuSequenceModulo = 64, kSequenceModulo = 16;  // the others count to 16

struct ImuReading {
  std::int64_t time_us = 0;  // of the measurement, airframe clock; the wire carries the low 20 bits (wraps after 1.049 s)
  std::array<double, 3> gyro_B_rad_s{};
  std::array<double, 3> accel_B_m_s2{};  // specific force: +g on z at rest
};

struct PoseReading {
  std::int64_t time_us = 0;       // of the measurement, airframe clock; the wire carries the low 32 bits (wraps after 71.6 min)
  std::array<double, 3> p_W_m{};  // of the sensor
  std::array<double, 4> q_WS{1.0, 0.0, 0.0, 0.0};
  std::array<double, 3> v_W_m_s{};
  bool tracking = true;      // false: the source says that this pose is not to be trusted
  bool relocalised = false;  // the source jumped: not continuous with the reading before
};

struct TrackingSetpoint {
  std::int64_t time_us = 0;  // for which it holds, airframe clock; low 20 bits on the wire
  std::array<double, 3> p_W_m{};
  std::array<double, 3> v_W_m_s{};
  double yaw_rad = 0.0;  // sent modulo one turn, received in -π..π
};

enum class ControllerMode : std::uint8_t { off = 0, idle = 1, takeoff = 2, tracking = 3, hold = 4, landing = 5, failsafe = 6 };

// Bits of ControllerStatus::limiters: which limits acted at least once since the status before.
enum LimiterBit : std::uint16_t {
  kLimitMotorMin = 1u << 0,
  kLimitMotorMax = 1u << 1,
  kLimitThrust = 1u << 2,
  kLimitTilt = 1u << 3,
  kLimitBodyRate = 1u << 4,
  kLimitPositionError = 1u << 5,
  kLimitVelocityError = 1u << 6,
  kLimitYaw = 1u << 7,
  kLimitIntegral = 1u << 8,
};

struct ControllerStatus {
  std::int64_t time_us = 0;  // of the control step, airframe clock; low 20 bits on the wire
  ControllerMode mode = ControllerMode::off;
  bool armed = false;
  bool estimate_valid = false;
  bool pose_fresh = false;
  bool imu_fresh = false;
  std::uint16_t limiters = 0;
  // Control steps in which a limit of the kind acted, modulo 65536.
  std::uint16_t motor_limited_count = 0;
  std::uint16_t thrust_limited_count = 0;
  std::uint16_t attitude_limited_count = 0;
  friend bool operator==(const ControllerStatus&, const ControllerStatus&) = default;
};

using ImuFrames = std::array<CanFrame, 2>;
using PoseFrames = std::array<CanFrame, 4>;
using SetpointFrames = std::array<CanFrame, 3>;
using StatusFrames = std::array<CanFrame, 2>;

namespace detail {
using namespace protocols::detail;

// Rounds half away from zero, clamps to ±max; NaN gives 0.
inline std::int32_t quantise(double value, double lsb, std::int32_t max) {
  const double x = value / lsb;
  if (!(x == x)) return 0;
  if (x >= max) return max;
  if (x <= -max) return -max;
  return static_cast<std::int32_t>(x < 0.0 ? x - 0.5 : x + 0.5);
}
inline std::uint64_t position(double p_m, unsigned at) { return field(quantise(p_m, kPositionLsb_m, 8388607), 24, at); }
inline std::uint64_t velocity(const std::array<double, 3>& v_m_s) {
  std::uint64_t word = 0;
  for (unsigned i = 0; i < 3; ++i) word |= field(quantise(v_m_s[i], kVelocityLsb_m_s, 32767), 16, 16u * i);
  return word;
}
inline std::array<double, 3> velocity(std::uint64_t word) {
  std::array<double, 3> v{};
  for (unsigned i = 0; i < 3; ++i) v[i] = signed_field(word, 16, 16u * i) * kVelocityLsb_m_s;
  return v;
}
inline double position(std::uint64_t word, unsigned at) { return signed_field(word, 24, at) * kPositionLsb_m; }

// "Smallest three": the largest component is left out (its sign made positive: q and -q are the same attitude) and comes
// back from the unit norm. Largest attitude error 2·√12·LSB/2 = 9.3e-6 rad, when all four components are equal.
inline std::uint64_t pack_quaternion(const std::array<double, 4>& q) {
  double norm2 = 0.0;
  for (const double c : q) norm2 += c * c;
  std::array<double, 4> u{1.0, 0.0, 0.0, 0.0};
  if (norm2 > 1e-12 && norm2 < 1e12) {  // otherwise (also NaN): not a rotation, send the identity
    const double scale = 1.0 / std::sqrt(norm2);
    for (std::size_t i = 0; i < 4; ++i) u[i] = q[i] * scale;
  }
  std::size_t largest = 0;
  for (std::size_t i = 1; i < 4; ++i) {
    if (std::fabs(u[i]) > std::fabs(u[largest])) largest = i;
  }
  const double sign = u[largest] < 0.0 ? -1.0 : 1.0;
  std::uint64_t word = field(static_cast<std::uint64_t>(largest), 2, 0);
  unsigned at = 2;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == largest) continue;
    word |= field(quantise(sign * u[i], kQuaternionLsb, 262143), 19, at);
    at += 19;
  }
  return word;
}
inline std::array<double, 4> unpack_quaternion(std::uint64_t word) {
  const std::size_t largest = unsigned_field(word, 2, 0);
  std::array<double, 4> q{};
  double rest = 1.0;
  unsigned at = 2;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == largest) continue;
    q[i] = signed_field(word, 19, at) * kQuaternionLsb;
    rest -= q[i] * q[i];
    at += 19;
  }
  q[largest] = std::sqrt(rest > 0.0 ? rest : 0.0);
  const double scale = 1.0 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);  // ≠ 1 only for a foreign sender's words
  for (double& c : q) c *= scale;
  return q;
}
}  // namespace detail

// ---- encode: `sequence` counts the samples of that stream; frames go out in the order of the array.

inline ImuFrames encode(const ImuReading& s, std::uint8_t sequence) {
  const auto time = static_cast<std::uint64_t>(s.time_us);
  std::uint64_t gyro = detail::field(time, 10, 48) | detail::field(std::uint64_t{sequence}, 6, 58);
  std::uint64_t accel = detail::field(time >> 10, 10, 48) | detail::field(std::uint64_t{sequence}, 6, 58);
  for (unsigned i = 0; i < 3; ++i) {
    gyro |= detail::field(detail::quantise(s.gyro_B_rad_s[i], kGyroLsb_rad_s, 32767), 16, 16u * i);
    accel |= detail::field(detail::quantise(s.accel_B_m_s2[i], kAccelLsb_m_s2, 32767), 16, 16u * i);
  }
  return {detail::word_frame(kGyroId, 8, gyro), detail::word_frame(kAccelId, 8, accel)};
}

inline PoseFrames encode(const PoseReading& s, std::uint8_t sequence) {
  const std::uint64_t tag = detail::field(std::uint64_t{sequence}, 4, 60);
  const std::uint64_t stamp = detail::field(static_cast<std::uint64_t>(s.time_us), 32, 0) | detail::position(s.p_W_m[2], 32) |
                              detail::field(std::uint64_t{s.tracking}, 1, 56) | detail::field(std::uint64_t{s.relocalised}, 1, 57);
  return {detail::word_frame(kPoseStampId, 8, tag | stamp),
          detail::word_frame(kPosePositionId, 8,
                             tag | detail::position(s.p_W_m[0], 0) | detail::position(s.p_W_m[1], 24) |
                                 detail::field(std::uint64_t{kVersion}, kVersionBits, kVersionAt)),
          detail::word_frame(kPoseAttitudeId, 8, tag | detail::pack_quaternion(s.q_WS)),
          detail::word_frame(kPoseVelocityId, 8, tag | detail::velocity(s.v_W_m_s))};
}

inline SetpointFrames encode(const TrackingSetpoint& s, std::uint8_t sequence) {
  const std::uint64_t tag = detail::field(std::uint64_t{sequence}, 4, 60);
  // Modulo one turn; a yaw that is not finite or absurd is sent as 0.
  const double turns = std::fabs(s.yaw_rad) < 1e6 ? s.yaw_rad / (65536.0 * kYawLsb_rad) : 0.0;
  const auto yaw = static_cast<std::int32_t>(std::floor((turns - std::floor(turns)) * 65536.0 + 0.5));
  const std::uint64_t stamp =
      detail::field(static_cast<std::uint64_t>(s.time_us), 20, 0) | detail::position(s.p_W_m[2], 20) | detail::field(yaw, 16, 44);
  return {detail::word_frame(kSetpointPositionId, 8, tag | detail::position(s.p_W_m[0], 0) | detail::position(s.p_W_m[1], 24)),
          detail::word_frame(kSetpointStampId, 8, tag | stamp),
          detail::word_frame(kSetpointVelocityId, 8, tag | detail::velocity(s.v_W_m_s))};
}

inline StatusFrames encode(const ControllerStatus& s, std::uint8_t sequence) {
  const std::uint64_t tag = detail::field(std::uint64_t{sequence}, 4, 60);
  const std::uint64_t flags =
      std::uint64_t{s.armed} | std::uint64_t{s.estimate_valid} << 1 | std::uint64_t{s.pose_fresh} << 2 | std::uint64_t{s.imu_fresh} << 3;
  const std::uint64_t head = detail::field(static_cast<std::uint64_t>(s.time_us), 20, 0) |
                             detail::field(std::uint64_t{s.limiters}, 16, 20) | detail::field(static_cast<std::uint64_t>(s.mode), 4, 36) |
                             detail::field(flags, 8, 40);
  const std::uint64_t counts =
      detail::field(std::uint64_t{s.motor_limited_count}, 16, 0) | detail::field(std::uint64_t{s.thrust_limited_count}, 16, 16) |
      detail::field(std::uint64_t{s.attitude_limited_count}, 16, 32) | detail::field(std::uint64_t{kVersion}, kVersionBits, kVersionAt);
  return {detail::word_frame(kStatusId, 8, tag | head), detail::word_frame(kStatusCountersId, 8, tag | counts)};
}

// ---- decode: frames of one sample, in the order of encode(), lengths and ids already checked. `time_us` comes back with the
// bits the wire carries and nothing above them: StateReceiver completes it.

inline ImuReading decode(const ImuFrames& f) {
  const std::uint64_t gyro = detail::frame_word(f[0]), accel = detail::frame_word(f[1]);
  ImuReading s;
  s.time_us = detail::unsigned_field(gyro, 10, 48) | detail::unsigned_field(accel, 10, 48) << 10;
  for (unsigned i = 0; i < 3; ++i) {
    s.gyro_B_rad_s[i] = detail::signed_field(gyro, 16, 16u * i) * kGyroLsb_rad_s;
    s.accel_B_m_s2[i] = detail::signed_field(accel, 16, 16u * i) * kAccelLsb_m_s2;
  }
  return s;
}

inline PoseReading decode(const PoseFrames& f) {
  const std::uint64_t stamp = detail::frame_word(f[0]), xy = detail::frame_word(f[1]);
  PoseReading s;
  s.time_us = detail::unsigned_field(stamp, 32, 0);
  s.p_W_m = {detail::position(xy, 0), detail::position(xy, 24), detail::position(stamp, 32)};
  s.tracking = detail::unsigned_field(stamp, 1, 56) != 0;
  s.relocalised = detail::unsigned_field(stamp, 1, 57) != 0;
  s.q_WS = detail::unpack_quaternion(detail::frame_word(f[2]));
  s.v_W_m_s = detail::velocity(detail::frame_word(f[3]));
  return s;
}

inline TrackingSetpoint decode(const SetpointFrames& f) {
  const std::uint64_t xy = detail::frame_word(f[0]), stamp = detail::frame_word(f[1]);
  TrackingSetpoint s;
  s.time_us = detail::unsigned_field(stamp, 20, 0);
  s.p_W_m = {detail::position(xy, 0), detail::position(xy, 24), detail::position(stamp, 20)};
  s.yaw_rad = detail::signed_field(stamp, 16, 44) * kYawLsb_rad;
  s.v_W_m_s = detail::velocity(detail::frame_word(f[2]));
  return s;
}

// Shares its frame type with ImuFrames, hence the name.
inline ControllerStatus decode_status(const StatusFrames& f) {
  const std::uint64_t head = detail::frame_word(f[0]), counts = detail::frame_word(f[1]);
  ControllerStatus s;
  s.time_us = detail::unsigned_field(head, 20, 0);
  s.limiters = static_cast<std::uint16_t>(detail::unsigned_field(head, 16, 20));
  s.mode = static_cast<ControllerMode>(detail::unsigned_field(head, 4, 36));
  s.armed = detail::unsigned_field(head, 1, 40) != 0;
  s.estimate_valid = detail::unsigned_field(head, 1, 41) != 0;
  s.pose_fresh = detail::unsigned_field(head, 1, 42) != 0;
  s.imu_fresh = detail::unsigned_field(head, 1, 43) != 0;
  s.motor_limited_count = static_cast<std::uint16_t>(detail::unsigned_field(counts, 16, 0));
  s.thrust_limited_count = static_cast<std::uint16_t>(detail::unsigned_field(counts, 16, 16));
  s.attitude_limited_count = static_cast<std::uint16_t>(detail::unsigned_field(counts, 16, 32));
  return s;
}

}  // namespace rotorloop::protocols::state
