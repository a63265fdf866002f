// What other nodes of a vehicle say on the same bus: sensors, power, actuators, tunnels. Our nodes neither send nor need them;
// tools decode them so that a recording has names instead of bytes.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocols/dsdl.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types/debug.hpp"

namespace rotorloop::protocols {

struct RawImu {
  static constexpr DataType kType{.service = false, .id = 1003, .signature = 0x8280632C40E574B5};
  static constexpr const char* kName = "uavcan.equipment.ahrs.RawIMU";
  Timestamp timestamp{};
  float integration_interval_s = 0.0f;
  std::array<float, 3> gyro_rad_s{}, gyro_integral_rad{}, accel_m_s2{}, accel_integral_m_s{};
  BoundedArray<float, 36> covariance{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("timestamp", v.timestamp);
    f.value("integration_interval", kFloat32, v.integration_interval_s);
    f.fixed("rate_gyro_latest", kFloat16, v.gyro_rad_s);
    f.fixed("rate_gyro_integral", kFloat32, v.gyro_integral_rad);
    f.fixed("accelerometer_latest", kFloat16, v.accel_m_s2);
    f.fixed("accelerometer_integral", kFloat32, v.accel_integral_m_s);
    f.tail("covariance", kFloat16, v.covariance.items, v.covariance.count);
  }
};

struct GnssFix {
  static constexpr DataType kType{.service = false, .id = 1060, .signature = 0x54C1572B9E07F297};
  static constexpr const char* kName = "uavcan.equipment.gnss.Fix";
  Timestamp timestamp{}, gnss_timestamp{};
  std::uint8_t time_standard = 0, leap_seconds = 0, sats_used = 0, status = 0;
  std::int64_t longitude_1e8deg = 0, latitude_1e8deg = 0;
  std::int32_t height_ellipsoid_mm = 0, height_msl_mm = 0;
  std::array<float, 3> ned_velocity_m_s{};
  float pdop = 0.0f;
  BoundedArray<float, 9> position_covariance{}, velocity_covariance{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("timestamp", v.timestamp);
    f.nested("gnss_timestamp", v.gnss_timestamp);
    f.value("gnss_time_standard", u(3), v.time_standard);
    f.padding(5);
    f.value("num_leap_seconds", u(8), v.leap_seconds);
    f.value("longitude_deg_1e8", i(37), v.longitude_1e8deg);
    f.value("latitude_deg_1e8", i(37), v.latitude_1e8deg);
    f.value("height_ellipsoid_mm", i(27), v.height_ellipsoid_mm);
    f.value("height_msl_mm", i(27), v.height_msl_mm);
    f.fixed("ned_velocity", kFloat16, v.ned_velocity_m_s);
    f.value("sats_used", u(6), v.sats_used);
    f.value("status", u(2), v.status);
    f.value("pdop", kFloat16, v.pdop);
    f.padding(4);
    f.items("position_covariance", kFloat16, v.position_covariance.items, v.position_covariance.count);
    f.tail("velocity_covariance", kFloat16, v.velocity_covariance.items, v.velocity_covariance.count);
  }
};

struct EcefPositionVelocity {
  static constexpr const char* kName = "uavcan.equipment.gnss.ECEFPositionVelocity";
  std::array<float, 3> velocity_m_s{};
  std::array<std::int64_t, 3> position_mm{};
  BoundedArray<float, 36> covariance{};
  friend constexpr bool operator==(const EcefPositionVelocity&, const EcefPositionVelocity&) = default;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.fixed("velocity_xyz", kFloat32, v.velocity_m_s);
    f.fixed("position_xyz_mm", i(36), v.position_mm);
    f.padding(6);
    f.tail("covariance", kFloat16, v.covariance.items, v.covariance.count);
  }
};

