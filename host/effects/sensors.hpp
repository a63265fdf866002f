// What the log says that is not so: speeds of rotors that are scaled or late, poses that are scaled, a pose sensor that gives way, an
// accelerometer that rectifies vibration, an IMU that is turned or scaled, a clock that runs fast. Delay of the pose itself is a parameter
// of the fit (pose_delay).
#pragma once
#include "host/base/constants.hpp"
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// reported = (1 + error) true (rotor_groups.hpp).
struct RotorSpeedScale {
  static constexpr std::string_view kId = "rotor_speed_scale";
  static constexpr TermTraits kTraits{.common_part = "k_1, k_2 and c_q"};
  static constexpr TermParameter kParameters[] = {{"error_1", "1", -0.2, 0.2, 0.03, 0.0},
                                                  {"error_2", "1", -0.2, 0.2, 0.03, 0.0},
                                                  {"error_3", "1", -0.2, 0.2, 0.03, 0.0},
                                                  {"error_4", "1", -0.2, 0.2, 0.03, 0.0}};

  template <class S>
  static void speeds(const S* c, LoadState<S>& s) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      s.omega_rad_s[i] = s.omega_rad_s[i] / (1.0 + c[i]);
      s.omega_dot_rad_s2[i] = s.omega_dot_rad_s2[i] / (1.0 + c[i]);
    }
  }
};

// log(t) = true(t - delay), to first order in the delay.
struct RotorSpeedDelay {
  static constexpr std::string_view kId = "rotor_speed_delay";
  static constexpr TermParameter kParameters[] = {{"delay_s", "s", 0.0, 0.05, 5e-3, 0.0}};

  template <class S>
  static void speeds(const S* c, LoadState<S>& s) {
    for (std::size_t i = 0; i < kRotors; ++i) s.omega_rad_s[i] += c[0] * s.omega_dot_rad_s2[i];
  }
};

// Position and velocity are reported too long by this share, from the world's origin.
struct PoseScale {
  static constexpr std::string_view kId = "pose_scale";
  static constexpr TermParameter kParameters[] = {{"error", "1", -0.1, 0.1, 0.02, 0.0}};

  template <class S>
  static void reading(const S* c, ReadingState<S>& r) {
    r.position_W_m += scaled(c[0], r.sensor_p_W_m);
    r.velocity_W_m_s += scaled(c[0], r.sensor_v_W_m_s);
  }
};

// A soft mount far below its resonance: the sensor stays behind by Ω̇ / ω_s².
struct SensorMountCompliance {
  static constexpr std::string_view kId = "sensor_mount_compliance";
  static constexpr TermParameter kParameters[] = {{"compliance_s2", "s2", 0.0, 4e-4, 3e-5, 0.0}};

  template <class S>
  static void reading(const S* c, ReadingState<S>& r) {
    r.turn_B_rad -= scaled(c[0], r.angular_acceleration_B_rad_s2);
  }
};

// Bias of the accelerometer along z in proportion to the mean square of the rotor speeds.
struct VibrationRectification {
  static constexpr std::string_view kId = "vibration_rectification";
  static constexpr TermParameter kParameters[] = {{"bias_per_speed2_m", "m", -1e-6, 1e-6, 1e-7, 0.0}};

  template <class S>
  static void reading(const S* c, ReadingState<S>& r) {
    S sum{};
    for (const S& w : r.in.omega_rad_s) sum += w * w;
    r.accel_B_m_s2.z += c[0] * 0.25 * sum;
  }
};

// Both sensors of the IMU are turned against the body by the rotation vector φ: they read R(φ)ᵀ of what is true, here to second order in
// the angle (1e-4 of the value at 5 degrees).
struct ImuRotation {
  static constexpr std::string_view kId = "imu_rotation";
  static constexpr TermParameter kParameters[] = {
      {"roll_rad", "rad", -0.3, 0.3, 0.01, 0.0}, {"pitch_rad", "rad", -0.3, 0.3, 0.01, 0.0}, {"yaw_rad", "rad", -0.3, 0.3, 0.01, 0.0}};

  template <class S>
  static void reading(const S* c, ReadingState<S>& r) {
    const Vec3<S> turn{c[0], c[1], c[2]};
    const auto change = [&](const Vec3<S>& v) {
      const Vec3<S> once = cross(turn, v);
      return scaled(0.5, cross(turn, once)) - once;
    };
    r.gyro_B_rad_s += change(r.in.rates_B_rad_s);
    r.accel_B_m_s2 += change(r.specific_force_B_m_s2);
  }
};

// Reported = (1 + error) true, axis by axis.
struct GyroScale {
  static constexpr std::string_view kId = "gyro_scale";
  static constexpr TermParameter kParameters[] = {
      {"error_x", "1", -0.2, 0.2, 0.01, 0.0}, {"error_y", "1", -0.2, 0.2, 0.01, 0.0}, {"error_z", "1", -0.2, 0.2, 0.01, 0.0}};

  template <class S>
  static void reading(const S* c, ReadingState<S>& r) {
    const Vec3<S>& w = r.in.rates_B_rad_s;
    r.gyro_B_rad_s += Vec3<S>{c[0] * w.x, c[1] * w.y, c[2] * w.z};
  }
};

struct AccelScale {
  static constexpr std::string_view kId = "accel_scale";
  static constexpr TermParameter kParameters[] = {
      {"error_x", "1", -0.2, 0.2, 0.01, 0.0}, {"error_y", "1", -0.2, 0.2, 0.01, 0.0}, {"error_z", "1", -0.2, 0.2, 0.01, 0.0}};

  template <class S>
  static void reading(const S* c, ReadingState<S>& r) {
    const Vec3<S>& f = r.specific_force_B_m_s2;
    r.accel_B_m_s2 += Vec3<S>{c[0] * f.x, c[1] * f.y, c[2] * f.z};
  }
};

// The clock of the pose sensor loses `rate` of a second each second against the clock of the rest: its poses are older than their stamps
// by more and more. To first order in the delay; what it is at the start of a flight is the delay of the pose (a parameter of the fit).
struct ClockRate {
  static constexpr std::string_view kId = "clock_rate";
  static constexpr TermParameter kParameters[] = {{"rate", "1", -0.01, 0.01, 3e-4, 0.0}};

  template <class S>
  static void reading(const S* c, ReadingState<S>& r) {
    const S late_s = r.since_start_s * c[0];
    const auto& e = r.in.world_B;
    const Vec3<S>& v = r.sensor_v_W_m_s;
    r.position_W_m -= scaled(late_s, v);
    r.turn_B_rad -= scaled(late_s, r.in.rates_B_rad_s);
    // The velocity of a moment ago: the acceleration of the centre of mass, gravity put back.
    const auto& f = r.specific_force_B_m_s2;
    r.velocity_W_m_s -= scaled(late_s, Vec3<S>{dot(e[0], f), dot(e[1], f), dot(e[2], f) - kGravity_m_s2});
  }
};

}  // namespace rotorloop::host
