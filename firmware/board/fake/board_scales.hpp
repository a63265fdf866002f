// What the firmware is told of the power stage that it runs on: constants of three boards. Only the first has a real board file;
// the other two are typical data of their class, so that the core is built and run at other scales than the one it grew up with.
#pragma once
#include <cstdint>

namespace rotorloop::firmware {

// Analogue scales of the B-G431B-ESC1 (UM2516; current: 3 mohm shunt × 64/7, 3.3 V / 4096 counts; confidence A).
struct B_G431B_ESC1_Scales {
  static constexpr std::uint32_t kPwm_Hz = 48'000;
  static constexpr std::uint32_t kPwmPeriodsPerSample = 2;
  static constexpr std::uint32_t kPwmTop = 1771;  // 170 MHz centre-aligned: 47 996 Hz
  static constexpr std::uint32_t kDeadTime_ns = 800;
  static constexpr std::uint32_t kSampleWindow_ns = 1200;
  static constexpr float kVolt_per_count = 3.3f / 4096.0f;
  static constexpr float kCurrent_A_per_count = kVolt_per_count / -27.43e-3f;
  static constexpr float kCurrentZero_counts = 2553.0f;
  static constexpr float kCurrentZeroTolerance_counts = 100.0f;
  static constexpr float kBus_V_per_count = kVolt_per_count / 0.09626f;
  static constexpr float kTemperature_K_per_count = kVolt_per_count / 19e-3f;
  static constexpr float kTemperatureZero_K = 298.15f - 1.4f / 19e-3f;
  static constexpr float kSwitchResistance_ohm = 4e-3f;
  static constexpr float kDiodeDrop_V = 0.8f;
  static constexpr float kTripCurrent_A = 44.0f;  // shunt range ±45 A
};

// One or two cells, ±15 A: 5 mohm shunts × 20 around half the reference, a 12 V divider (typical of whoop-size ESCs, no product).
struct Small2s15aScales : B_G431B_ESC1_Scales {
  static constexpr std::uint32_t kDeadTime_ns = 300;
  static constexpr float kCurrent_A_per_count = kVolt_per_count / 0.1f;
  static constexpr float kCurrentZero_counts = 2048.0f;
  static constexpr float kBus_V_per_count = 12.0f / 4096.0f;
  static constexpr float kSwitchResistance_ohm = 8.5e-3f;
  static constexpr float kDiodeDrop_V = 0.75f;
  static constexpr float kTripCurrent_A = 15.0f;
};

// Seven to fourteen cells, ±120 A: 0.5 mohm shunts × 25 around half the reference, an 80 V divider, PWM at 24 kHz, sampled every
// period (typical of 14S ESCs, no product).
struct HighVoltage14s120aScales : B_G431B_ESC1_Scales {
  static constexpr std::uint32_t kPwm_Hz = 24'000;
  static constexpr std::uint32_t kPwmPeriodsPerSample = 1;
  static constexpr std::uint32_t kPwmTop = 3541;  // 170 MHz centre-aligned: 24 005 Hz
  static constexpr std::uint32_t kDeadTime_ns = 1000;
  static constexpr float kCurrent_A_per_count = kVolt_per_count / 12.5e-3f;
  static constexpr float kCurrentZero_counts = 2048.0f;
  static constexpr float kBus_V_per_count = 80.0f / 4096.0f;
  static constexpr float kSwitchResistance_ohm = 1.9e-3f;
  static constexpr float kDiodeDrop_V = 0.9f;
  static constexpr float kTripCurrent_A = 120.0f;
};

}  // namespace rotorloop::firmware
