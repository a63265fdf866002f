// A stand in virtual time behind the ports of any stand file: its instruments answer on emulated buses from their own profiles, the ESC is
// the firmware core on a simulated CAN bus. Session, pollers and files are those of hardware; only the ports differ. No port is opened.
//
// Time. Each bus of instruments has its own clock, moved on by byte times, gaps and turnarounds; whenever a device samples, the world
// (CAN bus, ESC, rotor, mount, and the session that commands them) is moved on to that moment first. The bus that is furthest behind
// goes next, so that a sample is at most one exchange away from the present.
#pragma once
#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "bench/stand/instruments/poller.hpp"
#include "bench/stand/instruments/serial_hub.hpp"
#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/session.hpp"
#include "bench/stand/virtual/signal_chain.hpp"
#include "bench/stand/virtual/stand_rotor.hpp"
#include "sim/world/lockstep_bus.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::virtual_stand {

struct VirtualStandConfig {
  StandRotorConfig rotor;
  ChainErrors errors;
  ChainProperties properties;
  modbus::LineFaults line;  // of every bus of instruments
  std::int64_t turnaround_jitter_ns = 300'000;
  double air_temperature_degC = 20.0, air_humidity_percent = 45.0;  // pressure follows from the density
  int optical_marks = 1;                            // what an independent speed sensor counts a turn, over what it takes for a turn
  double shake_s2_m = 4e-6;                         // vibration of the mount over the square of rotor speed: m/s² rms for each (rad/s)²
  double chipped_at_s = 0.0, chipped_shake = 20.0;  // from then on (0: never) a blade lacks a piece: the mount shakes as many times as much
  std::string dies;                                 // a device that says nothing from dies_at_s on
  double dies_at_s = 0.0;
  // What an axis shows instead, given what each axis should show; none: what it should.
  using TrueReading = std::function<double(modbus::StandAxis)>;
  std::function<double(modbus::StandAxis, const TrueReading&)> shows;
  std::uint64_t seed = 1;
};

class VirtualStand {
 public:
  VirtualStand(const modbus::StandSetup& setup, const VirtualStandConfig& config);
  ~VirtualStand();

  TimedBus& bus() { return *tool_port_; }
  const StandRotor& rotor() const { return *rotor_; }
  StandRotor& rotor() { return *rotor_; }
  // Until the session is done, or `most_s` of virtual time are over. `every` is called each 20 ms of virtual time.
  void run(stand_run::Session& session, double most_s, const std::function<void()>& every = {});
  double now_s() const { return 1e-9 * static_cast<double>(can_.now_ns()); }
  modbus::SerialHub::Counts line_counts() const;

 private:
  struct State {
    std::int64_t t_ns;
    std::array<double, 2> reading;
    double omega_rad_s, supply_V, supply_A;
  };
  struct Bus;
  void follow(std::int64_t now_ns);             // ESC, rotor and mount, to the bus's time
  void advance_to(std::int64_t time_ns);        // CAN bus and all that hangs on it, the session too
  const State& at(std::int64_t time_ns) const;  // the newest state that is not later
  void make_bus(std::size_t index);
  void show(std::size_t bus, std::size_t device, modbus::SlaveDevice& slave, std::int64_t now_ns);
  double shown(modbus::StandAxis axis, const State& state) const;

  const modbus::StandSetup& setup_;
  VirtualStandConfig config_;
  sim::VirtualBus can_;
  CanBus *esc_port_, *port_;
  std::unique_ptr<StandRotor> rotor_;
  std::unique_ptr<sim::LockstepBus> tool_port_;
  SignalChain chain_;
  std::vector<std::unique_ptr<Bus>> buses_;
  std::deque<State> states_;  // of the last second
  std::int64_t followed_ns_ = 0, next_session_ns_ = 0, next_every_ns_ = 0;
  stand_run::Session* session_ = nullptr;
  std::function<void()> every_;
};

}  // namespace rotorloop::virtual_stand
