// docs/wire.md is the specification: its example bytes stand here again. Each is produced by the codec, and the document is
// searched for it, so that neither can change alone.
#include "test/unit/protocols/wire_document.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "bench/hil/flight/limiter_names.hpp"
#include "firmware/core/node/node_report.hpp"
#include "firmware/core/node/parameter_server.hpp"
#include "firmware/core/node/parameters.hpp"
#include "protocols/fast_channel.hpp"
#include "protocols/state_channel.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"
#include "protocols/types/registry.hpp"
#include "test/unit/protocols/hex.hpp"

namespace rotorloop::protocols {
namespace {

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

// Each frame of the transfer stands in the document.
template <class T>
void expect_example(FrameId id, std::uint8_t transfer_id, const T& value) {
  id.data_type_id = T::kType.id;
  for (const CanFrame& f : frames(id, transfer_id, value)) {
    EXPECT_NE(document().find("`" + candump(f) + "`"), std::string::npos) << "docs/wire.md lacks " << candump(f) << " of " << T::kName;
  }
}
constexpr FrameId request_to(std::uint8_t priority, std::uint8_t source, std::uint8_t destination) {
  return {.kind = TransferKind::request, .priority = priority, .source = source, .destination = destination};
}
constexpr FrameId response_to(std::uint8_t priority, std::uint8_t source, std::uint8_t destination) {
  return {.kind = TransferKind::response, .priority = priority, .source = source, .destination = destination};
}

TEST(WireDocument, ExamplesOfParametersAllocationAndEnumeration) {
  Allocation part{.node_id = 0, .first_part = true, .unique_id = {}}, all{.node_id = 125, .first_part = false, .unique_id = {}};
  for (std::uint8_t k = 1; k <= 16; ++k) {
    if (k <= 6) part.unique_id.push_back(k);
    all.unique_id.push_back(k);
  }
  FrameId anonymous = message<Allocation>(30, kNoNode);
  anonymous.discriminator = 0x1ABC;
  expect_example(anonymous, 3, part);
  expect_example(message<Allocation>(30, 126), 0, all);
  expect_example(request_to(30, 127, 42), 1, ParamGetSet{.index = 9, .value = {}, .name = {}});
  expect_example(request_to(30, 127, 42), 2, ParamGetSet{.index = 0, .value = ParamValue::of(std::int64_t{20}), .name = "status_Hz"});
  expect_example(response_to(30, 42, 127), 2,
                 ParamGetSetResponse{.value = ParamValue::of(std::int64_t{20}),
                                     .default_value = ParamValue::of(std::int64_t{50}),
                                     .max_value = NumericValue::of(std::int64_t{200}),
                                     .min_value = NumericValue::of(std::int64_t{2}),
                                     .name = "status_Hz"});
  expect_example(request_to(30, 127, 42), 3, ParamExecuteOpcode{.opcode = ParamExecuteOpcode::kSave, .argument = 0});
  expect_example(response_to(30, 42, 127), 3, ParamExecuteOpcodeResponse{.argument = 0, .ok = true});
  expect_example(request_to(30, 127, 42), 6, EnumerationBegin{.timeout_s = 65535, .parameter = "esc_index"});
  expect_example(message<EnumerationIndication>(24, 42), 0, EnumerationIndication{.value = {}, .parameter = "esc_index"});
}

TEST(WireDocument, ExamplesOfRestartAndUpdate) {
  expect_example(request_to(30, 127, 42), 4, RestartNode{.magic = RestartNode::kMagic});
  expect_example(request_to(30, 127, 42), 5, BeginFirmwareUpdate{.source_node_id = 0, .path = "fw.bin"});
  expect_example(response_to(30, 42, 127), 5, BeginFirmwareUpdateResponse{});
  expect_example(request_to(24, 42, 127), 0, FileGetInfo{.path = "fw.bin"});
  expect_example(response_to(24, 127, 42), 0,
                 FileGetInfoResponse{.size = 65536, .error = {}, .entry = {EntryType::kFile | EntryType::kReadable}});
  expect_example(request_to(24, 42, 127), 1, FileRead{.offset = 256, .path = "fw.bin"});
  FileReadResponse block;
  block.data.assign(std::array<std::uint8_t, 4>{0xDE, 0xAD, 0xBE, 0xEF});
  expect_example(response_to(24, 127, 42), 1, block);
}

TEST(WireDocument, ExamplesOfTelemetryTimeAndBeepAndACommandOnCanFd) {
  expect_example(
      message<EscStatusExtended>(16, 42), 0,
      EscStatusExtended{
          .input_pct = 50, .output_pct = 47, .motor_temperature_degC = 61, .motor_angle_deg = 0, .status_flags = 0x15000, .esc_index = 2});
  expect_example(message<RpmSensor>(16, 42), 0, RpmSensor{.sensor_id = 2, .flags = 0, .rpm = 8950.5f});
  expect_example(message<LogMessage>(28, 42), 0, LogMessage{.level = LogMessage::Level::warning, .source = "esc", .text = "stall"});
  expect_example(message<GlobalTimeSync>(1, 127), 7, GlobalTimeSync{.previous_us = 1234567});
  expect_example(message<BeepCommand>(31, 127), 0, BeepCommand{.frequency_Hz = 440.0f, .duration_s = 0.5f});
  std::array<std::uint8_t, 40> payload{};
  const std::size_t size = encode(RawCommand{.command = {0, 8191, -8192, 4096}, .count = 4}, payload, Framing::fd);
  encode_transfer_fd(message<RawCommand>(7, 120), RawCommand::kType.crc_seed(), 31, {payload.data(), size}, [](const CanFdFrame& f) {
    EXPECT_NE(document().find("`07040678##1" + hex(std::span(f.data).first(f.length)) + "`"), std::string::npos);
    return true;
  });
  EXPECT_NE(document().find("`" + candump(fast::encode_version(0)) + "`"), std::string::npos);
}

TEST(WireDocument, ListsEveryParameterWithItsDefaultAndLimitsAndEveryReasonToBeOff) {
  for (const firmware::ParameterRange& r : firmware::kParameterRanges) {
    std::array<char, 160> row{};
    std::snprintf(row.data(), row.size(), "| `%s` | %s | %g | %g | %g |", r.name, r.unit, static_cast<double>(r.get({})),
                  static_cast<double>(r.min), static_cast<double>(r.max));
    EXPECT_NE(document().find(row.data()), std::string::npos) << "docs/wire.md lacks " << row.data();
  }
  for (int code = 0; code <= static_cast<int>(firmware::WhyOff::commissioning); ++code) {
    const std::string row = "| " + std::to_string(code) + " | `" + firmware::why_text(static_cast<firmware::WhyOff>(code)) + "` |";
    EXPECT_NE(document().find(row), std::string::npos) << "docs/wire.md lacks " << row;
  }
}

// The other direction: a row for a reason that is no longer there misleads as much as a missing one.
TEST(WireDocument, ListsNoReasonToBeOffThatTheFirmwareLacks) {
  const std::size_t head = document().find("| why off | name |");
  ASSERT_NE(head, std::string::npos);
  const std::string table = document().substr(head, document().find("\n\n", head) - head);
  const auto rows = std::count(table.begin(), table.end(), '\n') - 1;  // without the rule
  EXPECT_EQ(rows, static_cast<int>(firmware::WhyOff::commissioning) + 1);
}

// Between backquotes or not: the first cell of every row of the document that begins with `begin`.
std::set<std::string> first_cells(const std::string& begin, const std::string& end, std::size_t from, std::size_t to) {
  std::set<std::string> names;
  std::istringstream lines(document().substr(from, to - from));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(begin)) continue;
    const std::size_t stop = line.find(end, begin.size());
    if (stop != std::string::npos) names.insert(line.substr(begin.size(), stop - begin.size()));
  }
  return names;
}

