// One flight in lockstep: flight computer, four ESCs and airframe with sensors as nodes on two virtual buses, all on one
// virtual clock, in one thread. What they exchange crosses as CAN frames; what physics couples (shaft speed, load
// torque, bus voltage and current) is exchanged inside the plant once per airframe step and never through telemetry.
//
// Order within one 24 kHz tick at time t: buses advance to t; the plant (airframe, rotors, battery) advances at its own rate;
// sensors sample; the flight computer hears and speaks; each ESC runs one current-loop period.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "firmware/core/node/esc_node.hpp"
#include "host/control/flight_controller.hpp"
#include "host/node/flight_computer.hpp"
#include "sim/drive/battery.hpp"
#include "sim/drive/supply.hpp"
#include "sim/esc/emulated_esc.hpp"
#include "sim/esc/lag_esc.hpp"
#include "sim/esc/native_esc.hpp"
#include "sim/esc/noded_esc.hpp"
#include "sim/plant/assemble.hpp"
#include "sim/plant/flight_dynamics.hpp"
#include "sim/sensor/sensor_node.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::hil {

inline constexpr int kTicks_per_s = 24'000;  // current-loop periods

enum class EscModel : std::uint8_t { native, lag, emulated };

// When an ESC loses power or its firmware stops: it neither drives nor talks from then on.
struct EscHalt {
  int esc = 0;  // from 0
  std::int64_t at_ns = 0, until_ns = sim::kNever_ns;
};

struct LoopConfig {
  std::uint64_t seed = 1;
  int airframe_Hz = 2000;  // divides 24 000
  std::array<EscModel, 4> esc{};
  double esc_lag_s = 0.030;
  const sim::EscProgram* program = nullptr;  // of the emulated ones; outlives the loop
  int fast_channel_Hz = 1000;
  bool ideal_bus = false;  // frames are delivered at once (ablation)
  bool pose_drift = true;
  std::vector<sim::BusFault> esc_bus_faults, state_bus_faults;
  std::vector<EscHalt> halts;
  host::FlightComputerConfig computer;
};

// The plant without its ESCs, on its launch stand where the trajectory begins, and its sensors on the state bus.
struct FlyingPlant {
  sim::PlantSetup setup;  // as the plant's effects left it
  std::unique_ptr<sim::FlightDynamics> dynamics;
  std::unique_ptr<sim::SensorNode> sensors;
};
// `rotors` and `state_port` outlive it.
FlyingPlant make_flying_plant(const sim::PlantFile& plant, const sim::Rotors& rotors, const host::Trajectory& trajectory,
                              const LoopConfig& config, CanBus& state_port);

// Ports in the order in which they are attached; BusFault::port counts the same way.
inline constexpr int kComputerPort = 0;              // on both buses
inline constexpr int kAirframePort = 1;              // on the state bus
constexpr int esc_port(int esc) { return 1 + esc; }  // on the ESC bus, from 0

// Time spent per module, filled only when asked for (it costs a clock reading per call).
struct ModuleCost {
  std::int64_t bus_ns = 0, airframe_ns = 0, rotor_ns = 0, sensor_ns = 0, computer_ns = 0, esc_ns = 0, log_ns = 0;
};

struct PlantTruth {
  sim::AirframeState state;
  std::array<double, 4> omega_rad_s{}, thrust_N{}, shaft_torque_N_m{}, induced_m_s{};
  std::array<Eigen::Vector2d, 4> in_plane_R_N{};  // force in the disk plane
  std::array<sim::InflowStatus, 4> inflow{};
  sim::Wrench further;  // what the plant's effects put on the body over the last step
  std::array<firmware::Telemetry, 4> esc;
  double bus_V = 0.0, bus_A = 0.0;
};

// Counts of what a run should not contain in silence.
struct PlantCounters {
  std::uint64_t rotor_evaluations = 0;
  std::uint64_t inflow_not_converged = 0;
  std::uint64_t vortex_ring = 0, windmill = 0;
  std::uint64_t esc_limited_ticks = 0;  // ESC x airframe step in which a limiter acted while running
};

