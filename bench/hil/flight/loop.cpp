#include "bench/hil/flight/loop.hpp"

#include <fmt/format.h>

#include <tuple>
#include <type_traits>

#include "bench/hil/flight/cost_meter.hpp"
#include "bench/hil/flight/esc_parameters.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {

std::unique_ptr<sim::VirtualBus> make_bus(const LoopConfig& c, const std::vector<sim::BusFault>& faults, std::uint64_t salt) {
  sim::BusConfig b;
  b.ideal = c.ideal_bus;
  b.seed = c.seed * 2 + salt;
  b.faults = faults;
  return std::make_unique<sim::VirtualBus>(b);
}

// ESP, and the number of the ESC; 0x45534E01 to 03 are streams of the first native ESC (sim/esc/native_esc_body.hpp).
constexpr std::uint64_t kSpeedNoiseModule = 0x45535000;

// ESCs of one board, stepped side by side.
template <class Esc>
struct EscGroup {
  std::array<Esc*, 4> escs{};
  std::size_t count = 0;
  void add(Esc& esc) { escs[count++] = &esc; }
  void step() {
    if (count > 0) Esc::step_current_loops({escs.data(), count});
  }
};

firmware::NodeIdentity identity(int esc) {
  firmware::NodeIdentity id;
  id.unique_id[0] = 0x52;
  id.unique_id[15] = static_cast<std::uint8_t>(esc + 1);
  id.feedback_with_voltage = true;
  return id;
}

// What stands between node and motor of a native ESC has no place in a chip.
void check_emulated(const sim::BoardStage& stage, const sim::EscSetup& box, const sim::EscProgram& program) {
  if (stage.name != program.pins.stage)
    throw Error({"esc.kind",
                 fmt::format("\"emulated\" on stage {}: {} is a program for {}", stage.name, program.elf.filename().generic_string(),
                             program.pins.stage),
                 "", "use \"native\" for this plant"});
  if (box.speed_scale != 1.0 || box.speed_noise_rad_s != 0.0 || box.report_delay_ns != 0 || box.lag_s != 0.0)
    throw Error({"esc.kind", "\"emulated\" in a plant with an effect on what an ESC measures, reports or follows",
                 "such effects lie between node and motor control, which here are one program", "use \"native\", or leave the effect out"});
}

// Energy that an ESC took from the bus since its start.
template <class Esc>
double taken_by_J(const Esc& esc) {
  if constexpr (std::is_same_v<Esc, sim::EmulatedEsc>)
    return esc.bus_energy_J();
  else
    return esc.drive().bus_energy_J();
}

}  // namespace

