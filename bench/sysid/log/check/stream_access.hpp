// The streams of a flight by name, and their values as channels of plain numbers: what the checks of one stream look at.
#pragma once
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "bench/sysid/log/check/checked_flight.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::log {

// visit(name, stream) for every stream of the house's own list that has samples.
template <class Record, class Visit>
void for_each_stream(Record& r, Visit&& visit) {
  const auto some = [&](const char* name, auto& stream) {
    if (!stream.empty()) visit(std::string(name), stream);
  };
  some(stream_name::pose, r.pose);
  some(stream_name::position, r.position_W_m);
  some(stream_name::velocity, r.velocity_W_m_s);
  some(stream_name::gyro, r.gyro_B_rad_s);
  some(stream_name::accel, r.accel_B_m_s2);
  some(stream_name::rotors, r.rotor_omega_rad_s);
  some(stream_name::command, r.motor_command);
  some(stream_name::battery, r.battery_V);
}

inline std::array<double, 7> channels_of(const PoseReading& v) {
  return {v.p_W_m.x(), v.p_W_m.y(), v.p_W_m.z(), v.q_WS.w(), v.q_WS.x(), v.q_WS.y(), v.q_WS.z()};
}
inline std::array<double, 3> channels_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline std::array<double, 4> channels_of(const RotorValues& v) { return v; }
inline std::array<double, 1> channels_of(double v) { return {v}; }

template <class Value>
std::vector<double> channel(const Stream<Value>& s, std::size_t c) {
  std::vector<double> out(s.size());
  for (std::size_t i = 0; i < s.size(); ++i) out[i] = channels_of(s.value[i])[c];
  return out;
}

// The samples whose `keep` is set.
template <class Value>
Stream<Value> kept(const Stream<Value>& s, const std::vector<char>& keep) {
  Stream<Value> out;
  for (std::size_t i = 0; i < s.size(); ++i)
    if (keep[i]) out.add(s.t_s[i], s.value[i]);
  return out;
}

// Median time between samples; 0 for fewer than two.
template <class Value>
double period_s(const Stream<Value>& s) {
  return median_step(s.t_s);
}

}  // namespace rotorloop::log
