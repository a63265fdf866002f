// One ESC as a participant of a live bus: the firmware core with its node, its drive, a propeller in still air and a battery, moved on by
// the time of the bus. The same objects fly in `rotorloop hil`.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "firmware/core/node/esc_node.hpp"
#include "host/bus/timed_bus.hpp"
#include "sim/drive/battery.hpp"
#include "sim/esc/native_esc.hpp"
#include "sim/esc/noded_esc.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::live {

struct EscProcessConfig {
  std::filesystem::path plant;  // drive, propeller and battery are those of its first rotor
  std::uint8_t node_id = 1;
  std::uint8_t esc_index = 0;
  std::array<std::uint8_t, 16> unique_id{};
  bool require_arming = true;
  double pace = 1.0;  // seconds of the ESC per second of the bus
  std::uint64_t seed = 1;
};

// Constant for an ESC that was given none: the same command line is the same device to autopilots and tools.
std::array<std::uint8_t, 16> default_unique_id(std::uint8_t esc_index);

class EscProcess {
 public:
  // Throws Error for a plant file that cannot be read and for parameters out of range.
  EscProcess(const EscProcessConfig& config, TimedBus& bus);
  ~EscProcess();

  // Moves the ESC on to the present of the bus. A process that was held up for long does not catch up: its time falls behind, counted.
  void advance();
  // When it has something to do again.
  std::int64_t next_ns() const;

  bool operational() const;
  const firmware::EscNode& node() const;
  firmware::Telemetry telemetry() const;
  double omega_rad_s() const;  // true
  double battery_V() const { return battery_.voltage_V(); }
  std::int64_t time_lost_ns() const { return lost_ns_; }

 private:
  using Esc = sim::NodedEsc<sim::NativeEsc, firmware::EscNode>;
  void step_period();
  void couple();

  EscProcessConfig config_;
  TimedBus& bus_;
  sim::PlantFile plant_;
  sim::SharedRotors rotors_;
  sim::Battery battery_;
  std::unique_ptr<Esc> esc_;
  double load_N_m_s2_ = 0.0;
  std::int64_t begun_ns_, lost_ns_ = 0;
  std::uint64_t periods_ = 0;
};

}  // namespace rotorloop::live
