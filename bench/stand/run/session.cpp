#include "bench/stand/run/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/stand/run_folder.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand_run {
namespace {

constexpr std::uint8_t kRunPriority = 7, kRunArmingPriority = 8;
constexpr std::int64_t kCommand_ns = 10'000'000, kArming_ns = 250'000'000;
constexpr std::int64_t kDuty_ns = 100'000'000;  // the ESC averages over as long

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
      sequencer_(plan_, options_),
      watch_(setup, options_.esc_pole_pairs, [this](const Trip& t) { stop_for(t); }),
      recorder_(setup, plan_, files, tool.now_ns()),
      instruments_(setup, plan_.highest_rad_s(), options_.airspeed_m_s != 0.0) {
  tool.on<protocols::EscStatus>([this](const protocols::EscStatus& s, std::uint8_t) { on_status(s); });
  const auto foreign = [this](const auto&, std::uint8_t) { foreign_ns_ = tool_.now_ns(); };
  tool.on<protocols::RawCommand>(foreign);
  tool.on<protocols::RpmCommand>(foreign);
}

std::string Session::missing() const {
  std::vector<std::string> all = recorder_.missing();
  if (heard_ns_ < 0) all.insert(all.begin(), fmt::format("ESC {}", options_.esc_index));
  return fmt::format("{}", fmt::join(all, ", "));
}

void Session::take(const StandReading& r) {
  recorder_.reading(r);
  watch_.note_sample(r.axis, r.sampled_ns);
  using modbus::StandAxis;
  const std::array load{newest(StandAxis::thrust).value_or(0.0), newest(StandAxis::torque).value_or(0.0)};
  if (turning()) watch_.reading(r.axis, r.value, load, tool_.now_ns());
}

void Session::on_status(const protocols::EscStatus& s) {
  if (s.esc_index != options_.esc_index) return;
  heard_ns_ = tool_.now_ns();
  esc_omega_ = std::abs(s.rpm) * kRad_s_per_rpm;
  recorder_.status(s, heard_ns_);
  if (turning()) watch_.status(s, sequencer_.phase() == Phase::running ? set_point_rad_s() : 0.0, heard_ns_);
}

// A reading of the ESC's parameters (docs/wire.md): a low-rate question on the stand's bus, so that flights carry nothing of it.
void Session::ask_duty() {
  const std::int64_t now = tool_.now_ns();
  // In holds that count alone: in a step the answer's frames would shift the reports of speed that the inertia is estimated from.
  if (options_.duty_node == 0 || sequencer_.step() < 0 || now < next_duty_ns_) return;
  next_duty_ns_ = now + kDuty_ns;
  protocols::ParamGetSet ask;
  ask.name = protocols::Text<protocols::kMaxParameterName>(kDutyParameter);
  // What comes late is of another moment: no second attempt.
  tool_.request<protocols::ParamGetSet, protocols::ParamGetSetResponse>(
      options_.duty_node, ask,
      [this](const std::optional<protocols::ParamGetSetResponse>& r) {
        if (r && r->value.kind == protocols::ParamValue::Kind::real && !done())
          recorder_.duty(static_cast<double>(r->value.real), tool_.now_ns());
      },
      {.attempts = 1, .timeout_ns = kDuty_ns});
}

void Session::note_stale(const std::string& channel, double age_ms) {
  if (turning()) watch_.stale(channel, age_ms, tool_.now_ns());
}

BusState Session::bus_state() const {
  BusState b{options_.esc_index, heard_ns_, foreign_ns_, false, "", elapsed_s(), files_.failed()};
  const tools::EscRow* row = table_.of_index(options_.esc_index);
  if (row == nullptr) return b;
  b.shares_index = row->shares_index;
  const auto node = tool_.nodes().find(row->node);
  if (node != tool_.nodes().end() && node->second.status.health >= protocols::Health::error)
    b.esc_fault = tools::trouble_of(node->second.status);
  return b;
}

void Session::stop_at_once() {
  arm(false);  // not after the zeros
  sequencer_.stop(tool_.now_ns());
  next_command_ns_ = tool_.now_ns();
}

void Session::stop_for(const Trip& t) {
  if (!turning()) return;
  if (t.action == modbus::LimitAction::hold) {
    sequencer_.hold_speed();
    return note("limit_holds", {{"limit", t.limit}, {"source", t.source}, {"value", t.value}, {"max", t.max}});
  }
  const bool cut = t.action == modbus::LimitAction::cut;
  if (sequencer_.phase() == Phase::ramping_down && !cut) return;
  if (!trip_) {
    trip_ = t;
    recorder_.history();
    note("trip", {{"limit", t.limit},
                  {"source", t.source},
                  {"value", t.value},
                  {"max", t.max},
                  {"action", name(t.action)},
                  {"history", stand::kTripFile}});
  }
  end_ = RunEnd::tripped;
  cut ? stop_at_once() : sequencer_.ramp_down();
}

void Session::ask_stop(const std::string& who) {
  if (done() || sequencer_.phase() == Phase::stopping) return;
  ++stops_asked_;
  note("stop_asked", {{"by", who}, {"times", stops_asked_}});
  if (end_ == RunEnd::running) end_ = RunEnd::stopped;
  if (sequencer_.phase() == Phase::waiting) return finish(end_);
  stops_asked_ > 1 ? stop_at_once() : sequencer_.ramp_down();
}

void Session::note(const char* what, nlohmann::ordered_json fields) { recorder_.event(what, std::move(fields), tool_.now_ns()); }

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
  const std::int64_t now = next_command_ns_ = next_arming_ns_ = tool_.now_ns();
  sequencer_.begin(now);
  recorder_.begin(now);
  note("begin", {{"segments", plan_.segments.size()}});
}

