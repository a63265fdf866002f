// Estimator and controller as a process of their own: the flight computer of `rotorloop hil`, on two live buses.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "bench/hil/flight/flight.hpp"
#include "bench/hil/processes/process_end.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop::hil {

// The state bus sample by sample: nothing is received behind an IMU sample until its control step was taken. In lockstep the next sample
// may be there before a poll ends, and two steps in one poll would leave the record of the second alone.
class SampleBySample final : public CanBus {
 public:
  explicit SampleBySample(CanBus& bus) : bus_(bus) {}
  void go_on() { sample_given_ = false; }
  bool sample_given() const { return sample_given_; }
  SendStatus send(const CanFrame& frame) override { return bus_.send(frame); }
  std::optional<StampedFrame> receive() override;
  BusState state() const override { return bus_.state(); }
  PortCounters counters() const override { return bus_.counters(); }
  bool set_filters(std::span<const CanFilter> filters) override { return bus_.set_filters(filters); }

 private:
  CanBus& bus_;
  bool sample_given_ = false;
};

class FlyProcess {
 public:
  // `inputs` and both buses outlive it. One bus may not serve as both. `ceiling_rad_s`: no set-point above it leaves.
  FlyProcess(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request, const ProcessPace& pace, double ceiling_rad_s,
             TimedBus& state_bus, TimedBus& esc_bus, const std::atomic<bool>* stop);

  std::function<void(const host::FlightRecord&)> on_record;  // of each control step; may be empty

  // As AirframeProcess.
  std::int64_t advance();
  const ProcessEnd& end() const { return end_; }
  // Disarms at once and ends: an order of the user, or the end of another process.
  void stop(std::string reason);

  bool begun() const { return record_us_ >= 0; }
  double flown_s() const { return 1e-6 * static_cast<double>(record_us_); }
  const host::FlightComputer& computer() const { return *computer_; }
  // Of a rotor while it waits for take-off: below it no flight begins.
  double idle_rad_s() const { return config_.computer.idle_rad_s; }
  std::uint64_t samples_heard() const { return samples_; }

 private:
  std::int64_t now_us() const;
  void announce();
  void look_for_silence();
  void judge(const host::FlightRecord& record);
  void finish(ExitCode code, std::string reason);

  LoopConfig config_;
  ProcessPace pace_;
  TimedBus& state_bus_;
  SampleBySample sample_bus_;
  std::unique_ptr<host::FlightController> controller_;
  std::unique_ptr<host::FlightComputer> computer_;
  ProcessEnd end_, pending_;
  std::int64_t end_us_, opened_ns_, begun_ns_ = 0, heard_ns_, announced_ns_ = 0;
  std::int64_t record_us_ = -1, run_down_until_us_ = -1;
  std::uint64_t samples_ = 0;
  std::uint8_t announcements_ = 0;
};

}  // namespace rotorloop::hil