FlyingPlant make_flying_plant(const sim::PlantFile& plant, const sim::Rotors& rotors, const host::Trajectory& trajectory,
                              const LoopConfig& config, CanBus& state_port) {
  sim::AirframeState initial;
  initial.p_W_m = trajectory.at(0.0).p_W_m;
  const double yaw = trajectory.at(0.0).yaw_rad;
  const SinCos half = sincos_exact(0.5 * yaw);
  initial.q_WB = Eigen::Quaterniond(half.cos, 0.0, 0.0, half.sin);
  sim::PlantSetup setup = sim::plant_setup(plant, rotors, 1'000'000'000 / config.airframe_Hz, config.seed);
  setup.pose.drift_enabled = config.pose_drift;
  sim::EffectSet effects = sim::effect_set(plant);
  effects.prepare(setup);
  auto dynamics = std::make_unique<sim::FlightDynamics>(setup, rotors, std::move(effects), initial, config.computer.start_us * 1000);
  auto sensors = std::make_unique<sim::SensorNode>(sim::ImuSensor(setup.imu, setup.body, config.seed),
                                                   sim::PoseSensor(setup.pose, config.seed), state_port);
  return {std::move(setup), std::move(dynamics), std::move(sensors)};
}

Loop::Loop(const sim::PlantFile& plant, const sim::Rotors& rotors, const host::VehicleModel& vehicle, const host::Trajectory& trajectory,
           std::unique_ptr<host::FlightController> controller, const LoopConfig& config)
    : config_(config),
      ticks_per_step_(kTicks_per_s / config.airframe_Hz),
      esc_bus_(make_bus(config, config.esc_bus_faults, 0)),
      state_bus_(make_bus(config, config.state_bus_faults, 1)),
      controller_(std::move(controller)) {
  CanBus& computer_state = state_bus_->attach({.name = "computer"});
  CanBus& airframe_state = state_bus_->attach({.name = "airframe"});
  CanBus& computer_esc = esc_bus_->attach({.name = "computer"});

  FlyingPlant flying = make_flying_plant(plant, rotors, trajectory, config, airframe_state);
  const sim::PlantSetup& setup = flying.setup;
  dynamics_ = std::move(flying.dynamics);
  sensors_ = std::move(flying.sensors);
  battery_.emplace(setup.battery);  // as the effects left it
  if (plant.esc.typical) supply_.emplace(setup.battery, sim::CableParameters{});
  computer_ = std::make_unique<host::FlightComputer>(vehicle, config.computer, *controller_, trajectory, computer_state, computer_esc);

  escs_.reserve(4);
  for (int i = 0; i < 4; ++i) {
    const auto index = static_cast<std::size_t>(i);
    firmware::Parameters p = esc_parameters(plant, vehicle, i, rotors[index]->blade_inertia_kg_m2(), config.seed);
    p.node_id = config.computer.escs.esc_node_ids[index];
    p.esc_index = static_cast<std::uint8_t>(i);
    p.fast_channel = config.fast_channel_Hz > 0;
    p.fast_feedback_Hz = config.fast_channel_Hz > 0 ? 1000 : 0;  // every set-point is answered, whatever its rate
    add_esc(i, plant, setup, p);
  }
  truth_us_.fill(-1);
}

Loop::~Loop() = default;

void Loop::add_esc(int esc, const sim::PlantFile& plant, const sim::PlantSetup& setup, const firmware::Parameters& parameters) {
  const auto index = static_cast<std::size_t>(esc);
  const sim::EscSetup& box = setup.esc[index];
  const std::string name = fmt::format("esc{}", esc + 1);
  const RandomStream noise(config_.seed, kSpeedNoiseModule + index);
  const firmware::EscNode node(parameters, identity(esc));
  const EscModel model = config_.esc[index];
  const double lag_s = box.lag_s + (model == EscModel::lag ? config_.esc_lag_s : 0.0);
  sim::NativeEscConfig e;
  e.drive = setup.drive[index];
  e.firmware = parameters;
  e.bus_V = bus_V();
  e.seed = config_.seed;
  e.module = static_cast<std::uint64_t>(esc);
  e.typical_board = plant.esc.typical;
  e.own_clock = plant.esc.own_clock;
  if (model == EscModel::emulated) {
    check_emulated(*plant.esc.stage, box, *config_.program);
    escs_.emplace_back(Emulated{sim::EmulatedEsc(*config_.program, e, *esc_bus_, name)});
    return;
  }
  CanBus& port = esc_bus_->attach({.name = name});
  if (lag_s > 0.0)
    escs_.emplace_back(std::in_place_type<Lag>, sim::LagEsc({.time_constant_s = lag_s}), node, port, box, noise);
  else
    add_native_esc(*plant.esc.stage, e, node, port, box, noise);
}

void Loop::add_native_esc(const sim::BoardStage& stage, const sim::NativeEscConfig& esc, const firmware::EscNode& node, CanBus& port,
                          const sim::EscSetup& setup, RandomStream noise) {
  const auto add = [&]<class Esc>(std::type_identity<Esc>) {
    if (&stage == &Esc::stage()) escs_.emplace_back(std::in_place_type<Noded<Esc>>, Esc(esc), node, port, setup, noise);
  };
  add(std::type_identity<sim::NativeEsc>{});
  add(std::type_identity<sim::SmallNativeEsc>{});
  add(std::type_identity<sim::HighVoltageNativeEsc>{});
}

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
            esc_A_[i] = e.esc().bus_current_A();
            bus_A += esc_A_[i];
          },
          escs_[i]);
    bus_A_ = bus_A;
    dynamics_->step(omega_dot);
    if (supply_)
      set_ripple();
    else
      battery_->step(bus_A, 1.0 / config_.airframe_Hz);
  }
  for (std::size_t i = 0; i < 4; ++i)
    omega_rad_s_[i] = std::max(0.0, std::visit([](const auto& e) { return e.esc().omega_rad_s(); }, escs_[i]));
  evaluate_rotors();
  for (std::size_t i = 0; i < 4; ++i)
    std::visit([&](auto& e) { e.esc().couple(dynamics_->loads()[i].shaft_torque_N_m, bus_V()); }, escs_[i]);

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
  t.bus_V = bus_V();
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