void Session::finish(RunEnd end) {
  end_ = end;
  sequencer_.finish();
  recorder_.finish_step();
  note("end", {{"how", name(end)}, {"steps", steps().size()}});
  files_.flush(tool_.now_ns(), true);
}

void Session::step() {
  tool_.poll();
  const std::int64_t now = tool_.now_ns();
  if (done()) return;
  if (sequencer_.phase() == Phase::waiting) {
    if (missing().empty()) begin();
    return;
  }
  for (const GridRow& row : recorder_.rows(now, sequencer_.limited()))
    if (recorder_.measures(modbus::StandAxis::rotor_speed)) watch_.speeds(row, sequencer_.measuring() && set_point_rad_s() > 0.0);
  for (; holds_checked_ < steps().size(); ++holds_checked_)
    if (const std::string wrong = instruments_.hold(steps()[holds_checked_]); !wrong.empty())
      stop_for({"instrument", wrong, 0.0, 0.0, modbus::LimitAction::ramp_down, now});
  if (turning()) watch_.bus(bus_state(), now);
  drive();
  command();
  ask_duty();
  files_.flush(now);
}

void Session::drive() {
  const std::int64_t now = tool_.now_ns();
  const bool at_zero = set_point_rad_s() == 0.0;
  const std::size_t before = segment();
  sequencer_.advance(now, recorder_.rests());
  if (at_zero && set_point_rad_s() > 0.0) watch_.left_zero(now);
  if (segment() != before) recorder_.forget_recent();
  if (!done()) return;
  arm(false);
  finish(end_ == RunEnd::running ? RunEnd::done : end_);
}

void Session::command() {
  const std::int64_t now = tool_.now_ns();
  if (done() || now < next_command_ns_) return;
  next_command_ns_ = std::max(next_command_ns_ + kCommand_ns, now);
  const bool running = sequencer_.phase() == Phase::running;
  recorder_.commanded({now, set_point_rad_s(), running ? sequencer_.step() : -1, segment(), sequencer_.settled()});
  // Somebody may have hands on the stand: nothing is armed, and the plan waits.
  if (running && options_.configured && set_point_rad_s() == 0.0 && !options_.configured(sequencer_.segment().configuration)) {
    if (armed_) arm(false);
    return sequencer_.wait(now);
  }
  if (running && now >= next_arming_ns_) {
    arm(true);
    next_arming_ns_ = now + kArming_ns;
  }
  send(sequencer_.phase() == Phase::stopping ? 0.0 : set_point_rad_s());
}

}  // namespace rotorloop::stand_run
