// A run on real ports: a thread for each bus of instruments, and one for the CAN bus and the session, which never waits for the others.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "bench/stand/instruments/poller.hpp"
#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/session.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop::stand_run {

// What the poller of one bus of the stand file reads.
std::vector<modbus::PolledDevice> polled_devices(const modbus::StandBus& bus);
// The reading of an axis that this sample is, if any: SI units.
std::optional<StandReading> reading_of(const modbus::StandSetup& setup, std::size_t bus, const modbus::Sample& sample);
std::string channel_name(const modbus::StandSetup& setup, std::size_t bus, std::size_t device, std::size_t channel);

class PortPump {
 public:
  // Opens every port of the setup; throws Error (device) for one that cannot be.
  explicit PortPump(const modbus::StandSetup& setup);
  ~PortPump();
  // Until the session is done. `every` is called each 20 ms or so, in the session's thread.
  void run(Session& session, TimedBus& bus, const std::function<void()>& every);

 private:
  struct Shared;
  std::unique_ptr<Shared> shared_;
};

}  // namespace rotorloop::stand_run
