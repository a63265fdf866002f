#include "bench/hil/flight/flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/hil/controllers/process_controller.hpp"
#include "bench/hil/flight/cost_meter.hpp"
#include "bench/hil/flight/flight_logs.hpp"
#include "host/base/error.hpp"
#include "host/control/gains_file.hpp"
#include "host/control/trajectory_file.hpp"
#include "host/vehicle/thrust.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::hil {
namespace {

constexpr double kTail_s = 0.5;      // flown after the trajectory's end
constexpr double kIdleShare = 0.43;  // of hover speed, while waiting for take-off: the reference's 400 rad/s
constexpr int kAdvanceTicks = kTicks_per_s / 10;

std::vector<sim::BusFault> bus_faults(const Scenario& scenario, const std::string& flight, BusName bus) {
  std::vector<sim::BusFault> out;
  for (const Fault& f : scenario.faults) {
    if (!f.flight.empty() && f.flight != flight) continue;
    sim::BusFault b;
    b.at_ns = static_cast<std::int64_t>(f.at_s * 1e9);
    b.duration_ns = f.duration_s > 0.0 ? static_cast<std::int64_t>(f.duration_s * 1e9) : sim::kNever_ns;
    b.probability = f.probability;
    if (f.kind == FaultKind::node_silent && bus == BusName::esc) {
      b.kind = sim::BusFaultKind::unplugged;
      b.port = esc_port(f.rotor - 1);
    } else if (f.kind == FaultKind::esc_silent && bus == BusName::esc) {
      b.kind = sim::BusFaultKind::unplugged;  // a dead ESC does not acknowledge either; LoopConfig::halts stops its drive
      b.port = esc_port(f.rotor - 1);
    } else if (f.kind == FaultKind::bus_babble && f.bus == bus) {
      b.kind = sim::BusFaultKind::extra_traffic;
      b.frame = CanFrame{.id = 0, .extended = false, .length = 8, .data = {}};
    } else if (f.kind == FaultKind::frame_drop && f.bus == bus) {
      b.kind = sim::BusFaultKind::lose_sent;
    } else if (f.kind == FaultKind::frame_corrupt && f.bus == bus) {
      b.kind = sim::BusFaultKind::corrupt;
    } else {
      continue;
    }
    out.push_back(b);
  }
  return out;
}

EscModel model_of(EscKind kind) {
  return kind == EscKind::lag ? EscModel::lag : kind == EscKind::emulated ? EscModel::emulated : EscModel::native;
}

std::shared_ptr<const sim::EscProgram> read_program(const Scenario& s) {
  if (s.esc.elf.empty())
    throw Error({s.path.generic_string(), "esc.kind \"emulated\" has no program, and none was built", "",
                 "run scripts/firmware, or set [esc] elf = the ELF of the program"});
  return std::make_shared<const sim::EscProgram>(sim::read_esc_program(s.esc.elf, s.esc.board));
}

// Of the rotation between two attitudes.
double angle_rad(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a.conjugate() * b;
  return 2.0 * std::atan2(d.vec().norm(), std::fabs(d.w()));
}

// FlightSums over a flight that become figures of its result.
struct FlightSums {
  std::array<double, 4> rpm_error_square{};
  std::uint64_t rpm_samples = 0, flying_steps = 0, limited_steps = 0, mixer_iterations = 0;
  int mixer_iterations_max = 0;
  double max_speed_m_s = 0.0, max_accel_m_s2 = 0.0;
  double attitude_error_sum_rad = 0.0, attitude_error_max_rad = 0.0, command_sum = 0.0, command_square_sum = 0.0;

