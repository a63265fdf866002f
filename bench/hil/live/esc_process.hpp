// One ESC as a participant of a live bus: the firmware core with its node, its drive, a propeller in still air and a battery, moved on by
// the time of the bus. The same objects fly in `rotorloop hil`. Here they also have a flash and a reset: parameters are saved and loaded,
// a restart starts motor control and node anew from what is stored, an update runs the updater of firmware/update until it ends.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "bench/hil/live/esc_boot.hpp"
#include "firmware/core/node/esc_node.hpp"
#include "host/bus/timed_bus.hpp"
#include "sim/drive/battery.hpp"
#include "sim/esc/native_esc.hpp"
#include "sim/esc/noded_esc.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::live {

struct EscProcessConfig {
  std::filesystem::path plant;  // drive, propeller and battery are those of its first rotor
  std::uint8_t node_id = 1;     // 0: asks an allocator for one
  std::uint8_t esc_index = 0;
  std::array<std::uint8_t, 16> unique_id{};
  bool require_arming = true;
  std::filesystem::path store;  // file of its flash; parameters saved there go before those above. Empty: lost with the object
  double pace = 1.0;            // seconds of the ESC per second of the bus
  std::uint64_t seed = 1;
};

// The bridge began or ended to switch. Times are the ESC's own: what they say does not depend on how busy the machine is.
struct BridgeChange {
  bool on = false;
  double t_s = 0.0;              // since the ESC was made
  double since_command_s = 0.0;  // since the newest command that arrived; not-a-number: none has
};

// What the configuration says, checked. Throws Error.
firmware::Parameters given_parameters(const EscProcessConfig& config);
// Torque of the propeller in still air over its speed squared, from the blade-element rotor.
double static_load_N_m_s2(const sim::Rotor& rotor, double density_kg_m3);

// Constant for an ESC that was given none: the same command line is the same device to autopilots and tools.
std::array<std::uint8_t, 16> default_unique_id(std::uint8_t esc_index);

class EscProcess {
 public:
  // Throws Error for a plant file or a store that cannot be used and for parameters out of range.
  EscProcess(const EscProcessConfig& config, TimedBus& bus);
  ~EscProcess();

  std::function<void(const BridgeChange&)> on_bridge;  // may be empty

  // Moves the ESC on to the present of the bus. A process that was held up for long does not catch up: its time falls behind, counted.
  void advance();
  // When it has something to do again.
  std::int64_t next_ns() const;

  bool operational() const;  // and no update runs
  bool updating() const { return updater_ != nullptr; }
  const sim::SimulatedBoard<BoardPages>& board() const { return esc_->board(); }
  bool bridge_on() const { return bridge_; }  // it switches: the motor is driven
  std::uint8_t node_id() const;               // 0: not yet allocated
  int esc_index() const;
  bool parameters_stored() const { return stored_; }             // those in force came from the store
  const firmware::ImageHeader& image() const { return image_; }  // that was started last
  int starts() const { return starts_; }                         // of the application, the first one counted
  void press_button() { esc_->node().on_button(); }
  // A hand that holds the shaft at this speed whatever the motor does; nothing: it lets go.
  void turn_by_hand(std::optional<double> omega_rad_s) { hand_rad_s_ = omega_rad_s; }
  bool windings_shorted() const { return esc_->esc().control().watch().shorted(); }
  const EscFlash& flash() const { return flash_; }
  const firmware::EscNode& node() const;
  firmware::Telemetry telemetry() const;
  double omega_rad_s() const;  // true
  double battery_V() const { return battery_.voltage_V(); }
  std::int64_t time_lost_ns() const { return lost_ns_; }

 private:
  using Esc = sim::NodedEsc<sim::NativeEsc, firmware::EscNode, BoardPages>;
  void step_period();
  void look_at_bridge();
  void run_processor();
  void run_updater();
  void reset(firmware::ResetCause cause);
  void couple();
  firmware::Parameters stored_or_given(firmware::StoreState& state);

  EscProcessConfig config_;
  TimedBus& bus_;
  sim::PlantFile plant_;
  sim::SharedRotors rotors_;
  sim::Battery battery_;
  EscFlash flash_;
  std::unique_ptr<Esc> esc_;
  std::optional<double> hand_rad_s_;
  std::unique_ptr<EscFlash::Updater> updater_;  // while it runs in place of the application
  firmware::ImageHeader image_{};
  double load_N_m_s2_ = 0.0;
  std::int64_t begun_ns_, lost_ns_ = 0;
  std::uint64_t periods_ = 0, busy_until_ = 0;  // the processor stands still while its flash works
  std::uint64_t commanded_at_ = 0;              // period in which the newest command arrived
  std::uint32_t commands_ = 0;
  bool bridge_ = false;
  int starts_ = 0;
  bool stored_ = false;
};

}  // namespace rotorloop::live
