// The flight computer: what runs on the vehicle beside the ESCs. It hears the airframe only as frames on the state bus and the
// ESCs only as frames on the ESC bus, estimates, controls, and sends set-points; it owns no clock (time is handed in) and
// knows no plant. One control step per complete IMU sample (1 kHz).
//
// Phases: boot (wait for four operational ESCs and a valid estimate) -> spin_up (armed, idle speed, wait until all four
// follow) -> flying (from `take_over` before the trajectory's start) -> and from any of them, when something the flight
// depends on is missing, -> safe: disarmed, with the reason kept. Safe is final: a bench run has failed then.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "host/bus/can_bus.hpp"
#include "host/control/flight_controller.hpp"
#include "host/control/trajectory.hpp"
#include "host/estimate/estimator.hpp"
#include "host/node/esc_link.hpp"
#include "protocols/state_receiver.hpp"

namespace rotorloop::host {

using FlightPhase = ControlPhase;
enum class SafeReason : std::uint8_t {
  none,
  not_ready,
  imu_lost,
  pose_lost,
  esc_silent,
  esc_bus_silent,
  esc_fault,
  esc_not_following,
  bus_off,
  state_version,
  controller,
  late
};

struct FlightComputerConfig {
  EstimatorConfig estimator;
  EscLinkConfig escs;
  std::uint16_t setpoint_Hz = 1000;     // fast channel; divides 1000
  std::int64_t start_us = 2'000'000;    // airframe time at which the trajectory begins
  std::int64_t take_over_us = 300'000;  // control takes the rotors this long before
  double idle_rad_s = 400.0;
  std::int64_t imu_timeout_us = 20'000;
  std::int64_t esc_timeout_us = 30'000;     // no feedback of one ESC
  std::int64_t not_following_us = 150'000;  // speed off by more than half of the command
  bool always_command = false;              // also send set-points of 0 while disarmed: each is answered, so that all know of each other
  double ceiling_rad_s = std::numeric_limits<double>::infinity();  // no set-point above it leaves
};

// One row of the on-board log: what the flight computer knew and did in one control step.
struct FlightRecord {
  std::int64_t time_us = 0;  // of the IMU sample
  FlightPhase phase = FlightPhase::boot;
  ImuSample imu;
  bool pose_new = false;  // a pose arrived since the record before; `pose` is the newest
  PoseSample pose;
  StateEstimate estimate;
  Setpoint setpoint;
  Command command;
  std::array<double, kRotors> commanded_rad_s{};  // as sent; zero when none was
  std::array<double, kRotors> omega_rad_s{};      // newest feedback; NaN when invalid
  std::array<double, kRotors> current_A{};
  double bus_V = 0.0, bus_A = 0.0;  // bus_A: sum of the newest esc.Status of all four
};

struct SafeState {
  SafeReason reason = SafeReason::none;
  int esc = -1;                 // which ESC, from 0
  std::uint8_t fault_code = 0;  // what that ESC reports, with esc_fault; the airframe's version, with state_version
  std::int64_t time_us = 0;
};

// "ESC 2 silent at 6.031 s: disarmed"
std::string describe(const SafeState& safe);

class FlightComputer {
 public:
  // `controller` and `trajectory` outlive it.
  FlightComputer(const VehicleModel& vehicle, const FlightComputerConfig& config, FlightController& controller,
                 const Trajectory& trajectory, CanBus& state_port, CanBus& esc_port);

  // Takes what arrived, steps control for a complete IMU sample, sends what is due. Call whenever frames may have arrived.
  void poll(std::int64_t now_us);

  FlightPhase phase() const { return phase_; }
  const SafeState& safe_state() const { return safe_; }
  // Disarms for good, for no fault: the flight is over.
  void disarm(std::int64_t now_us) {
    if (phase_ != FlightPhase::safe) go_safe(SafeReason::none, -1, now_us);
  }
  // Disarms for good: what runs this computer is too far behind real time.
  void miss_time(std::int64_t now_us) {
    if (phase_ != FlightPhase::safe) go_safe(SafeReason::late, -1, now_us);
  }
  // The record of the newest control step, once.
  const FlightRecord* take_record();
  const Estimator& estimator() const { return estimator_; }
  const EscLink& escs() const { return escs_; }
  const FlightController& controller() const { return controller_; }

 private:
  void hear_state_bus(std::int64_t now_us);
  void control_step(const ImuSample& imu, std::int64_t now_us);
  void advance_phase(std::int64_t flown_us, std::int64_t now_us);
  void ask_controller(std::int64_t now_us);
  void watch(std::int64_t now_us);
  void go_safe(SafeReason reason, int esc, std::int64_t now_us);
  void report(std::int64_t imu_time_us, std::int64_t now_us);
  bool all_at(double omega_rad_s, double tolerance) const;
  int slowest_esc() const;
  bool all_escs_silent(std::int64_t now_us) const;

  FlightComputerConfig config_;
  const Trajectory& trajectory_;
  CanBus& state_port_;
  CanBus& esc_port_;
  Estimator estimator_;
  FlightController& controller_;
  protocols::state::StateReceiver receiver_;
  EscLink escs_;
  FlightPhase phase_ = FlightPhase::boot;
  SafeState safe_;
  FlightRecord record_;
  bool record_ready_ = false;
  PoseSample newest_pose_;
  bool pose_arrived_ = false;  // since the control step before
  std::array<double, kRotors> wanted_rad_s_{};
  std::array<std::int64_t, kRotors> off_since_us_{};
  std::int64_t last_imu_us_ = -1;  // arrival
  std::int64_t ready_since_us_ = -1;
  std::array<std::int64_t, kRotors> speed_known_us_{};  // time of the last report with a speed
  std::array<double, kRotors> idle_speed_rad_s_{};      // reported speeds, smoothed: readiness is a matter of the mean
  std::uint64_t steps_ = 0;
  int refused_in_a_row_ = 0;  // answers of the controller
  std::uint8_t report_sequence_ = 0;
};

}  // namespace rotorloop::host
