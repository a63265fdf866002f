// Rows of a run: what is written of them, when a step has settled, and its means.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/stand/run/session.hpp"
#include "bench/stand/run/session_grid.hpp"
#include "bench/stand/run_folder.hpp"

namespace rotorloop::stand_run {
namespace {

using modbus::StandAxis;

constexpr std::int64_t kRecent_ns = 500'000'000;            // that settling is judged over
constexpr double kSpeedRests = 0.003;                       // of the speed, between halves of it
constexpr double kForceRests = 0.01, kForceRests_N = 0.06;  // of the thrust, and in N: noise of means of 25 samples of 0.1 N

std::string cell(double v) { return v == v ? fmt::format("{:.5f}", v) : std::string(); }

}  // namespace

// Whether speed and thrust rest: means of the halves of the last half second.
bool Session::rests() const {
  if (recent_.size() < 20 || recent_.back().t_ns - recent_.front().t_ns < kRecent_ns - 4 * kGrid_ns) return false;
  double sums[2][2]{}, n[2][2]{};
  for (std::size_t i = 0; i < recent_.size(); ++i)
    for (int k = 0; k < 2; ++k)
      if (const double v = recent_[i].values[k == 0 ? kOmegaColumn : kThrustColumn]; v == v)
        sums[k][2 * i >= recent_.size()] += v, n[k][2 * i >= recent_.size()] += 1.0;
  for (int k = 0; k < 2; ++k) {
    if (n[k][0] < 5.0 || n[k][1] < 5.0) return false;
    const double a = sums[k][0] / n[k][0], b = sums[k][1] / n[k][1];
    if (std::abs(b - a) > (k == 0 ? std::max(1.0, kSpeedRests * b) : std::max(kForceRests_N, kForceRests * std::abs(b)))) return false;
  }
  return true;
}

void Session::take_rows() {
  for (const GridRow& row : grid_.take(tool_.now_ns())) {
    take_row(row);
    recent_.push_back(row);
    while (!recent_.empty() && recent_.front().t_ns < row.t_ns - kRecent_ns) recent_.pop_front();
    if (newest_.contains(StandAxis::rotor_speed)) watch_speeds(row);
  }
}

void Session::take_row(const GridRow& row) {
  while (timeline_.size() > 1 && timeline_[1].t_ns <= row.t_ns) timeline_.pop_front();
  TimelineEntry at{row.t_ns, 0.0, -1, 0, true};
  if (!timeline_.empty() && timeline_.front().t_ns <= row.t_ns) at = timeline_.front();
  const Segment& segment = plan_.segments[at.segment];
  const auto& v = row.values;
  const auto load = setup_.calibration.load_of({v[kThrustColumn], v[kTorqueColumn]});
  // The estimate is of the bare stand: steps with anything behind the rotor stand in steps.csv alone.
  const bool counts = at.step >= 0 && segment.configuration == 'A';
  const bool turns = at.target_rad_s > 0.0;  // at rest there is no voltage to speak of
  files_.sample(stand::sample_line({.t_s = seconds(row.t_ns),
                                    .step = counts ? at.step : stand::kNotMeasured,
                                    .configuration = segment.configuration == 'B' ? 1.0 : 0.0,
                                    .target_rad_s = at.target_rad_s,
                                    .omega_rad_s = v[kOmegaColumn],
                                    .thrust_N = load[0],
                                    .torque_N_m = load[1],
                                    .voltage_V = v[kVoltageColumn],
                                    .current_A = v[kCurrentColumn],
                                    .independent_rad_s = v[kIndependentColumn],
                                    .esc_voltage_V = v[kEscVoltageColumn],
                                    .esc_current_A = v[kEscCurrentColumn],
                                    .esc_degC = v[kEscTemperatureColumn],
                                    .motor_degC = v[kMotorTemperatureColumn],
                                    .duty_q = turns ? v[kDutyColumn] : stand::kNotMeasured}));
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
  const double all[] = {v[kOmegaColumn], load[0], load[1]};
  if (!std::all_of(std::begin(all), std::end(all), [](double x) { return x == x; })) return;
  open_->omega_rad_s += all[0], open_->thrust_N += all[1], open_->torque_N_m += all[2];
  open_->voltage_V += v[kVoltageColumn], open_->current_A += v[kCurrentColumn];
  open_->duration_s = seconds(row.t_ns) - open_->t_s;
  open_->limited = open_->limited || step_limited_;
  ++open_->samples;
}

void Session::finish_step() {
  if (!open_ || open_->samples == 0) return open_.reset();
  StepMeans s = *open_;
  open_.reset();
  for (double* v : {&s.omega_rad_s, &s.thrust_N, &s.torque_N_m, &s.voltage_V, &s.current_A}) *v /= s.samples;
  files_.step(fmt::format("{},{},{},{:.3f},{:.3f},{:.3f},{:.4f},{:.5f},{:.7f},{},{},{},{},{}", s.number, s.configuration, name(s.motion),
                          s.wanted_rad_s, s.t_s, s.duration_s, s.omega_rad_s, s.thrust_N, s.torque_N_m, cell(s.voltage_V),
                          cell(s.current_A), s.samples, s.settled ? "yes" : "unsettled", s.limited ? "limited" : ""));
  steps_.push_back(s);
}

}  // namespace rotorloop::stand_run