  void add(const host::FlightRecord& r, const PlantTruth& truth) {
    if (r.phase != host::FlightPhase::flying) return;
    ++flying_steps;
    bool limited = limiter_bits(r.command.diagnostics.limiters) != 0;
    for (std::size_t i = 0; i < 4; ++i) {
      if (truth.esc[i].limiter != firmware::Limiter::none) limited = true;
      if (!std::isfinite(r.omega_rad_s[i]) || r.commanded_rad_s[i] <= 0.0) continue;
      const double e = r.commanded_rad_s[i] - r.omega_rad_s[i];
      rpm_error_square[i] += e * e;
    }
    ++rpm_samples;
    limited_steps += limited ? 1u : 0u;
    mixer_iterations += static_cast<std::uint64_t>(r.command.diagnostics.mixer_iterations);
    mixer_iterations_max = std::max(mixer_iterations_max, r.command.diagnostics.mixer_iterations);
    const double off_rad = angle_rad(r.command.diagnostics.q_WB_sp, truth.state.q_WB);
    attitude_error_sum_rad += off_rad;  // not a number for good when the controller does not say what it wants
    attitude_error_max_rad = std::max(attitude_error_max_rad, off_rad);
    for (const double w : r.commanded_rad_s) {
      command_sum += w;
      command_square_sum += w * w;
    }
    max_speed_m_s = std::max(max_speed_m_s, truth.state.v_W_m_s.norm());
    max_accel_m_s2 = std::max(max_accel_m_s2, r.setpoint.a_W_m_s2.norm());
  }
};

std::map<std::string, double> counters_of(Loop& loop, const FlightSums& sums, const std::array<sim::BusStatistics, 2>& bus) {
  const auto& est = loop.computer().estimator().counters();
  const auto& ctl = loop.computer().controller().counters();
  const auto count = [](auto v) { return static_cast<double>(v); };
  std::map<std::string, double> counters{
      {"estimator.poses_fused", count(est.poses_fused)},
      {"estimator.poses_gated", count(est.poses_gated)},
      {"estimator.poses_out_of_order", count(est.poses_out_of_order)},
      {"estimator.imu_gaps", count(est.imu_gaps)},
      {"estimator.resets", count(est.resets)},
      {"control.bad_input", count(ctl.bad_input)},
      {"control.limited", count(ctl.limited)},
      {"control.mixer_not_converged", count(ctl.mixer_not_converged)},
      {"control.effects_off", count(ctl.effects_off)},
      {"control.effects_not_finite", count(ctl.effects_not_finite)},
      {"control.effects_bounded", count(ctl.effects_bounded)},
      {"control.effects_not_converged", count(ctl.effects_not_converged)},
      {"control.mixer_iterations_max", count(sums.mixer_iterations_max)},
      {"control.mixer_iterations_mean", sums.flying_steps ? count(sums.mixer_iterations) / count(sums.flying_steps) : 0.0},
      {"rotor.not_converged", count(loop.counters().inflow_not_converged)},
      {"rotor.vortex_ring", count(loop.counters().vortex_ring)},
      {"rotor.evaluations", count(loop.counters().rotor_evaluations)},
      {"esc.limited_samples", count(loop.counters().esc_limited_ticks)},
      {"bus.esc.frames", count(bus[0].frames)},
      {"bus.esc.error_frames", count(bus[0].error_frames)},
      {"bus.state.frames", count(bus[1].frames)},
      {"bus.state.error_frames", count(bus[1].error_frames)},
      {"sensor.frames_refused", count(loop.sensors().refused())}};
  if (const sim::EmulatedCounters chips = loop.emulated(); chips.instructions > 0) {
    counters["esc.chip_instructions"] = count(chips.instructions);
    counters["esc.chip_resets"] = count(chips.resets);
    counters["esc.chip_both_gates"] = count(chips.both_gates);
  }
  return counters;
}

bool ended_early(const Loop& loop, FlightResult& result) {
  if (const char* why = loop.computer().controller().failure()) {
    result.end = FlightEnd::incomplete;
    result.end_detail = why;
    return true;
  }
  const bool safe = loop.computer().phase() == host::FlightPhase::safe;
  if (safe) {
    result.end = loop.computer().safe_state().reason == host::SafeReason::late ? FlightEnd::late : FlightEnd::safe_state;
    result.end_detail = host::describe(loop.computer().safe_state());
  } else if (loop.airframe().ended()) {
    result.end = FlightEnd::crashed;
    result.end_detail = loop.airframe().status() == sim::AirframeStatus::below_ground ? "below ground" : "diverged";
  }
  return safe || loop.airframe().ended();
}

// Holds a flight to real time, one deadline for each control step; does nothing in lockstep.
class FlightPacer {
 public:
  FlightPacer(const Scenario& scenario, const FlightRequest& q) : clock_(scenario.bus.pace > 0.0 ? q.clock : nullptr) {
    if (!clock_) return;
    pace_ = scenario.bus.pace;
    deadlines_.emplace(clock_->now_ns(), std::llround(kStep_ns / pace_), q.catch_up_ns);
  }
  // Before tick `n`: waits for its time.
  void wait(std::int64_t n, Loop& loop) {
    if (!deadlines_ || n % kTicksPerStep != 0) return;
    clock_->wait_until(deadlines_->next_ns());
    if (!deadlines_->begin_step(clock_->now_ns())) loop.miss_time();
  }
  void report(FlightResult& result) const {
    if (!deadlines_) return;
    result.pace = PaceResult{pace_, deadlines_->lateness()};
    if (result.end != FlightEnd::late) return;
    result.end_detail += fmt::format("; {:.1f} ms behind", 1e-6 * static_cast<double>(deadlines_->lateness().worst_ns));
  }

