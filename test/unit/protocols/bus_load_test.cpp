// What the layouts cost on the bus, by the worst-case formula, and who waits for whom.
#include "protocols/bus_load.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "protocols/fast_channel.hpp"
#include "protocols/state_channel.hpp"
#include "protocols/types.hpp"

namespace rotorloop::protocols {
namespace {

constexpr double kBit_s = 1e-6;  // 1 Mbit/s

TEST(BusLoad, WorstFrameIs80Or55BitsPlus10PerByte) {
  for (std::uint32_t n = 0; n <= 8; ++n) {
    EXPECT_EQ(worst_frame_bits(true, n), 80u + 10u * n);
    EXPECT_EQ(worst_frame_bits(false, n), 55u + 10u * n);
  }
}

TEST(BusLoad, EscBusWithFourEscsAt1kHzStaysBelow70Percent) {
  constexpr double kEscs = 4, kStatus_Hz = 50, kNodes = 5;
  double bits_per_s = 1000.0 * worst_frame_bits(false, 8) + kEscs * 1000.0 * worst_frame_bits(false, 4);
  bits_per_s += kEscs * kStatus_Hz * worst_transfer_bits(EscStatus::kMaxBytes);
  bits_per_s += kNodes * 1.0 * worst_transfer_bits(NodeStatus::kMaxBytes);
  bits_per_s += 2.0 * worst_transfer_bits(ArmingStatus::kMaxBytes);
  EXPECT_NEAR(100.0 * bits_per_s * kBit_s, 60.2, 0.05);
  // With bus voltage in the feedback it still fits.
  const double with_voltage = bits_per_s + kEscs * 1000.0 * (worst_frame_bits(false, 6) - worst_frame_bits(false, 4));
  EXPECT_NEAR(100.0 * with_voltage * kBit_s, 68.2, 0.05);
  EXPECT_LE(100.0 * with_voltage * kBit_s, 70.0);
}

// The longest answer that the definition of param.GetSet allows: two texts of 128 bytes, two limits of 64 bits, a name of 92. The least
// bits that the frames can have (none stuffed) against the share that other traffic of higher priority leaves.
TEST(BusLoad, FiveLongestAnswersOfGetSetTake120MsOnABusLoadedTo70PercentSo100MsCannotBeHad) {
  const std::string text(128, 'U'), name(kMaxParameterName, 'U');  // bits that alternate: none is stuffed
  ParamValue value{.kind = ParamValue::Kind::string};
  value.string = text.c_str();
  const ParamGetSetResponse longest{.value = value,
                                    .default_value = value,
                                    .max_value = NumericValue::of(std::int64_t{1}),
                                    .min_value = NumericValue::of(std::int64_t{0}),
                                    .name = name.c_str()};
  std::array<std::uint8_t, 400> payload{};
  const auto bytes = static_cast<std::uint32_t>(encode(longest, payload));
  constexpr std::uint32_t kAnswers = 5, kUnstuffedFixedBits = 54 + 13;  // arbitration to CRC, then delimiters, end and intermission
  const std::uint32_t frames = kAnswers * transfer_frames(bytes), all_bytes = kAnswers * (bytes + 2) + frames;
  const double least_ms = 1e-3 * (kUnstuffedFixedBits * frames + 8 * all_bytes), worst_ms = 1e-3 * kAnswers * worst_transfer_bits(bytes);
  RecordProperty("bytes", std::to_string(bytes));
  RecordProperty("frames", std::to_string(frames));
  RecordProperty("idle_ms", std::to_string(least_ms) + " to " + std::to_string(worst_ms));
  RecordProperty("at_70_percent_ms", std::to_string(least_ms / 0.3) + " to " + std::to_string(worst_ms / 0.3));
  EXPECT_EQ(frames, 270u);
  EXPECT_GT(least_ms / 0.3, 100.0);
}

TEST(BusLoad, DroneCanAloneCannotCarryThe1kHzSpeedLoop) {
  const double rpm_command = 1000.0 * worst_transfer_bits(9), esc_status = 4 * 1000.0 * worst_transfer_bits(EscStatus::kMaxBytes);
  EXPECT_GT(100.0 * (rpm_command + esc_status) * kBit_s, 190.0);
}

TEST(BusLoad, StateBusStaysBelow50Percent) {
  const double bits_per_s = worst_frame_bits(false, 8) * (static_cast<double>(state::ImuFrames{}.size()) * state::kImu_Hz +
                                                          static_cast<double>(state::PoseFrames{}.size()) * state::kPose_Hz +
                                                          static_cast<double>(state::SetpointFrames{}.size()) * state::kSetpoint_Hz +
                                                          static_cast<double>(state::StatusFrames{}.size()) * state::kStatus_Hz);
  EXPECT_NEAR(100.0 * bits_per_s * kBit_s, 44.55, 1e-9);
  EXPECT_LE(100.0 * bits_per_s * kBit_s, 50.0);
}

TEST(BusLoad, WorstBurstOfBothBusesFitsIntoOneMillisecond) {
  // A blocking frame, then all that the 1 kHz edge releases.
  EXPECT_LE(worst_frame_bits(true, 8) + worst_frame_bits(false, 8) + 4 * worst_frame_bits(false, 4), 1000u);
  EXPECT_LE(worst_frame_bits(false, 8) * (1 + 2 + 4), 1000u);  // blocking, IMU, pose: before the next IMU sample
}

TEST(Arbitration, FasterAndMoreUrgentStreamsWin) {
  const auto key = [](std::uint32_t id) { return arbitration_key({.id = id, .extended = false, .length = 0, .data = {}}); };
  const std::vector<std::uint32_t> urgent_first{
      key(fast::encode(fast::Setpoint{}).id),  // its arrival is the sync edge
      key(state::kGyroId),
      key(state::kAccelId),
      key(state::kPoseStampId),
      key(state::kPosePositionId),
      key(state::kPoseAttitudeId),
      key(state::kPoseVelocityId),
      key(state::kSetpointPositionId),
      key(state::kSetpointStampId),
      key(state::kSetpointVelocityId),
      key(state::kStatusId),
      key(state::kStatusCountersId),
      key(fast::kFeedbackBase),
  };
  for (std::size_t i = 0; i + 1 < urgent_first.size(); ++i) EXPECT_LT(urgent_first[i], urgent_first[i + 1]) << i;
}

TEST(Arbitration, SetpointRanksInsidePriority2AndFeedbackAtTheStartOfPriority5) {
  const auto extended = [](std::uint8_t priority, std::uint16_t type) {
    return arbitration_key({.id = encode_id({.kind = TransferKind::message, .priority = priority, .data_type_id = type, .source = 1}),
                            .extended = true,
                            .length = 8,
                            .data = {}});
  };
  const std::uint32_t setpoint = arbitration_key(fast::encode(fast::Setpoint{})),
                      feedback = arbitration_key(fast::encode(fast::Feedback{}));
  EXPECT_GT(setpoint, extended(0, 1030));
  EXPECT_GT(setpoint, extended(1, 65535));
  EXPECT_LT(setpoint, extended(3, 0));
  EXPECT_GT(feedback, extended(4, 65535));
  EXPECT_LT(feedback, extended(7, 1030));
}

TEST(Arbitration, StandardFrameBeatsAnExtendedOneWithTheSameLeadingBits) {
  EXPECT_LT(arbitration_key({.id = 0x123, .extended = false, .length = 0, .data = {}}),
            arbitration_key({.id = 0x123u << 18, .extended = true, .length = 0, .data = {}}));
}

}  // namespace
}  // namespace rotorloop::protocols
