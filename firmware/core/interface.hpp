// What crosses between the ESC's node task (CAN) and its motor control: set-points one way, telemetry the other, and the
// parameters that both read. Plain data, no behaviour, so that each side can be tested without the other.
#pragma once
#include <cstdint>

namespace rotorloop::firmware {

enum class Mode : std::uint8_t { off, duty, speed, current, tone };

struct Setpoint {
  Mode mode = Mode::off;
  float value = 0.0f;  // duty -1..1 | mechanical speed rad/s | torque current i_q A | tone Hz
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
  sensor_range,  // … to what the board can measure with this motor at this bus voltage
};

// stopping: current against the rotation; holding: windings shorted; tone: a rotor at rest is made to sound.
enum class MotorState : std::uint8_t { off, align, ramp, handover, running, braking, fault, catching, stopping, holding, tone };

enum class Fault : std::uint8_t { none, overcurrent, undervoltage, overvoltage, stall, start_failed, sensor, overtemperature, self_test };

// Why the bridge is off, in the order in which it is looked for; `none` while the motor is driven.
enum class Blocked : std::uint8_t {
  none,
  parameters,      // parameters that this board cannot serve (ParameterProblem)
  calibrating,     // zero of the current sensors not yet measured
  current_sensor,  // … or out of tolerance
  no_order,        // set-point off or zero
  stale_order,     // no valid set-point for kOrderLife_s
  latched,         // too many faults in a row: set-point to off first
  pause,           // between a fault and the next try
  overvoltage,
  undervoltage,
  overtemperature,
  temperature_sensor,  // open or short
  self_test,           // waits for it, or it is under way
  broken,              // it found what Telemetry::self_test says; until power-up
};

// Self-test of the bridge after power-up. turning: not tested, the rotor was not at rest.
enum class SelfTest : std::uint8_t { off, due, turning, passed, failed };

// several: no single part explains it, as no motor at all.
enum class Broken : std::uint8_t { none, phase_open, high_open, low_open, high_short, low_short, several };

// A byte, so that telemetry stays as short as it was.
struct BridgeReport {
  SelfTest result : 3 = SelfTest::off;
  Broken broken : 3 = Broken::none;  // when it failed …
  std::uint8_t leg : 2 = 0;          // … of this leg, 0..2: A, B, C
};
static_assert(sizeof(BridgeReport) == 1);

// What happens when the set-point goes to off. A fault and a stale set-point always coast.
enum class StopMode : std::uint8_t {
  coast,  // bridge off
  brake,  // current against the rotation down to the lowest speed, windings shorted for a moment, then off
  drag,   // the same, and the windings stay shorted for as long as the set-point is off and fresh
};

// Parameters that are each allowed, but not on this board.
enum class ParameterProblem : std::uint8_t {
  none,
  motor_not_positive,        // pole pairs, resistance, inductance, flux linkage, inertia
  speed_beyond_sampling,     // max_speed · pole pairs above f_s · 60/7 electrical RPM
  current_beyond_sensor,     // phase_current_limit above what the shunts can measure
  voltage_beyond_divider,    // overvoltage above what the bus divider can measure
  resistance_beyond_supply,  // the lowest bus cannot drive a start current worth the name
};

// A trip as it happened, for a log that outlives it.
struct TripRecord {
  std::uint32_t number = 0;  // since power-up, from 1; 0: no record
  std::uint32_t uptime_ms = 0;
  Fault fault = Fault::none;
  MotorState state = MotorState::off;  // before it
  bool latched = false;
  float bus_V = 0.0f, current_A = 0.0f, speed_rad_s = 0.0f, temperature_K = 0.0f;  // current: largest phase
};

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
  Blocked blocked = Blocked::none;  // why it is not driven
  bool latched = false;             // the fault stays until the set-point returns to off; otherwise it ends by itself
  bool temperature_valid = true;    // false: thermistor open or short
  BridgeReport self_test{};         // of the bridge, after power-up
  std::uint32_t trips = 0;          // bridge opened by a protection, since power-up
  float bus_mean_A = 0.0f;          // over about 0.1 s
  float energy_J = 0.0f;            // taken from the bus since power-up, less what was fed back
  float winding_K = 0.0f;           // from the resistance followed; 0: not known
  float winding_error_K = 0.0f;     // half width of its interval (95 %)
  float load_N_m = 0.0f;            // torque that the shaft resists with; while the speed is valid
  float duty_q = 0.0f;              // line-to-line voltage along the torque axis at the motor, over the bus voltage; over about 0.1 s
};

// What a RawCommand asks for; autopilots send nothing else.
enum class RawMode : std::uint8_t {
  duty,    // of the bus voltage
  speed,   // of max_speed
  thrust,  // of the thrust at max_speed: its square root is the speed
};

inline constexpr std::uint8_t kNoEscIndex = 255;

// Every parameter of the first firmware, in SI. Ranges are checked in firmware/core/node/parameters.hpp.
struct Parameters {
  std::uint8_t node_id = 0;                // 1..125; 0: asks an allocator for one
  std::uint8_t esc_index = kNoEscIndex;    // 0..15; kNoEscIndex: obeys no command until one is assigned
  std::uint16_t command_timeout_ms = 250;  // DroneCAN command, 20..1000
  std::uint16_t fast_timeout_ms = 20;      // fast channel
  bool require_arming = true;
  bool fast_channel = true;
  std::uint16_t fast_feedback_Hz = 1000;  // 0, 250, 500, 1000
  std::uint16_t status_Hz = 50;           // esc.Status while running
  std::uint8_t status_idle_Hz = 2;
  std::uint8_t extended_Hz = 0;         // esc.StatusExtended; 0: never
  std::uint8_t rpm_Hz = 0;              // rpm.RPM; 0: never
  std::uint16_t node_status_ms = 1000;  // period of NodeStatus
  std::uint8_t status_priority = 16;    // of telemetry, 0 first to 31
  std::uint8_t log_level = 1;           // lowest level that is sent: 0 debug, 1 info, 2 warning, 3 error, 4 none
  std::uint8_t preferred_id = 0;        // asked of the allocator; 0: any
  bool feedback_voltage = false;        // bus voltage in the fast feedback: 6 bytes instead of 4
  RawMode raw_mode = RawMode::duty;
  float raw_deadband = 0.0f;          // of full scale: a smaller RawCommand is a stop
  bool dir_reversed = false;          // what is positive; orders and reported speeds change sign together
  bool bidirectional = false;         // otherwise negative orders of duty and speed stop
  bool zero_first = false;            // after arming nothing turns before an order of zero was heard
  float temperature_warn_K = 348.0f;  // health warning above
  float voltage_warn_V = 0.0f;        // health warning below; 0: never
  float trip_warn_s = 10.0f;          // a trip that ended by itself stays a warning for this long
  std::uint8_t pole_pairs = 7;
  float resistance_ohm = 0.06f;
  float inductance_H = 15e-6f;    // mean of both axes
  float inductance_ratio = 0.0f;  // across the magnet over along it; 0: not known, taken as 1.17 (outrunners have 1.0 to 1.4)
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
  std::uint8_t cells = 0;               // lithium cells in series: bridge off below 3.0 V each; 0: undervoltage_V counts
  float weaken_most_A = 20.0f;          // of field weakening; at most half the phase current limit
  StopMode stop_mode = StopMode::coast;
  float stop_strength = 0.3f;  // of the phase current limit, 0..1: brake and drag
  bool self_test = true;       // of FETs and phases, at power-up
};

}  // namespace rotorloop::firmware