 private:
  static constexpr int kTicksPerStep = kTicks_per_s / 1000;
  static constexpr double kStep_ns = 1e6;
  WaitClock* clock_;
  double pace_ = 1.0;
  std::optional<Deadlines> deadlines_;
};

void add_figures(Loop& loop, const FlightSums& sums, FlightOutcome& out) {
  FlightResult& result = out.result;
  result.duration_s = loop.now_s();
  result.max_speed_m_s = sums.max_speed_m_s;
  result.max_accel_m_s2 = sums.max_accel_m_s2;
  out.bus = {loop.esc_bus().statistics(), loop.state_bus().statistics()};
  for (std::size_t b = 0; b < 2; ++b) {
    result.bus_load_mean_percent[b] = out.bus[b].mean_load_percent;
    result.bus_load_max_percent[b] = out.bus[b].max_load_percent;
  }
  if (sums.rpm_samples > 0) {
    for (std::size_t i = 0; i < 4; ++i)
      result.rpm_error_rms_rad_s[i] = std::sqrt(sums.rpm_error_square[i] / static_cast<double>(sums.rpm_samples));
    const double steps = static_cast<double>(sums.flying_steps), commands = 4.0 * steps;
    result.limited_share = static_cast<double>(sums.limited_steps) / steps;
    constexpr double kDeg_per_rad = 180.0 / std::numbers::pi;
    result.attitude_error_mean_deg = kDeg_per_rad * sums.attitude_error_sum_rad / steps;
    if (!std::isnan(result.attitude_error_mean_deg)) result.attitude_error_max_deg = kDeg_per_rad * sums.attitude_error_max_rad;
    result.command_mean_rad_s = sums.command_sum / commands;
    result.command_std_rad_s =
        std::sqrt(std::max(0.0, sums.command_square_sum / commands - result.command_mean_rad_s * result.command_mean_rad_s));
  }
  result.counters = counters_of(loop, sums, out.bus);
  out.cost = loop.cost();
}

}  // namespace

