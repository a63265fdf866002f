// Codes and bits that docs/wire.md gives in prose: each list is made again from the code and searched for word by word, so that a code that
// is added, dropped or renumbered on one side alone is found; bits are looked for where the document says, in frames that the node sends.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "protocols/state_channel.hpp"
#include "test/unit/firmware/node/service_rig.hpp"
#include "test/unit/protocols/wire_document.hpp"

namespace rotorloop::protocols {
namespace {

using namespace firmware;

// Lines of the document wrap; a list is one line here.
const std::string& one_line() {
  static const std::string text = [] {
    std::string t = document();
    std::replace(t.begin(), t.end(), '\n', ' ');
    return t;
  }();
  return text;
}

void expect_said(const std::string& sentence) {
  EXPECT_NE(one_line().find(sentence), std::string::npos) << "docs/wire.md lacks: " << sentence;
}

// "0 ok, 1 warning, …" of all codes that have a name.
template <class Code>
std::string listed(const char* (*name)(Code), int codes = 256) {
  std::string list;
  for (int code = 0; code < codes; ++code) {
    const char* const n = name(static_cast<Code>(code));
    if (n != nullptr) list += (list.empty() ? "" : ", ") + std::to_string(code) + " " + n;
  }
  return list;
}

// Without a default: the compiler finds the code that is missing here.
const char* health(Health h) {
  switch (h) {
    case Health::ok:
      return "ok";
    case Health::warning:
      return "warning";
    case Health::error:
      return "error";
    case Health::critical:
      return "critical";
  }
  return nullptr;
}
const char* mode(NodeMode m) {
  switch (m) {
    case NodeMode::operational:
      return "operational";
    case NodeMode::initialization:
      return "initialization";
    case NodeMode::maintenance:
      return "maintenance";
    case NodeMode::software_update:
      return "software update";
    case NodeMode::offline:
      return "offline";
  }
  return nullptr;
}
const char* level(LogMessage::Level l) {
  switch (l) {
    case LogMessage::Level::debug:
      return "debug";
    case LogMessage::Level::info:
      return "info";
    case LogMessage::Level::warning:
      return "warning";
    case LogMessage::Level::error:
      return "error";
  }
  return nullptr;
}
const char* enumeration_error(EnumerationBeginResponse::Error e) {
  using enum EnumerationBeginResponse::Error;
  switch (e) {
    case ok:
      return "ok";
    case invalid_mode:
      return "mode";
    case invalid_parameter:
      return "parameter";
    case unsupported:
      return "unsupported";
    case unknown:
      return "unknown";
  }
  return nullptr;
}
const char* update_error(BeginFirmwareUpdateResponse::Error e) {
  using enum BeginFirmwareUpdateResponse::Error;
  switch (e) {
    case ok:
      return "ok";
    case invalid_mode:
      return "mode";
    case in_progress:
      return "in progress";
    case unknown:
      return "unknown";
  }
  return nullptr;
}
const char* fault(Fault f) {
  switch (f) {
    case Fault::none:
    case Fault::overcurrent:
    case Fault::undervoltage:
    case Fault::overvoltage:
    case Fault::stall:
    case Fault::start_failed:
    case Fault::sensor:
    case Fault::overtemperature:
    case Fault::self_test:
      return fault_text(f);
  }
  return nullptr;
}
const char* state(MotorState s) {
  using enum MotorState;
  switch (s) {
    case off:
      return "off";
    case align:
      return "align";
    case ramp:
      return "ramp";
    case handover:
      return "hand-over";
    case running:
      return "running";
    case braking:
      return "braking";
    case MotorState::fault:
      return "fault";
    case catching:
      return "catching";
    case stopping:
      return "stopping";
    case holding:
      return "holding";
    case tone:
      return "tone";
  }
  return nullptr;
}
const char* controller_mode(protocols::state::ControllerMode m) {
  using enum protocols::state::ControllerMode;
  switch (m) {
    case off:
      return "off";
    case idle:
      return "idle";
    case takeoff:
      return "take-off";
    case tracking:
      return "tracking";
    case hold:
      return "hold";
    case landing:
      return "landing";
    case failsafe:
      return "failsafe";
  }
  return nullptr;
}
const char* controller_limiter(protocols::state::LimiterBit b) {
  using namespace protocols::state;
  switch (b) {
    case kLimitMotorMin:
      return "motor minimum";
    case kLimitMotorMax:
      return "motor maximum";
    case kLimitThrust:
      return "thrust";
    case kLimitTilt:
      return "tilt";
    case kLimitBodyRate:
      return "body rate";
    case kLimitPositionError:
      return "position error";
    case kLimitVelocityError:
      return "velocity error";
    case kLimitYaw:
      return "yaw";
    case kLimitIntegral:
      return "integral";
  }
  return nullptr;
}

TEST(WireDocument, ListsTheCodesOfHealthModeLogLevelAndErrorsAndNoOthers) {
  expect_said("health u2 (" + listed(health, 4) + ")");
  expect_said("mode u3 (" + listed(mode, 8) + ")");
  expect_said("level u3 (" + listed(level, 8) + ")");
  expect_said("error u8 (" + listed(enumeration_error) + ")");
  expect_said("error u8 (" + listed(update_error) + ")");
  expect_said("flags u8 (" + std::to_string(GetNodeInfoResponse::kHasCommit) + " commit valid, " +
              std::to_string(GetNodeInfoResponse::kHasImageCrc) + " CRC valid)");
  expect_said("flags u16 (" + std::to_string(RpmSensor::kUnhealthy) + ": not valid)");
  expect_said("entry flags u8 (" + std::to_string(EntryType::kFile) + " file, " + std::to_string(EntryType::kReadable) + " readable)");
  expect_said("error i16 (" + std::to_string(FileError::kOk) + " ok, " + std::to_string(FileError::kNotFound) + " not found, " +
              std::to_string(FileError::kIo) + " I/O, …)");
}

TEST(WireDocument, ListsTheCodesOfFaultsAndMotorStatesAndNoOthers) {
  expect_said("bits 7..0 fault (" + listed(fault) + "), bits 15..8 the limiter acting");
  expect_said("bits 3..0 fault, 7..4 limiter, 11..8 why it is off (below), 15..12 motor state (" + listed(state) +
              "), 16 armed, 17 another node with our id or index, 18 tripped since power-up.");
}

std::uint32_t flags(ServiceRig& rig) {
  rig.sent.clear();
  rig.advance_us(50'000);
  const auto sent = rig.received<EscStatusExtended>();
  return sent.empty() ? ~0u : sent.back().status_flags;
}
std::uint16_t vendor_status(ServiceRig& rig) {
  rig.sent.clear();
  rig.advance_us(1'000'000);
  const auto sent = rig.received<NodeStatus>();
  return sent.empty() ? std::uint16_t{0xFFFF} : sent.back().vendor_status;
}
ServiceRig reporting_rig() {
  Parameters p = valid_parameters();
  p.extended_Hz = 50;
  return ServiceRig(p);
}

TEST(WireDocument, StatusFlagsAndVendorStatusStandWhereItSays) {
  for (unsigned code = 0; fault(static_cast<Fault>(code)) != nullptr; ++code) {
    ServiceRig rig = reporting_rig();
    rig.telemetry.fault = static_cast<Fault>(code);
    const std::uint32_t f = flags(rig);
    EXPECT_EQ(f & 15u, code);
    EXPECT_EQ(f >> 18, code == 0 ? 0u : 1u) << "tripped";
    EXPECT_EQ(vendor_status(rig), code);
  }
  for (unsigned code = 0; code <= static_cast<unsigned>(Limiter::sensor_range); ++code) {
    ServiceRig rig = reporting_rig();
    rig.telemetry.limiter = static_cast<Limiter>(code);
    EXPECT_EQ(flags(rig) >> 4 & 15u, code);
    EXPECT_EQ(vendor_status(rig), code << 8);
  }
  for (unsigned code = 0; state(static_cast<MotorState>(code)) != nullptr; ++code) {
    ServiceRig rig = reporting_rig();
    rig.telemetry.state = static_cast<MotorState>(code);
    const std::uint32_t f = flags(rig);
    EXPECT_EQ(f >> 12 & 15u, code);
    EXPECT_EQ(f >> 8 & 15u, static_cast<unsigned>(rig.node.why_off(rig.now_us)));
  }
  ServiceRig rig = reporting_rig();
  EXPECT_EQ(flags(rig), static_cast<unsigned>(WhyOff::not_armed) << 8);
  rig.arm();
  EXPECT_EQ(flags(rig), 1u << 16 | static_cast<unsigned>(WhyOff::no_order) << 8);
  rig.send(EscStatus{.esc_index = 2});  // another ESC with our index
  EXPECT_EQ(flags(rig) & ~(15u << 8), 1u << 16 | 1u << 17);
}

std::uint64_t bits_of(const protocols::state::ControllerStatus& s) {
  const CanFrame f = protocols::state::encode(s, 0)[0];
  std::uint64_t word = 0;
  for (std::size_t k = 0; k < 8; ++k) word |= std::uint64_t{f.data[k]} << 8 * k;
  return word;
}

TEST(WireDocument, StateChannelStatusBitsAndTheirListsAreThoseOfTheCode) {
  using protocols::state::ControllerMode, protocols::state::ControllerStatus;
  expect_said("**Mode**: " + listed(controller_mode) + ".");
  std::string limiters;
  for (int bit = 0; bit < 16; ++bit) {
    const char* const name = controller_limiter(static_cast<protocols::state::LimiterBit>(1u << bit));
    if (name != nullptr) limiters += (limiters.empty() ? "bit " : ", ") + std::to_string(bit) + " " + name;
    EXPECT_EQ(bits_of({.limiters = static_cast<std::uint16_t>(1u << bit)}), std::uint64_t{1} << (20 + bit));
  }
  expect_said("**Limiters** (acted at least once since the status before): " + limiters + ".");
  expect_said("20..35 limiters; 36..39 mode; 40 armed, 41 estimate valid, 42 pose fresh, 43 IMU fresh, 44..47 zero");
  EXPECT_EQ(bits_of({.mode = ControllerMode::failsafe}), std::uint64_t{6} << 36);
  EXPECT_EQ(bits_of({.armed = true}), std::uint64_t{1} << 40);
  EXPECT_EQ(bits_of({.estimate_valid = true}), std::uint64_t{1} << 41);
  EXPECT_EQ(bits_of({.pose_fresh = true}), std::uint64_t{1} << 42);
  EXPECT_EQ(bits_of({.imu_fresh = true}), std::uint64_t{1} << 43);
}

}  // namespace
}  // namespace rotorloop::protocols
