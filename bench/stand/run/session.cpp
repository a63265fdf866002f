#include "bench/stand/run/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "bench/stand/run/session_grid.hpp"
#include "bench/stand/run_folder.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand_run {
namespace {

using modbus::StandAxis;

constexpr std::uint8_t kRunPriority = 7, kRunArmingPriority = 8;
constexpr std::int64_t kCommand_ns = 10'000'000, kArming_ns = 250'000'000;
constexpr std::int64_t kDuty_ns = 100'000'000;         // the ESC averages over as long
constexpr std::int64_t kZeros_ns = 300'000'000;        // of zero orders before the disarming
constexpr std::int64_t kEscSilent_ns = 1'200'000'000;  // an ESC at rest reports twice a second
constexpr std::int64_t kForeign_ns = 1'000'000'000;
constexpr std::int64_t kStart_ns = 4'000'000'000;  // from rest to the set-point: alignment, ramp, second try
constexpr double kJump = 0.25;                     // of the higher speed: larger changes are slewed

}  // namespace

const char* name(RunEnd end) {
  constexpr std::array kEnds{"running", "done", "stopped", "tripped"};
  return kEnds[static_cast<std::size_t>(end)];
}

Session::Session(const modbus::StandSetup& setup, Plan plan, tools::ToolNode& tool, tools::EscTable& table, RunFiles& files,
                 SessionOptions options)
    : setup_(setup),
      plan_(std::move(plan)),
      tool_(tool),
      table_(table),
      files_(files),
      options_(std::move(options)),
      limits_(setup.limits),
      grid_(grid_columns(setup), kGrid_ns, kPatience_ns),
      begun_ns_(tool.now_ns()) {
  tool.on<protocols::EscStatus>([this](const protocols::EscStatus& s, std::uint8_t) { on_status(s); });
  const auto foreign = [this](const auto&, std::uint8_t) { foreign_ns_ = tool_.now_ns(); };
  tool.on<protocols::RawCommand>(foreign);
  tool.on<protocols::RpmCommand>(foreign);
  grid_.start(begun_ns_);
  for (const modbus::BoundChannel& a : setup.axes) newest_[a.axis] = {};
}

std::string Session::missing() const {
  std::string out = heard_ns_ < 0 ? fmt::format("ESC {}", options_.esc_index) : "";
  for (const auto& [axis, n] : newest_)
    if (n.sampled_ns < 0) out += (out.empty() ? "" : ", ") + std::string(modbus::name(axis));
  return out;
}

std::optional<double> Session::newest(StandAxis axis) const {
  const auto found = newest_.find(axis);
  if (found == newest_.end() || found->second.sampled_ns < 0) return std::nullopt;
  if (axis != StandAxis::thrust && axis != StandAxis::torque) return found->second.value;
  const auto load = setup_.calibration.load_of({newest_.at(StandAxis::thrust).value, newest_.at(StandAxis::torque).value});
  return load[axis == StandAxis::thrust ? 0 : 1];
}

double Session::air_mean(StandAxis axis) const {
  const auto found = newest_.find(axis);
  return found == newest_.end() || found->second.n == 0.0 ? std::numeric_limits<double>::quiet_NaN() : found->second.sum / found->second.n;
}

std::vector<std::string> Session::unwatched() const {
  std::vector<std::string> out;
  const auto has = [this](StandAxis a) { return newest_.contains(a); };
  if (!has(StandAxis::vibration)) out.emplace_back("vibration_m_s2");
  if (!has(StandAxis::motor_temperature) && !has(StandAxis::esc_temperature)) out.emplace_back("temperature_degC beside the ESC's own");
  return out;
}

void Session::take(const StandReading& r) {
  Newest& n = newest_[r.axis];
  n = {r.value, r.sampled_ns, n.sum + r.value, n.n + 1.0};
  const std::string line = fmt::format("{:.6f},{:.3f},{},{:.9g}", seconds(r.sampled_ns), 1e-6 * static_cast<double>(r.uncertainty_ns),
                                       modbus::name(r.axis), r.value);
  files_.reading(line);
  history_.push_back({r.sampled_ns, line});
  if (const auto column = column_of(r.axis)) grid_.add(*column, r.sampled_ns, r.value);
  if (phase_ != Phase::running && phase_ != Phase::ramping_down) return;
  switch (r.axis) {
    case StandAxis::thrust:
    case StandAxis::torque:
      watch_value("thrust_N", "thrust", newest(StandAxis::thrust).value_or(0.0));
      watch_value("torque_N_m", "torque", newest(StandAxis::torque).value_or(0.0));
      break;
    case StandAxis::voltage:
      watch_value("voltage_V", "supply", r.value);
      break;
    case StandAxis::current:
      watch_value("current_A", "supply", r.value);
      break;
    case StandAxis::motor_temperature:
      watch_value("temperature_degC", "motor", r.value);
      break;
    case StandAxis::esc_temperature:
      watch_value("temperature_degC", "ESC's sensor", r.value);
      break;
    case StandAxis::vibration:
      watch_value("vibration_m_s2", "mount", r.value);
      break;
    case StandAxis::rotor_speed:
      watch_value("omega_rad_s", "independent speed", r.value);
      break;
    default:
      break;
  }
}