Inputs read_inputs(const Scenario& scenario) {
  Inputs in;
  in.plant = sim::read_plant(scenario.plant);
  in.rotors = sim::read_rotors(in.plant);
  const host::VehicleFile vehicle = host::read_vehicle(scenario.vehicle, host::builtin_effect_catalogue());
  in.vehicle = host::to_model(vehicle);
  in.effects = host::terms_of(vehicle, scenario.vehicle.generic_string());
  in.gains = host::read_gains(scenario.gains);
  in.files = {scenario.path, scenario.plant, scenario.vehicle, scenario.gains};
  for (const FlightPlan& f : scenario.flights) {
    in.trajectories.push_back(host::read_trajectory(f.trajectory).trajectory);
    in.files.push_back(f.trajectory);
  }
  for (const auto& r : in.plant.rotors) {
    in.files.insert(in.files.end(), {r.blade_path, r.motor_path});
    const auto polars = sim::read_blade(r.blade_path).polar_files;
    in.files.insert(in.files.end(), polars.begin(), polars.end());
  }
  for (const ExternalController& c : scenario.external)
    if (!c.library.empty()) in.files.push_back(c.library);
  if (scenario.esc.emulated()) {
    in.program = read_program(scenario);
    in.files.insert(in.files.end(), {scenario.esc.elf, scenario.esc.board});
  }
  std::sort(in.files.begin() + 1, in.files.end());
  in.files.erase(std::unique(in.files.begin() + 1, in.files.end()), in.files.end());
  return in;
}

LoopConfig loop_config(const Scenario& scenario, const Inputs& inputs, const FlightRequest& q) {
  LoopConfig c;
  c.seed = q.seed;
  c.airframe_Hz = scenario.airframe_Hz;
  for (std::size_t i = 0; i < 4; ++i) c.esc[i] = model_of(scenario.esc.kind[i]);
  c.program = inputs.program.get();
  c.esc_lag_s = scenario.ablation.esc_lag_s;
  c.fast_channel_Hz = scenario.esc.fast_channel_Hz;
  c.ideal_bus = scenario.ablation.bus == BusModel::direct;
  c.pose_drift = scenario.ablation.drift;
  const std::string& flight = scenario.flights[q.flight].name;
  c.esc_bus_faults = bus_faults(scenario, flight, BusName::esc);
  c.state_bus_faults = bus_faults(scenario, flight, BusName::state);
  for (const Fault& f : scenario.faults)
    if (f.kind == FaultKind::esc_silent && (f.flight.empty() || f.flight == flight))
      c.halts.push_back({f.rotor - 1, static_cast<std::int64_t>(f.at_s * 1e9),
                         f.duration_s > 0.0 ? static_cast<std::int64_t>((f.at_s + f.duration_s) * 1e9) : sim::kNever_ns});
  // A share of hover speed, the same for any size; without [esc] the reference's 400 rad/s.
  if (inputs.plant.esc.given) c.computer.idle_rad_s = kIdleShare * host::hover_omega_rad_s(inputs.vehicle);
  c.computer.estimator.compensate_latency = scenario.ablation.latency_compensation;
  c.computer.escs.fast_channel = scenario.esc.fast_channel_Hz > 0;
  // Without the fast channel, esc.RPMCommand at 200 Hz: two frames each, as fast as autopilots send it.
  c.computer.setpoint_Hz = static_cast<std::uint16_t>(scenario.esc.fast_channel_Hz > 0 ? scenario.esc.fast_channel_Hz : 200);
  return c;
}

namespace {

host::ControllerConfig our_loops(const Inputs& inputs, host::Variant variant) {
  host::ControllerConfig c = host::controller_config(inputs.gains, variant);
  c.terms = inputs.effects.terms;
  return c;
}

}  // namespace

std::unique_ptr<host::FlightController> make_controller(const Scenario& scenario, const Inputs& inputs, const FlightRequest& q,
                                                        const std::atomic<bool>* stop, LoopConfig& config) {
  if (!q.variant.is_external()) return std::make_unique<host::CascadeController>(inputs.vehicle, our_loops(inputs, q.variant.own()));
  const auto c = std::find_if(scenario.external.begin(), scenario.external.end(),
                              [&](const ExternalController& e) { return e.name == q.variant.external_name(); });
  if (c == scenario.external.end())
    throw Error({"variant", fmt::format("\"{}\" is no controller of this scenario", q.variant.external_name()), "",
                 "add it to Scenario::external"});
  ProcessControllerConfig p{.name = c->name,
                            .command = start_line(*c),
                            .timeout_s = c->timeout_s,
                            .setup = {},
                            .below = our_loops(inputs, Variant::pd_ff_thrust_drag),
                            .stop = stop};
  p.setup.flight = scenario.flights[q.flight].name;
  p.setup.vehicle_file = std::filesystem::absolute(scenario.vehicle).generic_string();
  p.setup.gains_file = std::filesystem::absolute(scenario.gains).generic_string();
  if (!q.folder.empty()) p.setup.log_folder = std::filesystem::absolute(q.folder).generic_string();
  auto controller = std::make_unique<ProcessController>(inputs.vehicle, p);
  config.computer.start_us = std::max(config.computer.start_us, static_cast<std::int64_t>(std::llround(controller->hello().start_s * 1e6)));
  return controller;
}

