// A controller in a process of its own behind the seam of host/control: asks it in lockstep, checks what it answers, and puts our loops
// below the level that it commands.
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

#include "bench/hil/controllers/handshake.hpp"
#include "bench/hil/controllers/line_process.hpp"
#include "host/control/flight_controller.hpp"

namespace rotorloop::hil {

struct ProcessControllerConfig {
  std::string name, command;
  double timeout_s = 10.0;
  HandshakeSetup setup;
  host::ControllerConfig below;             // our loops, with the vehicle's added terms
  const std::atomic<bool>* stop = nullptr;  // ends a wait
};

class ProcessController final : public host::FlightController {
 public:
  // Starts the program and takes its first answer; what goes wrong is failure(). Standard error goes to <log_folder>/controller.log.
  ProcessController(const host::VehicleModel& vehicle, const ProcessControllerConfig& config);

  host::Command step(const host::ControlInput& input) override;
  const host::ControllerCounters& counters() const override { return state_.counters; }
  const char* failure() const override { return failure_.empty() ? nullptr : failure_.c_str(); }
  const HandshakeHello& hello() const { return hello_; }

 private:
  void ask(const rotorloop_controller_input& in);
  bool receive(std::string& line, const std::string& when);
  void fail(const std::string& what);
  bool usable(const rotorloop_controller_output& out) const;
  host::Command command_of_answer(const host::ControlInput& input);
  host::Command speeds_of_answer(const host::ControlInput& input);

  ProcessControllerConfig config_;
  host::Controller below_;
  host::ControllerState state_;
  double most_thrust_N_;
  HandshakeHello hello_;
  std::string failure_;
  LineProcess child_;
  rotorloop_controller_output answer_ = empty_output();  // as it came
  rotorloop_controller_output good_ = empty_output();    // newest usable one
  bool any_good_ = false;
  std::uint64_t steps_ = 0;
};

}  // namespace rotorloop::hil