// The shared bus follows every period of the ESCs; it is theirs for the next one.
void Loop::step_supply() {
  std::array<double, 4> current_A{};
  const double before_V = supply_->voltage_V();
  for (std::size_t i = 0; i < 4; ++i)
    std::visit(
        [&](const auto& e) {
          if constexpr (std::is_same_v<std::remove_cvref_t<decltype(e)>, Lag>) {
            current_A[i] = e.esc().bus_current_A();
          } else {
            const double taken_J = taken_by_J(e.esc());
            current_A[i] = (taken_J - taken_J_[i]) * kTicks_per_s / (before_V > 1.0 ? before_V : 1.0);
            taken_J_[i] = taken_J;
          }
        },
        escs_[i]);
  const double bus_V = supply_->step(current_A, 1.0 / kTicks_per_s);
  for (AnyEsc& any : escs_)
    std::visit(
        [&](auto& e) {
          if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(e)>, Lag>) e.esc().drive().set_bus_V(bus_V);
        },
        any);
}

void Loop::set_ripple() {
  std::array<double, 4> phase{};
  const auto each_native = [&](const auto& act) {
    for (std::size_t i = 0; i < 4; ++i)
      std::visit(
          [&](auto& e) {
            if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(e)>, Lag>) act(e.esc(), i);
          },
          escs_[i]);
  };
  each_native([&](auto& esc, std::size_t i) { phase[i] = esc.pwm_phase(); });
  each_native([&](auto& esc, std::size_t i) {
    esc.drive().set_bus_ripple_V(supply_->ripple_V(i, esc_A_, phase, esc.drive().parameters().inverter.pwm_Hz));
  });
}

void Loop::step_escs() {
  CostMeter m(measure_, cost_.esc_ns);
  std::tuple<EscGroup<sim::NativeEsc>, EscGroup<sim::SmallNativeEsc>, EscGroup<sim::HighVoltageNativeEsc>> groups;
  std::array<sim::EmulatedEsc*, 4> chips{};
  std::size_t chip_count = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const bool dead = !config_.halts.empty() && halted(static_cast<int>(i));
    std::visit(
        [&](auto& e) {
          using Esc = std::remove_cvref_t<decltype(e.esc())>;
          if constexpr (std::is_same_v<Esc, sim::EmulatedEsc>) {
            e.esc().set_power(!dead);
            chips[chip_count++] = &e.esc();
          } else {
            if (dead) {
              e.esc().set_setpoint({});
            } else {
              e.run_node();
            }
            if constexpr (std::is_same_v<Esc, sim::LagEsc>)
              e.esc().step_current_loop();
            else
              std::get<EscGroup<Esc>>(groups).add(e.esc());
          }
        },
        escs_[i]);
  }
  std::apply([](auto&... group) { (group.step(), ...); }, groups);
  if (chip_count > 0) sim::EmulatedEsc::step_together({chips.data(), chip_count}, *esc_bus_, sim::pwm_tick_ns(2 * (tick_ + 1)));
  if (supply_) step_supply();
}

sim::EmulatedCounters Loop::emulated() const {
  sim::EmulatedCounters sum;
  for (const AnyEsc& any : escs_) {
    const auto* e = std::get_if<Emulated>(&any);
    if (e == nullptr) continue;
    const sim::EmulatedCounters c = e->chip.counters();
    sum.instructions += c.instructions;
    sum.resets += c.resets;
    sum.both_gates += c.both_gates;
  }
  return sum;
}

}  // namespace rotorloop::hil