void Session::on_status(const protocols::EscStatus& s) {
  if (s.esc_index != options_.esc_index) return;
  const std::int64_t now = heard_ns_ = tool_.now_ns();
  esc_omega_ = std::abs(s.rpm) * kRad_s_per_rpm;
  const std::string line = fmt::format("{:.6f},,esc,{:.9g}", seconds(now), esc_omega_);
  files_.reading(line);
  history_.push_back({now, line});
  grid_.add(kOmegaColumn, now, esc_omega_);
  grid_.add(kEscVoltageColumn, now, static_cast<double>(s.voltage_V));
  grid_.add(kEscCurrentColumn, now, static_cast<double>(s.current_A));
  grid_.add(kEscTemperatureColumn, now, static_cast<double>(s.temperature_K) - 273.15);
  if (phase_ != Phase::running && phase_ != Phase::ramping_down) return;
  watch_value("omega_rad_s", "ESC", esc_omega_);
  watch_value("current_A", "ESC", static_cast<double>(s.current_A));
  watch_value("voltage_V", "ESC", static_cast<double>(s.voltage_V));
  // Not-a-number: a board without a thermistor.
  if (s.temperature_K == s.temperature_K) watch_value("temperature_degC", "ESC", static_cast<double>(s.temperature_K) - 273.15);
  if (phase_ != Phase::running || !(set_point_ > 0.0)) return;
  const double error = set_point_ - esc_omega_;
  // At a set-point below the limit a rotor at rest would seem to follow.
  if (esc_omega_ > 0.5 * set_point_ && std::abs(error) < limits_.limit("tracking_error_rad_s").max) followed_ = true;
  // From rest the motor needs time to start; after that it must follow.
  if (followed_ || now - left_zero_ns_ > kStart_ns) watch_value("tracking_error_rad_s", "ESC", error);
}

// A reading of the ESC's parameters (docs/wire.md): a low-rate question on the stand's bus, so that flights carry nothing of it.
void Session::ask_duty() {
  const std::int64_t now = tool_.now_ns();
  // In holds that count alone: in a step the answer's frames would shift the reports of speed that the inertia is estimated from.
  if (options_.duty_node == 0 || step_ < 0 || now < next_duty_ns_) return;
  next_duty_ns_ = now + kDuty_ns;
  protocols::ParamGetSet ask;
  ask.name = protocols::Text<protocols::kMaxParameterName>(kDutyParameter);
  // What comes late is of another moment: no second attempt.
  tool_.request<protocols::ParamGetSet, protocols::ParamGetSetResponse>(
      options_.duty_node, ask,
      [this](const std::optional<protocols::ParamGetSetResponse>& r) {
        if (r && r->value.kind == protocols::ParamValue::Kind::real && phase_ != Phase::done)
          grid_.add(kDutyColumn, tool_.now_ns(), static_cast<double>(r->value.real));
      },
      {.attempts = 1, .timeout_ns = kDuty_ns});
}

void Session::watch_value(const char* limit, const std::string& source, double value) {
  const auto trip = limits_.see(limit, source, value, tool_.now_ns());
  if (trip) stop_for(*trip);
}

void Session::note_stale(const std::string& channel, double age_ms) {
  if (phase_ != Phase::running && phase_ != Phase::ramping_down) return;
  const modbus::StandLimit& l = limits_.limit("stale_ms");
  stop_for({"stale_ms", channel, age_ms, std::min(age_ms, l.max), l.action, tool_.now_ns()});
}

