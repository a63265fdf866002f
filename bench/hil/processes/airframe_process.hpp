// The airframe as a process of its own: plant without ESCs, and its sensors. Rotor speeds are what the ESCs report on their bus; IMU and
// pose leave on the state bus; what the controller says it wanted comes back there and is judged against the truth.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>

#include "bench/hil/flight/flight.hpp"
#include "bench/hil/processes/process_end.hpp"
#include "host/bus/timed_bus.hpp"
#include "protocols/state_receiver.hpp"

namespace rotorloop::hil {

class AirframeProcess {
 public:
  // `inputs` and both buses outlive it. One bus may serve as both.
  AirframeProcess(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request, const ProcessPace& pace,
                  TimedBus& state_bus, TimedBus& esc_bus);

  std::function<void(double t_s, const PlantTruth&)> on_truth;  // of each IMU sample; may be empty

  // Takes what arrived and does what is due. Returns when it has something to do again, of the bus's clock; a frame may come earlier.
  std::int64_t advance();
  const ProcessEnd& end() const { return end_; }

  bool begun() const { return begun_; }
  double flown_s() const { return 1e-9 * static_cast<double>(now_ns_); }
  // Tracking error by the set-points that came over the bus (100 Hz).
  TrackingFigures tracking() const { return meter_.figures(); }
  const Lateness* lateness() const { return deadlines_ ? &deadlines_->lateness() : nullptr; }
  const sim::Airframe& airframe() const { return plant_.dynamics->airframe(); }
  double fastest_rad_s() const { return fastest_rad_s_; }
  // Frames that crossed the buses: reports of ESCs and of the controller heard.
  std::uint64_t feedback_heard() const { return feedback_heard_; }
  std::uint64_t setpoints_heard() const { return setpoints_heard_; }

 private:
  void hear_escs();
  void hear_controller();
  void look_for_others();
  void look_for_silence();
  bool due();
  void step_ms();
  void sample();
  PlantTruth truth() const;
  void judge(const protocols::state::TrackingSetpoint& setpoint);
  void finish(ExitCode code, std::string reason);
  void run_down(ExitCode code, std::string reason);

  LoopConfig config_;
  ProcessPace pace_;
  TimedBus& state_bus_;
  TimedBus& esc_bus_;
  FlyingPlant plant_;
  protocols::state::StateReceiver receiver_;
  TrackingMeter meter_;
  std::optional<Deadlines> deadlines_;
  ProcessEnd end_, pending_;  // pending: the flight is over, the motors run down
  std::int64_t now_ns_ = 0, end_ns_, run_down_until_ns_ = -1;
  std::int64_t opened_ns_, heard_ns_;  // of the bus's clock; the newest answer of the others
  bool begun_ = false, controller_heard_ = false, was_armed_ = false, tracking_ = false;
  std::set<int> nodes_;
  std::array<bool, 4> answered_{};
  std::array<double, 4> reported_rad_s_{}, omega_rad_s_{};
  double fastest_rad_s_ = 0.0;
  std::uint64_t feedback_heard_ = 0, setpoints_heard_ = 0;
  static constexpr std::size_t kTruths = 64;  // of as many ms
  std::array<Eigen::Vector3d, kTruths> truth_p_W_m_{};
};

}  // namespace rotorloop::hil
