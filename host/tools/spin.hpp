// Turning one motor from a tool: asks for its arming, ramps its set-point, watches what comes back, and ends with a stop whatever happens.
// Orders carry their time-out (250 ms in the ESC): a tool that is killed stops the motor by its silence.
#pragma once
#include <cstdint>
#include <string>

#include "host/tools/esc_table.hpp"

namespace rotorloop::tools {

struct SpinOptions {
  int esc_index = 0;
  bool duty = false;  // value is a share of full duty, -1 to 1; else rpm
  double value = 0.0;
  double ramp_s = 1.0;  // from standstill to the value
  double for_s = 0.0;   // at the most, ramps included
  double most_current_A = 20.0;
  double most_temperature_C = 80.0;
  double most_rpm = 20'000.0;  // seen: a motor without propeller under duty may run away
};

enum class SpinEnd : std::uint8_t {
  running,
  done,      // the time is over
  released,  // the dead-man's switch, or a signal
  foreign_commander,
  silent,        // no esc.Status for a second
  shared_index,  // two nodes have this esc_index
  current,
  temperature,
  too_fast,
  fault,  // health error or critical
};
std::string spin_end_text(SpinEnd end, const SpinOptions& options);

// Throws Error for the first value out of its range.
void check_spin(const SpinOptions& options);

class Spin {
 public:
  static constexpr std::int64_t kCommandPeriod_ns = 20'000'000;
  static constexpr std::int64_t kStopping_ns = 300'000'000;  // zero is sent for this long before the disarming

  // Listens through the tool; check_spin() first.
  Spin(ToolNode& tool, EscTable& table, const SpinOptions& options);

  // Before anything is armed: is the way free? Call after listening for a second or so.
  SpinEnd check_before() const;
  void begin();
  // Sends what is due. `held`: the dead-man's switch. Ends by itself with a stop; done() then.
  void step(bool held);
  bool done() const { return phase_ == Phase::done; }
  SpinEnd end() const { return end_; }
  double set_point() const { return set_point_; }
  double fastest_rpm() const { return fastest_rpm_; }

 private:
  enum class Phase : std::uint8_t { waiting, turning, stopping, done };
  SpinEnd watch() const;
  void send(double value);
  void arm(bool armed);

  ToolNode& tool_;
  EscTable& table_;
  SpinOptions options_;
  Phase phase_ = Phase::waiting;
  SpinEnd end_ = SpinEnd::running;
  std::int64_t begun_ns_ = 0, stopping_ns_ = 0, next_command_ns_ = 0, next_arming_ns_ = 0;
  std::int64_t foreign_ns_ = -1;  // when another node last sent a command that was none of ours
  double set_point_ = 0.0, fastest_rpm_ = 0.0;
};

}  // namespace rotorloop::tools