// What the bus shows of the ESC and of others.
void Session::watch_bus() {
  const std::int64_t now = tool_.now_ns();
  const auto stop = [&](const char* limit, std::string what, modbus::LimitAction action) {
    stop_for({limit, std::move(what), 0.0, 0.0, action, now});
  };
  using modbus::LimitAction;
  if (heard_ns_ >= 0 && now - heard_ns_ > kEscSilent_ns)
    stop("esc_silent", fmt::format("ESC {} does not report", options_.esc_index), LimitAction::cut);
  if (foreign_ns_ >= 0 && now - foreign_ns_ < kForeign_ns)
    stop("foreign_commander", "another node sends commands on this bus", LimitAction::cut);
  const tools::EscRow* row = table_.of_index(options_.esc_index);
  if (row != nullptr && row->shares_index)
    stop("shared_index", fmt::format("two nodes have esc_index {}", options_.esc_index), LimitAction::cut);
  if (row != nullptr) {
    const auto node = tool_.nodes().find(row->node);
    if (node != tool_.nodes().end() && node->second.status.health >= protocols::Health::error)
      stop("esc_fault", "the ESC reports an error: " + tools::trouble_of(node->second.status), LimitAction::cut);
  }
  const modbus::StandLimit& time = limits_.limit("run_time_s");
  if (seconds(now) > time.max) stop_for({"run_time_s", "run", seconds(now), time.max, time.action, now});
  if (files_.failed()) stop("samples", "cannot be written: the disk is full or gone", LimitAction::ramp_down);
  for (const modbus::BoundChannel& a : setup_.axes) {
    const modbus::StandDevice& d = setup_.buses[a.bus].devices[a.device];
    if (d.profile.channels[a.channel].rate != modbus::PollRate::fast) continue;
    const double age_ms = 1e-6 * static_cast<double>(now - newest_.at(a.axis).sampled_ns);
    if (age_ms > limits_.limit("stale_ms").max)
      stop_for({"stale_ms", fmt::format("{} ({})", modbus::name(a.axis), d.name), age_ms, limits_.limit("stale_ms").max,
                limits_.limit("stale_ms").action, now});
  }
}

// An independent speed that is another in a steady hold: pole pairs, or marks on the rotor, were counted wrong.
void Session::watch_speeds(const GridRow& row) {
  const double esc = row.values[kOmegaColumn], independent = row.values[kIndependentColumn];
  const double ratio = esc / independent;
  const bool wrong = measure_ns_ >= 0 && set_point_ > 0.0 && independent > 10.0 && std::abs(ratio - 1.0) > kSpeedsDiffer;
  wrong_ratio_rows_ = wrong ? wrong_ratio_rows_ + 1 : 0;
  if (wrong_ratio_rows_ * kGrid_ns < kSpeedsDiffer_ns) return;
  stop_for({"pole_pairs", speed_ratio_text(ratio, options_.esc_pole_pairs), 0.0, 0.0, modbus::LimitAction::ramp_down, row.t_ns});
}

void Session::stop_for(const Trip& t) {
  if (phase_ != Phase::running && phase_ != Phase::ramping_down) return;
  if (t.action == modbus::LimitAction::hold) {
    ceiling_ = ceiling_ > 0.0 ? std::min(ceiling_, set_point_) : std::max(set_point_, 1.0);
    step_limited_ = true;
    return note("limit_holds", {{"limit", t.limit}, {"source", t.source}, {"value", t.value}, {"max", t.max}});
  }
  const bool cut = t.action == modbus::LimitAction::cut;
  if (phase_ == Phase::ramping_down && !cut) return;
  if (!trip_) {
    trip_ = t;
    std::string text = std::string(stand::kReadingsHeader) + "\n";
    for (const Kept& k : history_) text += k.line + "\n";
    files_.write_history(text);
    note("trip", {{"limit", t.limit},
                  {"source", t.source},
                  {"value", t.value},
                  {"max", t.max},
                  {"action", name(t.action)},
                  {"history", stand::kTripFile}});
  }
  end_ = RunEnd::tripped;
  if (cut) {
    arm(false);  // at once, not after the zeros
    phase_ = Phase::stopping, stopping_ns_ = next_command_ns_ = tool_.now_ns();
  } else {
    phase_ = Phase::ramping_down;
  }
}

void Session::ask_stop(const std::string& who) {
  if (phase_ == Phase::done || phase_ == Phase::stopping) return;
  ++stops_asked_;
  note("stop_asked", {{"by", who}, {"times", stops_asked_}});
  if (end_ == RunEnd::running) end_ = RunEnd::stopped;
  if (phase_ == Phase::waiting) return finish(end_);
  if (stops_asked_ > 1) {
    arm(false);
    phase_ = Phase::stopping, stopping_ns_ = next_command_ns_ = tool_.now_ns();
  } else {
    phase_ = Phase::ramping_down;
  }
}

void Session::note(const char* what, nlohmann::ordered_json fields) {
  nlohmann::ordered_json e{{"t_s", seconds(tool_.now_ns())}, {"event", what}};
  e.update(fields);
  files_.event(e);
}

void Session::arm(bool armed) {
  armed_ = armed;
  tool_.broadcast(protocols::ArmingStatus{.status = armed ? protocols::ArmingStatus::kFullyArmed : protocols::ArmingStatus::kDisarmed},
                  kRunArmingPriority);
}

// All positions before this one are zero: a stop for the other ESCs.
void Session::send(double omega_rad_s) {
  protocols::RpmCommand c;
  c.count = static_cast<std::uint8_t>(options_.esc_index + 1);
  c.rpm[static_cast<std::size_t>(options_.esc_index)] = static_cast<std::int32_t>(std::lround(omega_rad_s * kRpm_per_rad_s));
  tool_.broadcast(c, kRunPriority);
}

