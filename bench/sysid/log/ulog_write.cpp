#include "bench/sysid/log/ulog_write.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "bench/sysid/log/merged_rows.hpp"
#include "bench/sysid/log/ulog.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::log {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kLatest_s = 1e10;  // in µs still far below 2^63
constexpr std::size_t kMessagesPerSync = 500;
constexpr std::uint8_t kFrameNed = 1;  // VehicleOdometry.msg: POSE_FRAME_NED, VELOCITY_FRAME_NED

enum Topic : std::uint16_t { odometry, imu, esc, motors, battery, position, first_extra };

struct Bytes {
  std::string text;
  void integer(std::uint64_t v, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) text += static_cast<char>(v >> (8 * i));
  }
  void u8(std::uint8_t v) { integer(v, 1); }
  void u16(std::uint16_t v) { integer(v, 2); }
  void u64(std::uint64_t v) { integer(v, 8); }
  void f32(double v) { integer(std::bit_cast<std::uint32_t>(static_cast<float>(v)), 4); }
  void f64(double v) { integer(std::bit_cast<std::uint64_t>(v), 8); }
  void turned(const Eigen::Vector3d& v) {  // W to NED, and B to FRD
    f32(v.x());
    f32(-v.y());
    f32(-v.z());
  }
  void none(int count) {
    for (int i = 0; i < count; ++i) f32(kUnknown);
  }
};

void message(Bytes& out, char type, const std::string& body) {
  out.u16(static_cast<std::uint16_t>(body.size()));
  out.text += type;
  out.text += body;
}

void info(Bytes& out, const std::string& key, std::string value) {
  value.resize(std::min<std::size_t>(value.size(), 1000));
  const std::string typed = fmt::format("char[{}] {}", value.size(), key);
  message(out, 'I', static_cast<char>(typed.size()) + typed + value);
}

void subscribe(Bytes& out, std::uint8_t multi_id, std::uint16_t id, const std::string& topic) {
  Bytes body;
  body.u8(multi_id);
  body.u16(id);
  message(out, 'A', body.text + topic);
}

struct Stamps {
  double shift_s = 0.0;
  std::vector<std::vector<double>> us;  // rounded to whole microseconds

  // Whole seconds that make the earliest stamp positive.
  void add(const std::vector<double>& t_s) {
    for (const double t : t_s) {
      if (!(std::abs(t) < kLatest_s))
        throw Error(
            {"", fmt::format("a stamp of {} s cannot be written as ULog: allowed is {} to {} s", number_text(t), -kLatest_s, kLatest_s),
             "another unit of time than the mapping says", "correct the unit of time in the mapping"},
            ExitCode::data_quality);
      shift_s = std::max(shift_s, std::ceil(-t));
    }
    us.push_back(t_s);
  }
  void round() {
    for (auto& stream : us)
      for (double& t : stream) t = std::round((t + shift_s) * 1e6);
  }
};

void definitions(Bytes& out, const FlightRecord& f, double shift_s) {
  Bytes flags;
  flags.text.assign(8 + 8 + 3 * 8, '\0');  // no parameters' defaults, nothing that a reader must know, no appended data
  message(out, 'B', flags.text);
  for (const char* format :
       {"vehicle_visual_odometry:uint64_t timestamp;uint64_t timestamp_sample;float[3] position;float[4] q;float[3] velocity;uint8_t "
        "pose_frame;"
        "uint8_t velocity_frame;",
        "sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;", "esc_report:uint64_t timestamp;float esc_rpm;",
        "esc_status:uint64_t timestamp;uint8_t esc_count;esc_report[4] esc;", "actuator_motors:uint64_t timestamp;float[4] control;",
        "battery_status:uint64_t timestamp;float voltage_v;", "rotorloop_position:uint64_t timestamp;float[3] position;",
        "rotorloop_extra:uint64_t timestamp;double value;"})
    message(out, 'F', format);
  info(out, "sys_name", kULogSystem);
  info(out, "rotorloop_flight", f.name);
  if (shift_s != 0.0) info(out, kULogTimeShiftKey, number_text(shift_s));
  int extra = 0;
  for (const auto& [name, stream] : f.extra) info(out, ulog_extra_key(extra++), name);
}

void subscriptions(Bytes& out, const FlightRecord& f) {
  const auto subscribe_if = [&](bool there, Topic id, const char* topic) {
    if (there) subscribe(out, 0, id, topic);
  };
  subscribe_if(!f.pose.empty() || !f.velocity_W_m_s.empty(), odometry, "vehicle_visual_odometry");
  subscribe_if(!f.gyro_B_rad_s.empty() || !f.accel_B_m_s2.empty(), imu, "sensor_combined");
  subscribe_if(!f.rotor_omega_rad_s.empty(), esc, "esc_status");
  subscribe_if(!f.motor_command.empty(), motors, "actuator_motors");
  subscribe_if(!f.battery_V.empty(), battery, "battery_status");
  subscribe_if(!f.position_W_m.empty(), position, "rotorloop_position");
  for (std::size_t k = 0; k < f.extra.size(); ++k)
    subscribe(out, static_cast<std::uint8_t>(k), static_cast<std::uint16_t>(first_extra + k), kULogExtraTopic);
}