struct GnssFix2 {
  static constexpr DataType kType{.service = false, .id = 1063, .signature = 0xCA41E7000F37435F};
  static constexpr const char* kName = "uavcan.equipment.gnss.Fix2";
  Timestamp timestamp{}, gnss_timestamp{};
  std::uint8_t time_standard = 0, leap_seconds = 0, sats_used = 0, status = 0, mode = 0, sub_mode = 0;
  std::int64_t longitude_1e8deg = 0, latitude_1e8deg = 0;
  std::int32_t height_ellipsoid_mm = 0, height_msl_mm = 0;
  std::array<float, 3> ned_velocity_m_s{};
  BoundedArray<float, 36> covariance{};
  float pdop = 0.0f;
  BoundedArray<EcefPositionVelocity, 1> ecef{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("timestamp", v.timestamp);
    f.nested("gnss_timestamp", v.gnss_timestamp);
    f.value("gnss_time_standard", u(3), v.time_standard);
    f.padding(13);
    f.value("num_leap_seconds", u(8), v.leap_seconds);
    f.value("longitude_deg_1e8", i(37), v.longitude_1e8deg);
    f.value("latitude_deg_1e8", i(37), v.latitude_1e8deg);
    f.value("height_ellipsoid_mm", i(27), v.height_ellipsoid_mm);
    f.value("height_msl_mm", i(27), v.height_msl_mm);
    f.fixed("ned_velocity", kFloat32, v.ned_velocity_m_s);
    f.value("sats_used", u(6), v.sats_used);
    f.value("status", u(2), v.status);
    f.value("mode", u(4), v.mode);
    f.value("sub_mode", u(6), v.sub_mode);
    f.items("covariance", kFloat16, v.covariance.items, v.covariance.count);
    f.value("pdop", kFloat16, v.pdop);
    f.structs_tail("ecef_position_velocity", v.ecef.items, v.ecef.count);
  }
};

struct GnssAuxiliary {
  static constexpr DataType kType{.service = false, .id = 1061, .signature = 0x9BE8BDC4C3DBBFD2};
  static constexpr const char* kName = "uavcan.equipment.gnss.Auxiliary";
  float gdop = 0.0f, pdop = 0.0f, hdop = 0.0f, vdop = 0.0f, tdop = 0.0f, ndop = 0.0f, edop = 0.0f;
  std::uint8_t sats_visible = 0, sats_used = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("gdop", kFloat16, v.gdop);
    f.value("pdop", kFloat16, v.pdop);
    f.value("hdop", kFloat16, v.hdop);
    f.value("vdop", kFloat16, v.vdop);
    f.value("tdop", kFloat16, v.tdop);
    f.value("ndop", kFloat16, v.ndop);
    f.value("edop", kFloat16, v.edop);
    f.value("sats_visible", u(7), v.sats_visible);
    f.value("sats_used", u(6), v.sats_used);
  }
};

struct CircuitStatus {
  static constexpr DataType kType{.service = false, .id = 1091, .signature = 0x8313D33D0DDDA115};
  static constexpr const char* kName = "uavcan.equipment.power.CircuitStatus";
  std::uint16_t circuit_id = 0;
  float voltage_V = 0.0f, current_A = 0.0f;
  std::uint8_t error_flags = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("circuit_id", u(16), v.circuit_id);
    f.value("voltage", kFloat16, v.voltage_V);
    f.value("current", kFloat16, v.current_A);
    f.value("error_flags", u(8), v.error_flags);
  }
};

struct BatteryInfo {
  static constexpr DataType kType{.service = false, .id = 1092, .signature = 0x249C26548A711966};
  static constexpr const char* kName = "uavcan.equipment.power.BatteryInfo";
  float temperature_K = 0.0f, voltage_V = 0.0f, current_A = 0.0f, average_power_10sec_W = 0.0f, remaining_capacity_Wh = 0.0f,
        full_charge_capacity_Wh = 0.0f, hours_to_full_charge = 0.0f;
  std::uint16_t status_flags = 0;
  std::uint8_t state_of_health_pct = 0, state_of_charge_pct = 0, state_of_charge_pct_stdev = 0, battery_id = 0;
  std::uint32_t model_instance_id = 0;
  Text<31> model_name{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("temperature", kFloat16, v.temperature_K);
    f.value("voltage", kFloat16, v.voltage_V);
    f.value("current", kFloat16, v.current_A);
    f.value("average_power_10sec", kFloat16, v.average_power_10sec_W);
    f.value("remaining_capacity_wh", kFloat16, v.remaining_capacity_Wh);
    f.value("full_charge_capacity_wh", kFloat16, v.full_charge_capacity_Wh);
    f.value("hours_to_full_charge", kFloat16, v.hours_to_full_charge);
    f.value("status_flags", u(11), v.status_flags);
    f.value("state_of_health_pct", u(7), v.state_of_health_pct);
    f.value("state_of_charge_pct", u(7), v.state_of_charge_pct);
    f.value("state_of_charge_pct_stdev", u(7), v.state_of_charge_pct_stdev);
    f.value("battery_id", u(8), v.battery_id);
    f.value("model_instance_id", u(32), v.model_instance_id);
    f.tail("model_name", u(8), v.model_name.items, v.model_name.count);
  }
};

