// Commands to motor controllers and what they report (docs/wire.md §2).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocols/dsdl.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::protocols {

// Array position = esc_index. Sent with as many items as there are ESCs; four fill exactly one frame.
struct RawCommand {
  static constexpr DataType kType{.service = false, .id = 1030, .signature = 0x217F5C87D7EC951D};
  static constexpr const char* kName = "uavcan.equipment.esc.RawCommand";
  static constexpr std::size_t kMaxItems = 20, kMaxBytes = 36;  // 35 on classic CAN
  static constexpr std::int32_t kFullScale = 8191;              // 100 %; -8192..8191 on the wire
  std::array<std::int16_t, kMaxItems> command{};
  std::uint8_t count = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.tail("cmd", i(14), v.command, v.count);
  }
};

struct RpmCommand {
  static constexpr DataType kType{.service = false, .id = 1031, .signature = 0xCE0F9F621CF7E70B};
  static constexpr const char* kName = "uavcan.equipment.esc.RPMCommand";
  static constexpr std::size_t kMaxItems = 20, kMaxBytes = 46;  // 45 on classic CAN
  std::array<std::int32_t, kMaxItems> rpm{};                    // mechanical, ±131071
  std::uint8_t count = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.tail("rpm", i(18), v.rpm, v.count);
  }
};

struct EscStatus {
  static constexpr DataType kType{.service = false, .id = 1034, .signature = 0xA9AF28AEA2FBB254};
  static constexpr const char* kName = "uavcan.equipment.esc.Status";
  static constexpr std::size_t kMaxBytes = 14;
  std::uint32_t error_count = 0;
  float voltage_V = 0.0f;
  float current_A = 0.0f;             // negative: regeneration
  float temperature_K = 0.0f;         // NaN: unknown, as for the two above
  std::int32_t rpm = 0;               // mechanical, signed
  std::uint8_t power_rating_pct = 0;  // 0..127
  std::uint8_t esc_index = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("error_count", u(32), v.error_count);
    f.value("voltage", kFloat16, v.voltage_V);
    f.value("current", kFloat16, v.current_A);
    f.value("temperature", kFloat16, v.temperature_K);
    f.value("rpm", i(18), v.rpm);
    f.value("power_rating_pct", u(7), v.power_rating_pct);
    f.value("esc_index", u(5), v.esc_index);
  }
};

struct EscStatusExtended {
  static constexpr DataType kType{.service = false, .id = 1036, .signature = 0x02DC203C50960EDC};
  static constexpr const char* kName = "uavcan.equipment.esc.StatusExtended";
  std::uint8_t input_pct = 0;               // of the command, 0..100
  std::uint8_t output_pct = 0;              // of the voltage, 0..100
  std::int16_t motor_temperature_degC = 0;  // -256..255
  std::uint16_t motor_angle_deg = 0;        // 0..511
  std::uint32_t status_flags = 0;           // 19 bits, the maker's
  std::uint8_t esc_index = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("input_pct", u(7), v.input_pct);
    f.value("output_pct", u(7), v.output_pct);
    f.value("motor_temperature_degC", i(9), v.motor_temperature_degC);
    f.value("motor_angle", u(9), v.motor_angle_deg);
    f.value("status_flags", u(19), v.status_flags);
    f.value("esc_index", u(5), v.esc_index);
  }
};

// A rotation speed as a sensor reports it; autopilots read it beside esc.Status.
struct RpmSensor {
  static constexpr DataType kType{.service = false, .id = 1045, .signature = 0x140707C09274F6E7};
  static constexpr const char* kName = "dronecan.sensors.rpm.RPM";
  static constexpr std::uint16_t kUnhealthy = 1;
  std::uint8_t sensor_id = 0;
  std::uint16_t flags = 0;
  float rpm = 0.0f;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("sensor_id", u(8), v.sensor_id);
    f.value("flags", u(16), v.flags);
    f.value("rpm", kFloat32, v.rpm);
  }
};

struct ArmingStatus {
  static constexpr DataType kType{.service = false, .id = 1100, .signature = 0x8700F375556A8003};
  static constexpr const char* kName = "uavcan.equipment.safety.ArmingStatus";
  static constexpr std::size_t kMaxBytes = 1;
  static constexpr std::uint8_t kDisarmed = 0, kFullyArmed = 255;
  std::uint8_t status = kDisarmed;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("status", u(8), v.status);
  }
};

struct SafetyState {
  static constexpr DataType kType{.service = false, .id = 20000, .signature = 0xE965701A95A1A6A1};
  static constexpr const char* kName = "ardupilot.indication.SafetyState";
  static constexpr std::uint8_t kSafetyOn = 0, kSafetyOff = 255;
  std::uint8_t status = kSafetyOn;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("status", u(8), v.status);
  }
};

struct BeepCommand {
  static constexpr DataType kType{.service = false, .id = 1080, .signature = 0xBE9EA9FEC2B15D52};
  static constexpr const char* kName = "uavcan.equipment.indication.BeepCommand";
  float frequency_Hz = 0.0f;
  float duration_s = 0.0f;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("frequency", kFloat16, v.frequency_Hz);
    f.value("duration", kFloat16, v.duration_s);
  }
};

struct SingleLightCommand {
  static constexpr const char* kName = "uavcan.equipment.indication.SingleLightCommand";
  std::uint8_t light_id = 0, red = 0, green = 0, blue = 0;  // 5, 6 and 5 bits
  friend constexpr bool operator==(const SingleLightCommand&, const SingleLightCommand&) = default;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("light_id", u(8), v.light_id);
    f.group_tail("uavcan.equipment.indication.RGB565", "color", [&](auto& g) {
      g.value("red", u(5), v.red);
      g.value("green", u(6), v.green);
      g.value("blue", u(5), v.blue);
    });
  }
};

struct LightsCommand {
  static constexpr DataType kType{.service = false, .id = 1081, .signature = 0x2031D93C8BDD1EC4};
  static constexpr const char* kName = "uavcan.equipment.indication.LightsCommand";
  BoundedArray<SingleLightCommand, 20> commands{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.structs_tail("commands", v.commands.items, v.commands.count);
  }
};

}  // namespace rotorloop::protocols
