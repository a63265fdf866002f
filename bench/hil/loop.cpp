#include "bench/hil/loop.hpp"

#include <fmt/format.h>

#include "bench/hil/cost_meter.hpp"

namespace rotorloop::hil {
namespace {

std::unique_ptr<sim::VirtualBus> make_bus(const LoopConfig& c, const std::vector<sim::BusFault>& faults, std::uint64_t salt) {
  sim::BusConfig b;
  b.ideal = c.ideal_bus;
  b.seed = c.seed * 2 + salt;
  b.faults = faults;
  return std::make_unique<sim::VirtualBus>(b);
}

// What was written into an ESC when it was set up: the motor's data sheet (the defaults) and the nominal propeller, not the
// plant's truth about wear or damage.
firmware::Parameters firmware_parameters(const host::VehicleModel& vehicle) {
  firmware::Parameters p;
  p.inertia_kg_m2 = static_cast<float>(vehicle.rotor_inertia_kg_m2);
  p.load_N_m_s2 = static_cast<float>(vehicle.c_q_N_m_s2);
  return p;
}

// ESP, and the number of the ESC; 0x45534E01 to 03 are streams of the first native ESC (sim/esc/native_esc_body.hpp).
constexpr std::uint64_t kSpeedNoiseModule = 0x45535000;

firmware::NodeIdentity identity(int esc) {
  firmware::NodeIdentity id;
  id.unique_id[0] = 0x52;
  id.unique_id[15] = static_cast<std::uint8_t>(esc + 1);
  id.feedback_with_voltage = true;
  return id;
}

}  // namespace

Loop::Loop(const sim::PlantFile& plant, const sim::Rotors& rotors, const host::VehicleModel& vehicle, const host::Trajectory& trajectory,
           const LoopConfig& config)
    : config_(config),
      ticks_per_step_(kTicks_per_s / config.airframe_Hz),
      esc_bus_(make_bus(config, config.esc_bus_faults, 0)),
      state_bus_(make_bus(config, config.state_bus_faults, 1)) {
  CanBus& computer_state = state_bus_->attach({.name = "computer"});
  CanBus& airframe_state = state_bus_->attach({.name = "airframe"});
  CanBus& computer_esc = esc_bus_->attach({.name = "computer"});

  sim::AirframeState initial;
  initial.p_W_m = trajectory.at(0.0).p_W_m;
  const double yaw = trajectory.at(0.0).yaw_rad;
  const SinCos half = sincos_exact(0.5 * yaw);
  initial.q_WB = Eigen::Quaterniond(half.cos, 0.0, 0.0, half.sin);
  sim::PlantSetup setup = sim::plant_setup(plant, rotors, 1'000'000'000 / config.airframe_Hz, config.seed);
  setup.pose.drift_enabled = config.pose_drift;
  sim::EffectSet effects = sim::effect_set(plant);
  effects.prepare(setup);
  dynamics_ = std::make_unique<sim::FlightDynamics>(setup, rotors, std::move(effects), initial, config.computer.start_us * 1000);
  battery_.emplace(setup.battery);  // as the effects left it
  sensors_ = std::make_unique<sim::SensorNode>(sim::ImuSensor(setup.imu, setup.body, config.seed), sim::PoseSensor(setup.pose, config.seed),
                                               airframe_state);
  computer_ = std::make_unique<host::FlightComputer>(vehicle, config.computer, trajectory, computer_state, computer_esc);

  escs_.reserve(4);
  for (int i = 0; i < 4; ++i) {
    const auto index = static_cast<std::size_t>(i);
    firmware::Parameters p = firmware_parameters(vehicle);
    p.node_id = config.computer.escs.esc_node_ids[index];
    p.esc_index = static_cast<std::uint8_t>(i);
    p.fast_channel = config.fast_channel_Hz > 0;
    p.fast_feedback_Hz = config.fast_channel_Hz > 0 ? 1000 : 0;  // every set-point is answered, whatever its rate
    firmware::EscNode node(p, identity(i));
    CanBus& port = esc_bus_->attach({.name = fmt::format("esc{}", i + 1)});
    const double lag_s = setup.esc[index].lag_s + (config.esc[index] == EscModel::lag ? config.esc_lag_s : 0.0);
    if (lag_s > 0.0) {
      escs_.emplace_back(std::in_place_type<Lag>, sim::LagEsc({.time_constant_s = lag_s}), node, port, setup.esc[index],
                         RandomStream(config.seed, kSpeedNoiseModule + index));
    } else {
      sim::NativeEscConfig e;
      e.drive = setup.drive[index];
      e.firmware = p;
      e.bus_V = battery_->voltage_V();
      e.seed = config.seed;
      e.module = static_cast<std::uint64_t>(i);
      escs_.emplace_back(std::in_place_type<Native>, sim::NativeEsc(e), node, port, setup.esc[index],
                         RandomStream(config.seed, kSpeedNoiseModule + index));
    }
  }
  truth_us_.fill(-1);
}

Loop::~Loop() = default;

void Loop::tick() {
  now_ns_ = sim::pwm_tick_ns(2 * tick_);
  {
    CostMeter m(measure_, cost_.bus_ns);
    esc_bus_->advance_to(now_ns_);
    state_bus_->advance_to(now_ns_);
  }
  if (tick_ % ticks_per_step_ == 0) step_plant();
  {
    CostMeter m(measure_, cost_.computer_ns);
    computer_->poll(now_ns_ / 1000);
  }
  step_escs();
  ++tick_;
}

void Loop::step_plant() {
  if (tick_ > 0) {
    CostMeter m(measure_, cost_.airframe_ns);
    std::array<double, 4> omega_dot{};
    double bus_A = 0.0;
    for (std::size_t i = 0; i < 4; ++i)
      std::visit(
          [&](const auto& e) {
            omega_dot[i] = e.esc().shaft_acceleration_rad_s2();
            bus_A += e.esc().bus_current_A();
          },
          escs_[i]);
    bus_A_ = bus_A;
    dynamics_->step(omega_dot);
    battery_->step(bus_A, 1.0 / config_.airframe_Hz);
  }
  for (std::size_t i = 0; i < 4; ++i)
    omega_rad_s_[i] = std::max(0.0, std::visit([](const auto& e) { return e.esc().omega_rad_s(); }, escs_[i]));
  evaluate_rotors();
  for (std::size_t i = 0; i < 4; ++i)
    std::visit([&](auto& e) { e.esc().couple(dynamics_->loads()[i].shaft_torque_N_m, battery_->voltage_V()); }, escs_[i]);

  CostMeter m(measure_, cost_.sensor_ns);
  if (sensors_->poll(now_ns_, airframe().state(), omega_rad_s_)) store_truth();
}

void Loop::evaluate_rotors() {
  CostMeter m(measure_, cost_.rotor_ns);
  dynamics_->evaluate_rotors(omega_rad_s_);
  for (const sim::RotorLoads& l : dynamics_->loads()) {
    ++counters_.rotor_evaluations;
    counters_.inflow_not_converged += l.status == sim::InflowStatus::not_converged ? 1u : 0u;
    counters_.vortex_ring += l.status == sim::InflowStatus::vortex_ring ? 1u : 0u;
    counters_.windmill += l.status == sim::InflowStatus::windmill ? 1u : 0u;
  }
}

void Loop::store_truth() {
  PlantTruth& t = truths_[truth_next_];
  truth_us_[truth_next_] = now_ns_ / 1000;
  truth_next_ = (truth_next_ + 1) % kTruths;
  t.state = airframe().state();
  t.further = airframe().wrench().further;
  const auto& loads = dynamics_->loads();
  for (std::size_t i = 0; i < 4; ++i) {
    t.omega_rad_s[i] = omega_rad_s_[i];
    t.thrust_N[i] = loads[i].force_R_N.z();
    t.shaft_torque_N_m[i] = loads[i].shaft_torque_N_m;
    t.in_plane_R_N[i] = loads[i].force_R_N.head<2>();
    t.induced_m_s[i] = loads[i].induced_m_s;
    t.inflow[i] = loads[i].status;
    t.esc[i] = std::visit([](const auto& e) { return e.esc().telemetry(); }, escs_[i]);
    const bool running = t.esc[i].state == firmware::MotorState::running;
    counters_.esc_limited_ticks += running && t.esc[i].limiter != firmware::Limiter::none ? 1u : 0u;
  }
  t.bus_V = battery_->voltage_V();
  t.bus_A = bus_A_;
}

const PlantTruth* Loop::truth_at(std::int64_t time_us) const {
  for (std::size_t i = 0; i < kTruths; ++i)
    if (truth_us_[i] == time_us) return &truths_[i];
  return nullptr;
}

bool Loop::halted(int esc) const {
  for (const EscHalt& h : config_.halts)
    if (h.esc == esc && now_ns_ >= h.at_ns && now_ns_ < h.until_ns) return true;
  return false;
}

void Loop::step_escs() {
  CostMeter m(measure_, cost_.esc_ns);
  std::array<sim::NativeEsc*, 4> native{};
  std::size_t natives = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const bool dead = !config_.halts.empty() && halted(static_cast<int>(i));
    const auto run_node = [&](auto& e) {
      if (dead) {
        e.esc().set_setpoint({});
      } else {
        e.run_node();
      }
    };
    if (auto* e = std::get_if<Native>(&escs_[i])) {
      run_node(*e);
      native[natives++] = &e->esc();
    } else {
      auto& lag = std::get<Lag>(escs_[i]);
      run_node(lag);
      lag.esc().step_current_loop();
    }
  }
  sim::NativeEsc::step_current_loops({native.data(), natives});
}

}  // namespace rotorloop::hil