double flight_duration_s(const LoopConfig& config, const host::Trajectory& trajectory) {
  return static_cast<double>(config.computer.start_us) * 1e-6 + trajectory.duration_s() + kTail_s;
}
double flight_duration_s(const Scenario& scenario, const Inputs& inputs, const FlightRequest& q) {
  return flight_duration_s(loop_config(scenario, inputs, q), inputs.trajectories[q.flight]);
}

FlightOutcome fly(const Scenario& scenario, const Inputs& inputs, const FlightRequest& q, RunFolder* folder,
                  const std::function<void(double)>& advanced, const std::atomic<bool>* stop) {
  LoopConfig config = loop_config(scenario, inputs, q);
  auto controller = make_controller(scenario, inputs, q, stop, config);
  Loop loop(inputs.plant, sim::pointers(inputs.rotors), inputs.vehicle, inputs.trajectories[q.flight], std::move(controller), config);
  loop.measure_cost(q.measure_cost);
  FlightLogFiles logs(q.folder, log_header(scenario, inputs.plant, q.flight, q.variant, q.seed), loop);

  FlightOutcome out;
  FlightResult& result = out.result;
  result.flight = scenario.flights[q.flight].name;
  result.variant = q.variant;
  result.seed = q.seed;
  TrackingMeter meter;
  FlightSums sums;

  const auto ticks = static_cast<std::int64_t>(std::ceil(flight_duration_s(config, inputs.trajectories[q.flight]) * kTicks_per_s));
  FlightPacer pacer(scenario, q);
  for (std::int64_t n = 0; n < ticks; ++n) {
    pacer.wait(n, loop);
    loop.tick();
    if (const host::FlightRecord* r = loop.take_record()) {
      const PlantTruth* truth = loop.truth_at(r->time_us);
      if (truth) {
        const double t_s = static_cast<double>(r->time_us) * 1e-6;
        if (q.observe) q.observe(*r, *truth);
        if (r->phase == host::FlightPhase::flying)
          meter.add({t_s, truth->state.p_W_m, r->estimate.p_W_m, r->setpoint.p_W_m, r->setpoint.v_W_m_s, r->setpoint.yaw_rad});
        if (r->time_us >= config.computer.start_us) sums.add(*r, *truth);  // from the release on; spin-up is no flight
        if (logs.flight) {
          CostMeter m(q.measure_cost, loop.cost().log_ns);
          logs.flight->write(flight_row(*r));
          logs.truth->write(truth_row(t_s, *truth, loop));
        }
      }
    }
    if (ended_early(loop, result)) {
      // What happens to the motors after the safe state is part of the answer: half a second more.
      const auto after = std::min<std::int64_t>(kTicks_per_s / 2, ticks - n - 1);
      for (std::int64_t k = 0; k < after; ++k) loop.tick();
      break;
    }
    if (n % kAdvanceTicks == kAdvanceTicks - 1) {
      if (advanced) advanced(static_cast<double>(kAdvanceTicks) / kTicks_per_s);
      if (stop && stop->load(std::memory_order_relaxed)) {
        result.end = FlightEnd::interrupted;
        result.end_detail = fmt::format("stopped at {:.1f} s", loop.now_s());
        break;
      }
    }
  }

  result.tracking = meter.figures();
  pacer.report(result);
  add_figures(loop, sums, out);
  logs.close(q.folder, folder);
  return out;
}

}  // namespace rotorloop::hil
