#include "bench/stand/run/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/stand/run_folder.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand_run {
namespace {

using modbus::StandAxis;

constexpr std::int64_t kGrid_ns = 10'000'000;       // 100 Hz, as readings of two or three instruments on a bus come
constexpr std::int64_t kPatience_ns = 700'000'000;  // an ESC at rest reports every 500 ms
constexpr std::int64_t kHistory_ns = 2'000'000'000;
constexpr std::int64_t kRecent_ns = 500'000'000;            // that settling is judged over
constexpr double kSpeedRests = 0.003;                       // of the speed, between halves of it
constexpr double kForceRests = 0.01, kForceRests_N = 0.06;  // of the thrust, and in N: noise of means of 25 samples of 0.1 N

std::string cell(double v) { return v == v ? fmt::format("{:.5f}", v) : std::string(); }

std::optional<std::size_t> column_of(StandAxis axis) {
  switch (axis) {
    case StandAxis::thrust:
      return stand::kThrustColumn;
    case StandAxis::torque:
      return stand::kTorqueColumn;
    case StandAxis::voltage:
      return stand::kVoltageColumn;
    case StandAxis::current:
      return stand::kCurrentColumn;
    case StandAxis::rotor_speed:
      return stand::kIndependentColumn;
    case StandAxis::motor_temperature:
      return stand::kMotorTemperatureColumn;
    default:
      return std::nullopt;
  }
}

std::vector<GridColumn> grid_columns(const modbus::StandSetup& s) {
  std::vector<GridColumn> c(stand::kColumns);
  // An ESC at rest reports every 500 ms; while it turns a silence this long has stopped the run.
  for (const std::size_t k : {stand::kOmegaColumn, stand::kEscVoltageColumn, stand::kEscCurrentColumn}) c[k].longest_gap_ns = 1'200'000'000;
  for (const modbus::BoundChannel& a : s.axes) {
    const auto column = column_of(a.axis);
    if (!column) continue;
    const modbus::StandDevice& d = s.buses[a.bus].devices[a.device];
    c[*column].lag_ns = std::llround(1e6 * a.lag_ms);
    if (d.profile.channels[a.channel].rate == modbus::PollRate::fast) c[*column].longest_gap_ns = std::llround(1e6 * d.stale_ms);
  }
  return c;
}

}  // namespace

Recorder::Recorder(const modbus::StandSetup& setup, const Plan& plan, RunFiles& files, std::int64_t now)
    : setup_(setup), plan_(plan), files_(files), grid_(grid_columns(setup), kGrid_ns, kPatience_ns), begun_ns_(now) {
  for (const modbus::BoundChannel& a : setup.axes) newest_[a.axis] = {};
  grid_.start(now);
}

void Recorder::begin(std::int64_t now) {
  begun_ns_ = now;
  grid_.start(now);
}

std::vector<std::string> Recorder::missing() const {
  std::vector<std::string> out;
  for (const auto& [axis, newest] : newest_)
    if (newest.n == 0.0) out.emplace_back(modbus::name(axis));
  return out;
}

std::optional<double> Recorder::newest(StandAxis axis) const {
  const auto found = newest_.find(axis);
  if (found == newest_.end() || found->second.n == 0.0) return std::nullopt;
  if (axis != StandAxis::thrust && axis != StandAxis::torque) return found->second.value;
  const auto load = setup_.calibration.load_of({newest_.at(StandAxis::thrust).value, newest_.at(StandAxis::torque).value});
  return load[axis == StandAxis::thrust ? 0 : 1];
}

double Recorder::mean(StandAxis axis) const {
  const auto found = newest_.find(axis);
  return found == newest_.end() || found->second.n == 0.0 ? stand::kNotMeasured : found->second.sum / found->second.n;
}

void Recorder::line(std::int64_t t_ns, const std::string& text) {
  files_.reading(text);
  while (!history_.empty() && history_.front().first < t_ns - kHistory_ns) history_.pop_front();
  history_.emplace_back(t_ns, text);
}

void Recorder::reading(const StandReading& r) {
  Newest& n = newest_[r.axis];
  n = {r.value, n.sum + r.value, n.n + 1.0};
  line(r.sampled_ns, fmt::format("{:.6f},{:.3f},{},{:.9g}", seconds(r.sampled_ns), 1e-6 * static_cast<double>(r.uncertainty_ns),
                                 modbus::name(r.axis), r.value));
  if (const auto column = column_of(r.axis)) grid_.add(*column, r.sampled_ns, r.value);
}

void Recorder::status(const protocols::EscStatus& s, std::int64_t now) {
  const double omega = std::abs(s.rpm) * kRad_s_per_rpm;
  line(now, fmt::format("{:.6f},,esc,{:.9g}", seconds(now), omega));
  grid_.add(stand::kOmegaColumn, now, omega);
  grid_.add(stand::kEscVoltageColumn, now, static_cast<double>(s.voltage_V));
  grid_.add(stand::kEscCurrentColumn, now, static_cast<double>(s.current_A));
  grid_.add(stand::kEscTemperatureColumn, now, static_cast<double>(s.temperature_K) - 273.15);
}

void Recorder::duty(double duty_q, std::int64_t now) { grid_.add(stand::kDutyColumn, now, duty_q); }

