// A short made-up flight with every stream, each on a clock of its own, and comparison of flights.
#pragma once
#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/log/flight_record.hpp"
#include "host/base/random.hpp"

namespace rotorloop::identify {

inline log::FlightRecord flight_example() {
  const RandomStream random(7, 1);
  std::uint64_t k = 0;
  const auto noise = [&] { return random.gaussian(k++); };
  const auto vec = [&] { return Eigen::Vector3d(noise(), noise(), noise()); };
  log::FlightRecord f;
  f.name = "example";
  for (int i = 0; i < 40; ++i) {
    const double t = 1.0 + 1e-3 * i;
    f.gyro_B_rad_s.add(t, vec());
    f.accel_B_m_s2.add(t, vec() + 9.81 * Eigen::Vector3d::UnitZ());
    f.rotor_omega_rad_s.add(t + 3e-4, {900 + noise(), 900 + noise(), 900 + noise(), 900 + noise()});
    if (i % 5 == 0) {
      Eigen::Quaterniond q(1.0 + 0.1 * noise(), 0.1 * noise(), 0.1 * noise(), noise());
      f.pose.add(t + 1e-6, {vec(), q.normalized()});
      f.velocity_W_m_s.add(t + 1e-6, vec());
      f.motor_command.add(t, {0.5, 0.51, 0.52, 0.25});
    }
    if (i % 10 == 0) f.battery_V.add(t + 7e-6, 16.0 + 0.1 * noise());
    f.extra["payload_x[m]"].add(t, noise());
  }
  f.extra["payload_z[m]"].add(2.0, 1.0 / 3.0);
  f.rotor_omega_rad_s.value[3][2] = std::nan("");
  return f;
}

inline bool close(double a, double b, double relative) {
  return (std::isnan(a) && std::isnan(b)) || std::abs(a - b) <= relative * std::max(1.0, std::abs(a));
}

template <class Value, class Numbers>
void expect_same_stream(const log::Stream<Value>& a, const log::Stream<Value>& b, double t_tolerance_s, double relative, const char* name,
                        const Numbers& numbers) {
  ASSERT_EQ(a.size(), b.size()) << name;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LE(std::abs(a.t_s[i] - b.t_s[i]), t_tolerance_s) << name << ' ' << i;
    const auto x = numbers(a.value[i]), y = numbers(b.value[i]);
    for (std::size_t k = 0; k < x.size(); ++k)
      EXPECT_TRUE(close(x[k], y[k], relative)) << name << ' ' << i << ": " << x[k] << " and " << y[k];
  }
}

// Values within `relative` (of at least 1 SI unit), stamps within `t_tolerance_s`.
inline void expect_same_flight(const log::FlightRecord& a, const log::FlightRecord& b, double t_tolerance_s, double relative) {
  const auto vec = [](const Eigen::Vector3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
  const auto four = [](const log::RotorValues& v) { return std::vector<double>(v.begin(), v.end()); };
  const auto one = [](double v) { return std::vector<double>{v}; };
  const auto pose = [](const log::PoseReading& r) {
    return std::vector<double>{r.p_W_m.x(), r.p_W_m.y(), r.p_W_m.z(), r.q_WS.w(), r.q_WS.x(), r.q_WS.y(), r.q_WS.z()};
  };
  // A quaternion is normalised again when it is read: its last digit may change.
  expect_same_stream(a.pose, b.pose, t_tolerance_s, std::max(relative, 3e-16), "pose", pose);
  expect_same_stream(a.position_W_m, b.position_W_m, t_tolerance_s, relative, "position", vec);
  expect_same_stream(a.velocity_W_m_s, b.velocity_W_m_s, t_tolerance_s, relative, "velocity", vec);
  expect_same_stream(a.gyro_B_rad_s, b.gyro_B_rad_s, t_tolerance_s, relative, "gyro", vec);
  expect_same_stream(a.accel_B_m_s2, b.accel_B_m_s2, t_tolerance_s, relative, "accel", vec);
  expect_same_stream(a.rotor_omega_rad_s, b.rotor_omega_rad_s, t_tolerance_s, relative, "rotor speed", four);
  expect_same_stream(a.motor_command, b.motor_command, t_tolerance_s, relative, "motor command", four);
  expect_same_stream(a.battery_V, b.battery_V, t_tolerance_s, relative, "battery", one);
  ASSERT_EQ(a.extra.size(), b.extra.size());
  for (const auto& [name, stream] : a.extra) {
    ASSERT_TRUE(b.extra.count(name)) << name;
    expect_same_stream(stream, b.extra.at(name), t_tolerance_s, relative, name.c_str(), one);
  }
}

}  // namespace rotorloop::identify
