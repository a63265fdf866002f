// The airframe's end of the state bus: samples IMU and pose sensor on the virtual clock and sends their readings as frames
// when they arrive. Nothing of the plant leaves it in any other way.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "host/bus/can_bus.hpp"
#include "protocols/state_channel.hpp"
#include "sim/sensor/imu.hpp"
#include "sim/sensor/pose.hpp"

namespace rotorloop::sim {

class SensorNode {
 public:
  SensorNode(const ImuSensor& imu, const PoseSensor& pose, CanBus& port) : imu_(imu), pose_(pose), port_(port) {}

  // Takes the samples due by now_ns (airframe clock) of the state at now_ns, and sends what has arrived. Call at least at
  // every sampling instant; true when an IMU sample was taken.
  bool poll(std::int64_t now_ns, const AirframeState& state, std::span<const double, kAirframeRotors> omega_rad_s) {
    bool sampled = false;
    if (now_ns >= next_imu_ns_) {
      send(imu_.sample(imu_samples_, state, omega_rad_s));
      next_imu_ns_ = imu_.time_of_sample_ns(++imu_samples_);
      sampled = true;
    }
    if (now_ns >= next_pose_ns_) {
      pose_.sample(pose_samples_, state);
      next_pose_ns_ = pose_.time_of_sample_ns(++pose_samples_);
    }
    while (const auto reading = pose_.take(now_ns)) send(*reading);
    return sampled;
  }

  const PoseSensor& pose() const { return pose_; }
  std::uint64_t refused() const { return refused_; }  // frames that the bus did not take

 private:
  static std::array<double, 3> array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
  template <class Frames>
  void send_all(const Frames& frames) {
    for (const auto& f : frames)
      if (port_.send(f) != SendStatus::queued) ++refused_;
  }
  void send(const ImuReading& r) {
    send_all(protocols::state::encode(
        protocols::state::ImuReading{
            .time_us = r.time_ns / 1000, .gyro_B_rad_s = array(r.gyro_B_rad_s), .accel_B_m_s2 = array(r.accel_B_m_s2)},
        imu_sequence_++));
  }
  void send(const PoseReading& r) {
    send_all(protocols::state::encode(protocols::state::PoseReading{.time_us = r.time_ns / 1000,
                                                                    .p_W_m = array(r.p_W_m),
                                                                    .q_WS = {r.q_WS.w(), r.q_WS.x(), r.q_WS.y(), r.q_WS.z()},
                                                                    .v_W_m_s = array(r.v_W_m_s)},
                                      pose_sequence_++));
  }

  ImuSensor imu_;
  PoseSensor pose_;
  CanBus& port_;
  std::int64_t imu_samples_ = 0, pose_samples_ = 0;
  std::int64_t next_imu_ns_ = 0, next_pose_ns_ = 0;
  std::uint8_t imu_sequence_ = 0, pose_sequence_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace rotorloop::sim