class Loop {
 public:
  // `rotors` and `trajectory` are shared between flights and must outlive the loop.
  Loop(const sim::PlantFile& plant, const sim::Rotors& rotors, const host::VehicleModel& vehicle, const host::Trajectory& trajectory,
       std::unique_ptr<host::FlightController> controller, const LoopConfig& config);
  ~Loop();
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  // One tick. After it, record() is set when the flight computer completed a control step, and truth_at() knows its instant.
  void tick();
  std::int64_t now_ns() const { return now_ns_; }
  double now_s() const { return static_cast<double>(now_ns_) * 1e-9; }

  // The newest control step of the flight computer, once.
  const host::FlightRecord* take_record() { return computer_->take_record(); }
  // The plant at an IMU sampling instant of the last 16 ms; null for any other time.
  const PlantTruth* truth_at(std::int64_t time_us) const;

  const sim::Airframe& airframe() const { return dynamics_->airframe(); }
  const host::FlightComputer& computer() const { return *computer_; }
  // Disarms the motors: whoever paces the flight cannot keep up.
  void miss_time() { computer_->miss_time(now_ns_ / 1000); }
  sim::VirtualBus& esc_bus() { return *esc_bus_; }
  sim::VirtualBus& state_bus() { return *state_bus_; }
  const PlantCounters& counters() const { return counters_; }
  const sim::SensorNode& sensors() const { return *sensors_; }
  void measure_cost(bool on) { measure_ = on; }
  // Of all chips together; zero without emulated ESCs.
  sim::EmulatedCounters emulated() const;
  const ModuleCost& cost() const { return cost_; }
  ModuleCost& cost() { return cost_; }

 private:
  template <class Esc>
  using Noded = sim::NodedEsc<Esc, firmware::EscNode>;
  using Lag = Noded<sim::LagEsc>;
  // With the shape of Noded: the node is inside of the chip.
  struct Emulated {
    sim::EmulatedEsc chip;
    sim::EmulatedEsc& esc() { return chip; }
    const sim::EmulatedEsc& esc() const { return chip; }
  };
  // One firmware on three boards; all four ESCs of a plant are of one kind unless some are lags or emulated.
  using AnyEsc = std::variant<Noded<sim::NativeEsc>, Noded<sim::SmallNativeEsc>, Noded<sim::HighVoltageNativeEsc>, Lag, Emulated>;

  void step_plant();
  void evaluate_rotors();
  void store_truth();
  void add_esc(int esc, const sim::PlantFile& plant, const sim::PlantSetup& setup, const firmware::Parameters& parameters);
  void add_native_esc(const sim::BoardStage& stage, const sim::NativeEscConfig& esc, const firmware::EscNode& node, CanBus& port,
                      const sim::EscSetup& setup, RandomStream noise);
  void step_escs();
  double bus_V() const { return supply_ ? supply_->voltage_V() : battery_->voltage_V(); }
  void step_supply();
  void set_ripple();
  bool halted(int esc) const;

  LoopConfig config_;
  std::int64_t tick_ = 0, now_ns_ = 0;
  int ticks_per_step_;
  std::unique_ptr<sim::VirtualBus> esc_bus_, state_bus_;
  std::unique_ptr<sim::FlightDynamics> dynamics_;
  std::unique_ptr<sim::SensorNode> sensors_;
  std::unique_ptr<host::FlightController> controller_;
  std::unique_ptr<host::FlightComputer> computer_;
  std::vector<AnyEsc> escs_;
  std::optional<sim::Battery> battery_;  // made once the effects have had their say
  std::optional<sim::Supply> supply_;    // in its place where boards are drawn: stepped with the ESCs
  std::array<double, 4> taken_J_{};      // from the supply until the last tick
  std::array<double, 4> esc_A_{};        // mean bus currents of the last airframe step
  double bus_A_ = 0.0;
  std::array<double, 4> omega_rad_s_{};  // at the start of the airframe step
  static constexpr std::size_t kTruths = 16;
  std::array<PlantTruth, kTruths> truths_{};
  std::array<std::int64_t, kTruths> truth_us_{};
  std::size_t truth_next_ = 0;
  PlantCounters counters_;
  bool measure_ = false;
  ModuleCost cost_;
};

}  // namespace rotorloop::hil