TEST(WireDocument, ListsEveryDataTypeWithKindIdSignatureAndSeedAndNoOther) {
  std::set<std::string> rows;
  const auto add = [&](const char* name, const DataType& type) {
    std::array<char, 160> row{};
    std::snprintf(row.data(), row.size(), "| %s | %s | %u | 0x%016llX | 0x%04X |", name, type.service ? "service" : "message", type.id,
                  static_cast<unsigned long long>(type.signature), type.crc_seed());
    EXPECT_NE(document().find(std::string("\n") + row.data()), std::string::npos) << "docs/wire.md lacks " << row.data();
    rows.insert(name);
  };
  for_each_message([&]<class T>() { add(T::kName, T::kType); });
  for_each_service([&]<class Request, class Response>() { add(Request::kName, Request::kType); });
  std::set<std::string> documented;
  for (const char* space : {"uavcan.", "dronecan.", "ardupilot."}) {
    for (const std::string& rest : first_cells(std::string("| ") + space, " |", 0, document().size())) documented.insert(space + rest);
  }
  EXPECT_EQ(documented, rows);
}

TEST(WireDocument, ListsNoParameterThatTheNodeHasNotAndNamesAllThatCanBeRead) {
  std::set<std::string> parameters;
  for (const firmware::ParameterRange& r : firmware::kParameterRanges) parameters.insert(r.name);
  const std::size_t head = document().find("| parameter | unit |");
  ASSERT_NE(head, std::string::npos);
  EXPECT_EQ(first_cells("| `", "`", head, document().find("\n\n", head)), parameters);

  // All that the node has by index, asked as a tool asks; stat_fault_2 and _3 stand there as a range.
  firmware::Parameters edited;
  const firmware::Parameters started;
  firmware::CommissionService commission;
  std::size_t count = 0;
  for (;; ++count) {
    const ParamGetSetResponse r =
        firmware::ParameterServer::answer({.index = static_cast<std::uint16_t>(count)}, edited, commission, {.started = &started});
    const std::string name(reinterpret_cast<const char*>(r.name.items.data()), r.name.count);
    if (name.empty()) break;
    if (name == "stat_fault_2" || name == "stat_fault_3") continue;
    EXPECT_NE(document().find("`" + name + "`"), std::string::npos) << "docs/wire.md lacks " << name;
  }
  EXPECT_EQ(count, firmware::ParameterServer::kCount);
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
    expect_documented(pose[i], std::vector<std::string>{"110#3790120030750071", "111#204e00c063ff0170", "112#0000e09e03000070",
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
  expect_documented(status[1], "131#110002002c010140");
}

TEST(WireDocument, ListsEveryLimiterCodeOfTheFirmwareAndNoOther) {
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