// The streams in the order in which their stamps are merged; extras follow.
enum StreamIndex : std::size_t { s_pose, s_velocity, s_gyro, s_accel, s_rotors, s_command, s_battery, s_position, s_first_extra };

void vector_or_none(Bytes& b, const Stream<Eigen::Vector3d>& s, std::size_t i) {
  if (i == kNoRow)
    b.none(3);
  else
    b.turned(s.value[i]);
}

// The messages of one time, each handed to write(message id, fields after the time stamp).
template <class Write>
void messages_of(const FlightRecord& f, const std::vector<const Stream<double>*>& extras, const MergedRow& row, const Write& write) {
  const auto& at = row.index;
  const auto t_us = static_cast<std::uint64_t>(row.t_s);
  const auto has = [&](StreamIndex s) { return at[s] != kNoRow; };
  if (has(s_pose) || has(s_velocity)) {
    Bytes b;
    b.u64(t_us);  // of the sample
    if (has(s_pose)) {
      const PoseReading& r = f.pose.value[at[s_pose]];
      b.turned(r.p_W_m);
      b.f32(r.q_WS.w());
      b.turned(r.q_WS.vec());  // turning both frames by half a circle about x changes the signs of y and z
    } else {
      b.none(7);
    }
    vector_or_none(b, f.velocity_W_m_s, at[s_velocity]);
    b.u8(kFrameNed);
    b.u8(kFrameNed);
    write(odometry, b);
  }
  if (has(s_gyro) || has(s_accel)) {
    Bytes b;
    vector_or_none(b, f.gyro_B_rad_s, at[s_gyro]);
    vector_or_none(b, f.accel_B_m_s2, at[s_accel]);
    write(imu, b);
  }
  if (has(s_rotors)) {
    Bytes b;
    b.u8(4);
    for (const double omega : f.rotor_omega_rad_s.value[at[s_rotors]]) {
      b.u64(t_us);
      b.f32(omega * kRpm_per_rad_s);
    }
    write(esc, b);
  }
  if (has(s_command)) {
    Bytes b;
    for (const double u : f.motor_command.value[at[s_command]]) b.f32(u);
    write(motors, b);
  }
  if (has(s_battery)) {
    Bytes b;
    b.f32(f.battery_V.value[at[s_battery]]);
    write(battery, b);
  }
  if (has(s_position)) {
    Bytes b;
    b.turned(f.position_W_m.value[at[s_position]]);
    write(position, b);
  }
  for (std::size_t k = 0; k < extras.size(); ++k) {
    if (at[s_first_extra + k] == kNoRow) continue;
    Bytes b;
    b.f64(extras[k]->value[at[s_first_extra + k]]);
    write(static_cast<std::uint16_t>(first_extra + k), b);
  }
}

}  // namespace

std::string ulog_extra_key(int multi_id) { return fmt::format("{}_{}", kULogExtraTopic, multi_id); }

std::string ulog_bytes(const FlightRecord& f) {
  if (f.extra.size() > 256)
    throw Error({"", fmt::format("{} extra streams cannot be written as ULog: at most 256", f.extra.size()), "", "map fewer extra columns"},
                ExitCode::data_quality);
  Stamps stamps;
  for (const auto* t : {&f.pose.t_s, &f.velocity_W_m_s.t_s, &f.gyro_B_rad_s.t_s, &f.accel_B_m_s2.t_s, &f.rotor_omega_rad_s.t_s,
                        &f.motor_command.t_s, &f.battery_V.t_s, &f.position_W_m.t_s})  // as StreamIndex
    stamps.add(*t);
  std::vector<const Stream<double>*> extras;
  for (const auto& [name, stream] : f.extra) {
    stamps.add(stream.t_s);
    extras.push_back(&stream);
  }
  stamps.round();
  std::vector<const std::vector<double>*> streams;
  for (const auto& s : stamps.us) streams.push_back(&s);
  const auto rows = merged_rows(streams);

  Bytes out;
  out.text = kULogMagic;
  out.u8(1);  // version
  out.u64(rows.empty() ? 0 : static_cast<std::uint64_t>(rows.front().t_s));
  definitions(out, f, stamps.shift_s);
  subscriptions(out, f);
  std::size_t messages = 0;
  for (const auto& row : rows)
    messages_of(f, extras, row, [&](std::uint16_t id, const Bytes& fields) {
      Bytes body;
      body.u16(id);
      body.u64(static_cast<std::uint64_t>(row.t_s));
      message(out, 'D', body.text + fields.text);
      if (++messages % kMessagesPerSync == 0) message(out, 'S', std::string(kULogSync));
    });
  return out.text;
}

}  // namespace rotorloop::log
