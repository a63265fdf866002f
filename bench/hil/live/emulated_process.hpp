// One ESC as a participant of a live bus, as the bytes of its program: an emulated chip on its board with drive, propeller and battery. Its
// FDCAN hangs on a virtual bus of its own, and a second port there hands frames to the live bus and back. What it stores is kept for as
// long as the object lives.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "bench/hil/live/esc_process.hpp"
#include "host/bus/timed_bus.hpp"
#include "sim/drive/battery.hpp"
#include "sim/esc/emulated_esc.hpp"
#include "sim/plant/assemble.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::live {

class EmulatedEscProcess {
 public:
  // `config`: what it stores before power-up; its unique id and store are not used, the chip has its own. Throws Error as EscProcess does,
  // and for a plant with another power stage than the program's.
  EmulatedEscProcess(const EscProcessConfig& config, const sim::EscProgram& program, TimedBus& bus);

  // As EscProcess: to the present of the bus, at most 50 ms; what is missed is counted.
  void advance();
  std::int64_t next_ns() const { return bus_.now_ns() + 500'000; }

  int node_id() const { return node_id_; }  // under which it sends; 0: none yet
  double omega_rad_s() const { return esc_->omega_rad_s(); }
  double battery_V() const { return battery_.voltage_V(); }
  std::uint64_t resets() const { return esc_->counters().resets; }
  std::int64_t time_lost_ns() const { return lost_ns_; }

 private:
  void step();

  EscProcessConfig config_;
  TimedBus& bus_;
  sim::PlantFile plant_;
  sim::SharedRotors rotors_;
  sim::Battery battery_;
  sim::VirtualBus wire_;
  CanBus& outside_;
  std::unique_ptr<sim::EmulatedEsc> esc_;
  double load_N_m_s2_ = 0.0;
  std::int64_t begun_ns_, lost_ns_ = 0, steps_ = 0;
  int node_id_ = 0;
};

}  // namespace rotorloop::live
