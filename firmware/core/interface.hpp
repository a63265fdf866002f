// What crosses between the ESC's node task (CAN) and its motor control: set-points one way, telemetry the other, and the
// parameters that both read. Plain data, no behaviour, so that each side can be tested without the other.
#pragma once
#include <cstdint>

namespace rotorloop::firmware {

enum class Mode : std::uint8_t { off, duty, speed, current };

struct Setpoint {
  Mode mode = Mode::off;
  float value = 0.0f;  // duty -1..1 | mechanical speed rad/s | torque current i_q A
};

// Which limit is the one acting now; `none` when the controller has all it asks for.
enum class Limiter : std::uint8_t {
  none,
  phase_current,
  bus_current,
  regen_current,
  voltage,
  speed_slew,
  max_speed,
  min_speed,
  temperature,
  undervoltage,  // current derated while the bus is near its lower limit
  observer,      // current held to what the position estimate tolerates at this speed
};

enum class MotorState : std::uint8_t { off, align, ramp, handover, running, braking, fault, catching };

enum class Fault : std::uint8_t { none, overcurrent, undervoltage, overvoltage, stall, start_failed, sensor, overtemperature };

struct Telemetry {
  MotorState state = MotorState::off;
  Fault fault = Fault::none;
  Limiter limiter = Limiter::none;
  bool speed_valid = false;  // the observer is locked
  float speed_rad_s = 0.0f;  // mechanical, signed
  float current_q_A = 0.0f;
  float bus_V = 0.0f;
  float bus_A = 0.0f;  // negative: regeneration
  float temperature_K = 0.0f;
  std::uint32_t error_count = 0;
};

// Every parameter of the first firmware, in SI. Ranges are checked in firmware/core/node/parameters.hpp.
struct Parameters {
  std::uint8_t node_id = 0;                // 1..125
  std::uint8_t esc_index = 0;              // 0..15
  std::uint16_t command_timeout_ms = 250;  // DroneCAN command, 20..1000
  std::uint16_t fast_timeout_ms = 20;      // fast channel
  bool require_arming = true;
  bool fast_channel = true;
  std::uint16_t fast_feedback_Hz = 1000;  // 0, 250, 500, 1000
  std::uint16_t status_Hz = 50;           // esc.Status while running
  std::uint8_t pole_pairs = 7;
  float resistance_ohm = 0.06f;
  float inductance_H = 15e-6f;
  float flux_linkage_Wb = 3.42e-4f;
  float inertia_kg_m2 = 9.4e-6f;  // rotor, bell and propeller: feed-forward
  float load_N_m_s2 = 3.0e-8f;    // propeller torque / speed²: feed-forward
  float phase_current_limit_A = 40.0f;
  float bus_current_limit_A = 40.0f;
  float regen_current_limit_A = 40.0f;  // bus current that the supply can sink; 0 for one that cannot
  float speed_slew_rad_s2 = 0.0f;       // 0: off
  float max_speed_rad_s = 1780.0f;      // 17 000 RPM
  float min_speed_rad_s = 105.0f;       // 1 000 RPM; a lower set-point is raised to it
  float undervoltage_V = 12.0f;         // bridge off below; current derated over the 1.2 V above
  float overvoltage_V = 28.0f;          // bridge off above (the board's supply stage)
  float temperature_limit_K = 358.0f;   // bridge off above; current derated over the 20 K below
};

}  // namespace rotorloop::firmware
