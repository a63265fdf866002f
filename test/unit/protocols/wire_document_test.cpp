// docs/wire.md is the specification: its example bytes stand here again. Each is produced by the codec, and the document is
// searched for it, so that neither can change alone.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "bench/hil/limiter_names.hpp"
#include "protocols/fast_channel.hpp"
#include "protocols/state_channel.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"
#include "test/unit/protocols/hex.hpp"

namespace rotorloop::protocols {
namespace {

const std::string& document() {
  static const std::string text = [] {
    std::ifstream file(std::string(ROTORLOOP_SOURCE_DIR) + "/docs/wire.md");
    std::stringstream all;
    all << file.rdbuf();
    return all.str();
  }();
  return text;
}

void expect_documented(const CanFrame& frame, const std::string& example) {
  EXPECT_EQ(candump(frame), example);
  EXPECT_NE(document().find("`" + example + "`"), std::string::npos) << "docs/wire.md lacks " << example;
}

template <class T>
std::vector<CanFrame> frames(const FrameId& id, std::uint8_t transfer_id, const T& value) {
  std::array<std::uint8_t, 400> payload{};
  const std::size_t size = encode(value, payload);
  std::vector<CanFrame> result;
  encode_transfer(id, T::kType.crc_seed(), transfer_id, std::span<const std::uint8_t>(payload.data(), size), [&](const CanFrame& f) {
    result.push_back(f);
    return true;
  });
  return result;
}

template <class T>
FrameId message(std::uint8_t priority, std::uint8_t source) {
  return {.kind = TransferKind::message, .priority = priority, .data_type_id = T::kType.id, .source = source};
}

TEST(WireDocument, DroneCanExamples) {
  expect_documented(
      frames(message<NodeStatus>(20, 42), 0, NodeStatus{.uptime_s = 1234567, .mode = NodeMode::initialization, .vendor_status = 0xBEEF})
          .at(0),
      "1401552a#87d6120008efbec0");
  expect_documented(frames(message<ArmingStatus>(8, 120), 5, ArmingStatus{.status = 255}).at(0), "08044c78#ffc5");
  expect_documented(frames(message<RawCommand>(7, 120), 31, RawCommand{.command = {0, 8191, -8192, 4096}, .count = 4}).at(0),
                    "07040678#0003fdf0080010df");
  expect_documented(frames(message<RpmCommand>(7, 120), 1, RpmCommand{.rpm = {131071, -131072, 0}, .count = 3}).at(0),
                    "07040778#ffff4000200000c1");
  const auto four = frames(message<RpmCommand>(7, 120), 2, RpmCommand{.rpm = {8950, 8950, 9100, -9100}, .count = 4});
  ASSERT_EQ(four.size(), 2u);
  expect_documented(four[0], "07040778#48dbf6223d888882");
  expect_documented(four[1], "07040778#c231d37362");
  const auto status = frames(message<EscStatus>(16, 42), 3,
                             EscStatus{.error_count = 1,
                                       .voltage_V = 16.0f,
                                       .current_A = -2.5f,
                                       .temperature_K = 313.0f,
                                       .rpm = -8950,
                                       .power_rating_pct = 6,
                                       .esc_index = 2});
  ASSERT_EQ(status.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i)
    expect_documented(status[i], std::vector<std::string>{"10040a2a#7967010000000083", "10040a2a#4c00c1e45c0add23", "10040a2a#c30843"}[i]);
  CanFrame request{.id = encode_id({.kind = TransferKind::request, .priority = 24, .data_type_id = 1, .source = 120, .destination = 42}),
                   .extended = true,
                   .length = 1,
                   .data = {0xC9}};
  expect_documented(request, "1801aaf8#c9");
}

TEST(WireDocument, FastChannelExamples) {
  fast::Setpoint s{.mode = fast::SetpointMode::rpm, .group = 0, .sequence = 9};
  s.raw = {4475, -4475, fast::kNoOrder, 16383};
  expect_documented(encode(s), "0a0#7b91423700f0ff97");
  s = {.mode = fast::SetpointMode::duty, .group = 1, .sequence = 15};
  s.raw = {8192, 0, -16383, 1};
  expect_documented(encode(s), "0a5#00200040003000f0");
  fast::Feedback f;
  f.esc_index = 2;
  f.sequence = 9;
  f.speed_rpm = -8950;
  f.current_50mA = -60;
  expect_documented(encode(f), "142#0addc49f");
  f.bus_10mV = 1575;
  expect_documented(encode(f), "142#0addc49f2706");
  f = {};
  expect_documented(encode(f), "140#00800000");
}

TEST(WireDocument, StateChannelExamples) {
  const auto imu =
      encode(state::ImuReading{.time_us = 1'234'567, .gyro_B_rad_s = {1.0, -2.0, 0.5}, .accel_B_m_s2 = {0.0, -0.1, 9.80665}}, 33);
  expect_documented(imu[0], "100#a803b0f8d4018786");
  expect_documented(imu[1], "101#0000ecffd807b584");
  const auto pose = encode(state::PoseReading{.time_us = 1'216'567,
                                              .p_W_m = {1.0, -2.0, 1.5},
                                              .q_WS = {0.9998, 0.0, 0.02, 0.0},
                                              .v_W_m_s = {0.25, -0.5, 3.0},
                                              .tracking = true,
                                              .relocalised = false},
                           7);
  for (std::size_t i = 0; i < 4; ++i)
    expect_documented(pose[i], std::vector<std::string>{"110#3790120030750071", "111#204e00c063ff0070", "112#0000e09e03000070",
                                                        "113#fa000cfeb80b0070"}[i]);
  const auto setpoint =
      encode(state::TrackingSetpoint{.time_us = 1'234'567, .p_W_m = {1.0, -2.0, 1.5}, .v_W_m_s = {0.25, -0.5, 3.0}, .yaw_rad = 1.0}, 4);
  for (std::size_t i = 0; i < 3; ++i)
    expect_documented(setpoint[i], std::vector<std::string>{"120#204e00c063ff0040", "121#87d6025307e08b42", "122#fa000cfeb80b0040"}[i]);
  const auto status = state::encode(state::ControllerStatus{.time_us = 1'234'567,
                                                            .mode = state::ControllerMode::tracking,
                                                            .armed = true,
                                                            .estimate_valid = true,
                                                            .pose_fresh = true,
                                                            .imu_fresh = true,
                                                            .limiters = state::kLimitMotorMax | state::kLimitTilt,
                                                            .motor_limited_count = 17,
                                                            .thrust_limited_count = 2,
                                                            .attitude_limited_count = 300},
                                    4);
  expect_documented(status[0], "130#87d6a200300f0040");
  expect_documented(status[1], "131#110002002c010040");
}

TEST(WireDocument, lists_every_limiter_code_of_the_firmware_and_no_other) {
  const std::size_t head = document().find("| limiter code |");
  ASSERT_NE(head, std::string::npos);
  const std::string table = document().substr(head, document().find("\n\n", head) - head);
  std::size_t rows = 0;
  for (const char c : table) rows += c == '\n';
  int code = 0;
  for (;; ++code) {
    const auto name = hil::limiter_name(static_cast<firmware::Limiter>(code));
    if (name.empty()) break;
    const std::string row = "| " + std::to_string(code) + " | `" + std::string(name) + "` |";
    EXPECT_NE(table.find(row), std::string::npos) << "docs/wire.md lacks the row " << row;
  }
  EXPECT_EQ(rows, static_cast<std::size_t>(code) + 1) << "rows of the table: its rule and one for each code";
}

}  // namespace
}  // namespace rotorloop::protocols
