// The seam between the flight computer and what flies: one call each control step, sensors and estimate in, rotor speeds out.
// CascadeController is the project's own; bench/hil/controllers puts any other program behind the same call.
#pragma once
#include <array>
#include <cstdint>

#include "host/control/controller.hpp"
#include "host/control/setpoint.hpp"
#include "host/estimate/samples.hpp"

namespace rotorloop::host {

// Who has the rotors: nobody, the flight computer at idle speed, the controller, or nobody again for good.
enum class ControlPhase : std::uint8_t { boot, spin_up, flying, safe };

// All that a controller learns of one control step; frames W and B, z up.
struct ControlInput {
  std::int64_t time_us = 0;  // of the IMU sample, airframe clock
  ControlPhase phase = ControlPhase::boot;
  ImuSample imu;
  const PoseSample* pose = nullptr;  // newest one that arrived since the step before; null: none
  StateEstimate estimate;            // of the flight computer's own estimator
  Setpoint setpoint;
  std::array<double, kRotors> omega_rad_s{};  // newest feedback; NaN: not known
  double bus_V = 0.0;
};

class FlightController {
 public:
  virtual ~FlightController() = default;
  // Called for every IMU sample, from the first one on, in every phase; what it commands reaches the rotors while `flying`. Never throws.
  virtual Command step(const ControlInput& input) = 0;
  virtual const ControllerCounters& counters() const = 0;
  // Why no further command can come from it; null while it answers.
  virtual const char* failure() const { return nullptr; }
};

// Position, attitude and mixer of this folder.
class CascadeController final : public FlightController {
 public:
  CascadeController(const VehicleModel& vehicle, const ControllerConfig& config) : controller_(vehicle, config) {}
  Command step(const ControlInput& input) override { return controller_.step(state_, input.estimate, input.setpoint); }
  const ControllerCounters& counters() const override { return state_.counters; }

 private:
  Controller controller_;
  ControllerState state_;
};

}  // namespace rotorloop::host
