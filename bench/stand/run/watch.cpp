#include "bench/stand/run/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/stand/run_folder.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand_run {
namespace {

using modbus::LimitAction;
using modbus::StandAxis;

constexpr std::int64_t kEscSilent_ns = 1'200'000'000;  // an ESC at rest reports twice a second
constexpr std::int64_t kForeign_ns = 1'000'000'000;
constexpr std::int64_t kStart_ns = 4'000'000'000;  // from rest to the set-point: alignment, ramp, second try
constexpr double kSpeedsDiffer = 0.03;             // between ESC and independent speed: both are good to 0.1 %
constexpr int kSpeedsDifferRows = 30;              // 0.3 s
constexpr double kMostPolePairs = 30.0;            // that a stand file may give

// "the ESC says 1.167 times the independent speed: … 7 pole pairs, not 6".
std::string speed_ratio_text(double ratio, int esc_pole_pairs) {
  std::string out = fmt::format("the ESC says {:.3f} times the independent speed", ratio);
  for (int b = 1; b <= 12; ++b)
    if (const double a = std::round(ratio * b); a > 0.0 && std::abs(ratio * b / a - 1.0) < 0.01) {
      out += fmt::format(", {:.0f}/{}", a, b);
      break;
    }
  if (esc_pole_pairs > 0)
    if (const double pairs = std::round(ratio * esc_pole_pairs);
        pairs >= 1.0 && pairs <= kMostPolePairs && std::abs(ratio * esc_pole_pairs / pairs - 1.0) < 0.015)
      return out + fmt::format(": the ESC counts {} pole pairs, by the independent speed there are {:.0f}", esc_pole_pairs, pairs);
  return out + ": pole pairs of the ESC, or marks on the rotor, are counted wrong, or the sensor of the independent speed is at fault";
}

}  // namespace

Watch::Watch(const modbus::StandSetup& setup, int esc_pole_pairs, std::function<void(const Trip&)> trip)
    : setup_(setup), esc_pole_pairs_(esc_pole_pairs), trip_(std::move(trip)), limits_(setup.limits) {}

void Watch::value(const char* limit, const std::string& source, double v, std::int64_t now) {
  if (const auto trip = limits_.see(limit, source, v, now)) trip_(*trip);
}

void Watch::stop(const char* limit, std::string what, LimitAction action, std::int64_t now) {
  trip_({limit, std::move(what), 0.0, 0.0, action, now});
}

std::vector<std::string> Watch::unwatched() const {
  std::vector<std::string> out;
  const auto has = [this](StandAxis axis) {
    return std::any_of(setup_.axes.begin(), setup_.axes.end(), [axis](const modbus::BoundChannel& a) { return a.axis == axis; });
  };
  if (!has(StandAxis::vibration)) out.emplace_back("vibration_m_s2");
  if (!has(StandAxis::motor_temperature) && !has(StandAxis::esc_temperature)) out.emplace_back("temperature_degC beside the ESC's own");
  return out;
}

void Watch::reading(StandAxis axis, double v, const std::array<double, 2>& load, std::int64_t now) {
  switch (axis) {
    case StandAxis::thrust:
    case StandAxis::torque:
      value("thrust_N", "thrust", load[0], now);
      value("torque_N_m", "torque", load[1], now);
      break;
    case StandAxis::voltage:
      value("voltage_V", "supply", v, now);
      break;
    case StandAxis::current:
      value("current_A", "supply", v, now);
      break;
    case StandAxis::motor_temperature:
      value("temperature_degC", "motor", v, now);
      break;
    case StandAxis::esc_temperature:
      value("temperature_degC", "ESC's sensor", v, now);
      break;
    case StandAxis::vibration:
      value("vibration_m_s2", "mount", v, now);
      break;
    case StandAxis::rotor_speed:
      value("omega_rad_s", "independent speed", v, now);
      break;
    default:
      break;
  }
}

void Watch::status(const protocols::EscStatus& s, double set_point, std::int64_t now) {
  const double omega = std::abs(s.rpm) * kRad_s_per_rpm;
  value("omega_rad_s", "ESC", omega, now);
  value("current_A", "ESC", static_cast<double>(s.current_A), now);
  value("voltage_V", "ESC", static_cast<double>(s.voltage_V), now);
  // Not-a-number: a board without a thermistor.
  if (s.temperature_K == s.temperature_K) value("temperature_degC", "ESC", static_cast<double>(s.temperature_K) - 273.15, now);
  if (!(set_point > 0.0)) return;
  const double error = set_point - omega;
  // At a set-point below the limit a rotor at rest would seem to follow.
  if (omega > 0.5 * set_point && std::abs(error) < limits_.limit("tracking_error_rad_s").max) followed_ = true;
  // From rest the motor needs time to start; after that it must follow.
  if (followed_ || now - left_zero_ns_ > kStart_ns) value("tracking_error_rad_s", "ESC", error, now);
}

void Watch::speeds(const GridRow& row, bool steady_hold) {
  const double independent = row.values[stand::kIndependentColumn], ratio = row.values[stand::kOmegaColumn] / independent;
  const bool wrong = steady_hold && independent > 10.0 && std::abs(ratio - 1.0) > kSpeedsDiffer;
  wrong_ratio_rows_ = wrong ? wrong_ratio_rows_ + 1 : 0;
  if (wrong_ratio_rows_ >= kSpeedsDifferRows)
    stop("pole_pairs", speed_ratio_text(ratio, esc_pole_pairs_), LimitAction::ramp_down, row.t_ns);
}

void Watch::stale(const std::string& channel, double age_ms, std::int64_t now) {
  const modbus::StandLimit& l = limits_.limit("stale_ms");
  trip_({"stale_ms", channel, age_ms, std::min(age_ms, l.max), l.action, now});
}

void Watch::bus(const BusState& b, std::int64_t now) {
  if (b.heard_ns >= 0 && now - b.heard_ns > kEscSilent_ns)
    stop("esc_silent", fmt::format("ESC {} does not report", b.esc_index), LimitAction::cut, now);
  if (b.foreign_ns >= 0 && now - b.foreign_ns < kForeign_ns)
    stop("foreign_commander", "another node sends commands on this bus", LimitAction::cut, now);
  if (b.shares_index) stop("shared_index", fmt::format("two nodes have esc_index {}", b.esc_index), LimitAction::cut, now);
  if (!b.esc_fault.empty()) stop("esc_fault", "the ESC reports an error: " + b.esc_fault, LimitAction::cut, now);
  const modbus::StandLimit &time = limits_.limit("run_time_s"), &age = limits_.limit("stale_ms");
  if (b.elapsed_s > time.max) trip_({"run_time_s", "run", b.elapsed_s, time.max, time.action, now});
  if (b.files_failed) stop("samples", "cannot be written: the disk is full or gone", LimitAction::ramp_down, now);
  for (const modbus::BoundChannel& a : setup_.axes) {
    const modbus::StandDevice& d = setup_.buses[a.bus].devices[a.device];
    if (d.profile.channels[a.channel].rate != modbus::PollRate::fast) continue;
    const double age_ms = 1e-6 * static_cast<double>(now - sampled_[a.axis]);
    if (age_ms > age.max) trip_({"stale_ms", fmt::format("{} ({})", modbus::name(a.axis), d.name), age_ms, age.max, age.action, now});
  }
}

}  // namespace rotorloop::stand_run