void Recorder::event(const char* what, nlohmann::ordered_json fields, std::int64_t now) {
  nlohmann::ordered_json e{{"t_s", seconds(now)}, {"event", what}};
  e.update(fields);
  files_.event(e);
}

void Recorder::history() {
  std::string text = std::string(stand::kReadingsHeader) + "\n";
  for (const auto& [t_ns, reading] : history_) text += reading + "\n";
  files_.write_history(text);
}

bool Recorder::rests() const {
  if (recent_.size() < 20 || recent_.back().t_ns - recent_.front().t_ns < kRecent_ns - 4 * kGrid_ns) return false;
  double sums[2][2]{}, n[2][2]{};
  for (std::size_t i = 0; i < recent_.size(); ++i)
    for (int k = 0; k < 2; ++k)
      if (const double v = recent_[i].values[k == 0 ? stand::kOmegaColumn : stand::kThrustColumn]; v == v) {
        sums[k][2 * i >= recent_.size()] += v;
        n[k][2 * i >= recent_.size()] += 1.0;
      }
  for (int k = 0; k < 2; ++k) {
    if (n[k][0] < 5.0 || n[k][1] < 5.0) return false;
    const double a = sums[k][0] / n[k][0], b = sums[k][1] / n[k][1];
    if (std::abs(b - a) > (k == 0 ? std::max(1.0, kSpeedRests * b) : std::max(kForceRests_N, kForceRests * std::abs(b)))) return false;
  }
  return true;
}

std::vector<GridRow> Recorder::rows(std::int64_t now, bool limited) {
  std::vector<GridRow> out = grid_.take(now);
  for (const GridRow& r : out) {
    row(r, limited);
    recent_.push_back(r);
    while (recent_.front().t_ns < r.t_ns - kRecent_ns) recent_.pop_front();
  }
  return out;
}

void Recorder::row(const GridRow& row, bool limited) {
  while (timeline_.size() > 1 && timeline_[1].t_ns <= row.t_ns) timeline_.pop_front();
  Commanded at;
  if (!timeline_.empty() && timeline_.front().t_ns <= row.t_ns) at = timeline_.front();
  const Segment& segment = plan_.segments[at.segment];
  std::vector<double> v = row.values;
  const auto load = setup_.calibration.load_of({v[stand::kThrustColumn], v[stand::kTorqueColumn]});
  v[stand::kThrustColumn] = load[0];
  v[stand::kTorqueColumn] = load[1];
  if (!(at.target_rad_s > 0.0)) v[stand::kDutyColumn] = stand::kNotMeasured;  // at rest there is no voltage to speak of
  // The estimate is of the bare stand: steps with anything behind the rotor stand in steps.csv alone.
  const bool counts = at.step >= 0 && segment.configuration == 'A';
  files_.sample(stand::sample_line(seconds(row.t_ns), counts ? at.step : -1, segment.configuration, at.target_rad_s, v));
  if (!open_ || open_->number != at.step) {
    finish_step();
    if (at.step < 0) return;
    open_ = StepMeans{.number = at.step,
                      .configuration = segment.configuration,
                      .motion = segment.motion,
                      .wanted_rad_s = segment.omega_rad_s,
                      .t_s = seconds(row.t_ns),
                      .settled = at.settled};
  }
  const double all[] = {v[stand::kOmegaColumn], load[0], load[1]};
  if (!std::all_of(std::begin(all), std::end(all), [](double x) { return x == x; })) return;
  open_->omega_rad_s += all[0];
  open_->thrust_N += all[1];
  open_->torque_N_m += all[2];
  open_->voltage_V += v[stand::kVoltageColumn];
  open_->current_A += v[stand::kCurrentColumn];
  open_->esc_voltage_V += v[stand::kEscVoltageColumn];
  open_->esc_current_A += v[stand::kEscCurrentColumn];
  for (std::size_t k = 0; k < stand::kColumns; ++k)
    if (const double shown = row.values[k]; shown == shown)
      open_->shown[k] = {std::min(open_->shown[k].first, shown), std::max(open_->shown[k].second, shown)};
  open_->duration_s = seconds(row.t_ns) - open_->t_s;
  open_->limited = open_->limited || limited;
  ++open_->samples;
}

void Recorder::finish_step() {
  if (!open_ || open_->samples == 0) return open_.reset();
  StepMeans s = *open_;
  open_.reset();
  for (double* v : {&s.omega_rad_s, &s.thrust_N, &s.torque_N_m, &s.voltage_V, &s.current_A, &s.esc_voltage_V, &s.esc_current_A})
    *v /= s.samples;
  files_.step(fmt::format("{},{},{},{:.3f},{:.3f},{:.3f},{:.4f},{:.5f},{:.7f},{},{},{},{},{}", s.number, s.configuration, name(s.motion),
                          s.wanted_rad_s, s.t_s, s.duration_s, s.omega_rad_s, s.thrust_N, s.torque_N_m, cell(s.voltage_V),
                          cell(s.current_A), s.samples, s.settled ? "yes" : "unsettled", s.limited ? "limited" : ""));
  steps_.push_back(s);
}

}  // namespace rotorloop::stand_run