struct DeviceTemperature {
  static constexpr DataType kType{.service = false, .id = 1110, .signature = 0x70261C28A94144C6};
  static constexpr const char* kName = "uavcan.equipment.device.Temperature";
  std::uint16_t device_id = 0;
  float temperature_K = 0.0f;
  std::uint8_t error_flags = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("device_id", u(16), v.device_id);
    f.value("temperature", kFloat16, v.temperature_K);
    f.value("error_flags", u(8), v.error_flags);
  }
};

struct ActuatorCommand {
  static constexpr const char* kName = "uavcan.equipment.actuator.Command";
  std::uint8_t actuator_id = 0, command_type = 0;
  float value = 0.0f;
  friend constexpr bool operator==(const ActuatorCommand&, const ActuatorCommand&) = default;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("actuator_id", u(8), v.actuator_id);
    f.value("command_type", u(8), v.command_type);
    f.value("command_value", kFloat16, v.value);
  }
};

struct ActuatorArrayCommand {
  static constexpr DataType kType{.service = false, .id = 1010, .signature = 0xD8A7486238EC3AF3};
  static constexpr const char* kName = "uavcan.equipment.actuator.ArrayCommand";
  BoundedArray<ActuatorCommand, 15> commands{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.structs_tail("commands", v.commands.items, v.commands.count);
  }
};

struct ActuatorStatus {
  static constexpr DataType kType{.service = false, .id = 1011, .signature = 0x5E9BBA44FAF1EA04};
  static constexpr const char* kName = "uavcan.equipment.actuator.Status";
  std::uint8_t actuator_id = 0, power_rating_pct = 0;
  float position = 0.0f, force = 0.0f, speed = 0.0f;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("actuator_id", u(8), v.actuator_id);
    f.value("position", kFloat16, v.position);
    f.value("force", kFloat16, v.force);
    f.value("speed", kFloat16, v.speed);
    f.padding(1);
    f.value("power_rating_pct", u(7), v.power_rating_pct);
  }
};

struct TunnelProtocol {
  static constexpr const char* kName = "uavcan.tunnel.Protocol";
  std::uint8_t protocol = 0;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("protocol", u(8), v.protocol);
  }
};

struct TunnelBroadcast {
  static constexpr DataType kType{.service = false, .id = 2010, .signature = 0x5AA2D4D9CF4B1E85};
  static constexpr const char* kName = "uavcan.tunnel.Broadcast";
  TunnelProtocol protocol{};
  std::uint8_t channel_id = 0;
  BoundedArray<std::uint8_t, 60> buffer{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("protocol", v.protocol);
    f.value("channel_id", u(8), v.channel_id);
    f.tail("buffer", u(8), v.buffer.items, v.buffer.count);
  }
};

struct TunnelTargetted {
  static constexpr DataType kType{.service = false, .id = 3001, .signature = 0xB138E7EA72A2A2E9};
  static constexpr const char* kName = "uavcan.tunnel.Targetted";
  TunnelProtocol protocol{};
  std::uint8_t target_node = 0, options = 0;
  std::int8_t serial_id = 0;
  std::uint32_t baudrate = 0;
  BoundedArray<std::uint8_t, 120> buffer{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("protocol", v.protocol);
    f.value("target_node", u(7), v.target_node);
    f.value("serial_id", i(5), v.serial_id);
    f.value("options", u(4), v.options);
    f.value("baudrate", u(24), v.baudrate);
    f.tail("buffer", u(8), v.buffer.items, v.buffer.count);
  }
};

struct TunnelCall {
  static constexpr DataType kType{.service = true, .id = 63, .signature = 0xDB11EDC510502658};
  static constexpr const char* kName = "uavcan.tunnel.Call";
  TunnelProtocol protocol{};
  std::uint8_t channel_id = 0;
  BoundedArray<std::uint8_t, 60> buffer{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.nested("protocol", v.protocol);
    f.value("channel_id", u(8), v.channel_id);
    f.tail("buffer", u(8), v.buffer.items, v.buffer.count);
  }
};

struct TunnelCallResponse {
  static constexpr DataType kType = TunnelCall::kType;
  static constexpr const char* kName = TunnelCall::kName;
  BoundedArray<std::uint8_t, 60> buffer{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.tail("buffer", u(8), v.buffer.items, v.buffer.count);
  }
};

}  // namespace rotorloop::protocols