void Session::begin() {
  phase_ = Phase::running;
  const std::int64_t now = tool_.now_ns();
  begun_ns_ = segment_ns_ = next_command_ns_ = next_arming_ns_ = last_drive_ns_ = now;
  grid_.start(now);
  segment_ = 0, measure_ns_ = -1, recent_.clear();
  note("begin", {{"segments", plan_.segments.size()}});
}

void Session::finish(RunEnd end) {
  end_ = end;
  phase_ = Phase::done;
  finish_step();
  note("end", {{"how", name(end)}, {"steps", steps_.size()}});
  files_.flush(tool_.now_ns(), true);
}

void Session::step() {
  tool_.poll();
  const std::int64_t now = tool_.now_ns();
  while (!history_.empty() && history_.front().t_ns < now - kHistory_ns) history_.pop_front();
  if (phase_ == Phase::done) return;
  if (phase_ == Phase::waiting) {
    if (missing().empty()) begin();
    return;
  }
  take_rows();
  if (phase_ == Phase::running || phase_ == Phase::ramping_down) watch_bus();
  drive();
  command();
  ask_duty();
  files_.flush(now);
}

void Session::drive() {
  const std::int64_t now = tool_.now_ns();
  const double dt = 1e-9 * static_cast<double>(now - last_drive_ns_);
  last_drive_ns_ = now;
  if (phase_ == Phase::stopping) {
    set_point_ = 0.0;
    if (now - stopping_ns_ < kZeros_ns) return;
    arm(false);
    return finish(end_ == RunEnd::running ? RunEnd::done : end_);
  }
  double wanted = 0.0;
  if (phase_ == Phase::running) {
    const Segment& s = plan_.segments[segment_];
    const double since = 1e-9 * static_cast<double>(now - segment_ns_);
    wanted = wanted_rad_s(plan_, s, since);
    if (ceiling_ > 0.0 && wanted > ceiling_) wanted = ceiling_, step_limited_ = true;
    const bool is_rest = s.motion == Motion::hold || s.motion == Motion::zero;
    const double at_least_s = s.motion == Motion::zero ? 3.0 * options_.settle_s : options_.settle_s;
    if (is_rest && measure_ns_ < 0 && since >= at_least_s && std::abs(set_point_ - wanted) < 1e-6) {
      step_settled_ = rests();
      if (step_settled_ || since >= at_least_s + options_.settle_most_s) measure_ns_ = now, step_ = s.measured ? steps_begun_++ : -1;
    }
    const double measured_s = measure_ns_ < 0 ? 0.0 : 1e-9 * static_cast<double>(now - measure_ns_);
    if (is_rest ? measure_ns_ >= 0 && measured_s >= s.duration_s : since >= s.duration_s) return next_segment();
  }
  const bool jump =
      phase_ == Phase::running && set_point_ > 0.0 && wanted > 0.0 && std::abs(wanted - set_point_) <= kJump * std::max(wanted, set_point_);
  const double reach = options_.slew_rad_s2 * dt;
  if (set_point_ == 0.0 && wanted > 0.0) left_zero_ns_ = now, followed_ = false;
  set_point_ = jump ? wanted : set_point_ + std::clamp(wanted - set_point_, -reach, reach);
  if (phase_ == Phase::ramping_down && set_point_ <= 0.0) phase_ = Phase::stopping, stopping_ns_ = now;
}

void Session::next_segment() {
  step_ = -1, measure_ns_ = -1, step_limited_ = false;
  segment_ns_ = tool_.now_ns();
  if (++segment_ >= plan_.segments.size()) {
    phase_ = Phase::stopping, stopping_ns_ = tool_.now_ns();
    segment_ = plan_.segments.size() - 1;
    return;
  }
  recent_.clear();
}

void Session::command() {
  const std::int64_t now = tool_.now_ns();
  if (phase_ == Phase::done || now < next_command_ns_) return;
  next_command_ns_ = std::max(next_command_ns_ + kCommand_ns, now);
  const char configuration = plan_.segments[segment_].configuration;
  timeline_.push_back({now, set_point_, phase_ == Phase::running ? step_ : -1, segment_, step_settled_});
  // Somebody may have hands on the stand: nothing is armed, and the plan waits.
  if (phase_ == Phase::running && options_.configured && set_point_ == 0.0 && !options_.configured(configuration)) {
    if (armed_) arm(false);
    segment_ns_ = now, measure_ns_ = -1;
    return;
  }
  if (phase_ == Phase::running && now >= next_arming_ns_) {
    arm(true);
    next_arming_ns_ = now + kArming_ns;
  }
  send(phase_ == Phase::stopping ? 0.0 : set_point_);
}

}  // namespace rotorloop::stand_run
