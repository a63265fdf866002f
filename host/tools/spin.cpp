#include "host/tools/spin.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"

namespace rotorloop::tools {
namespace {

constexpr std::uint8_t kSpinPriority = 7, kSpinArmingPriority = 8;
constexpr std::int64_t kArmingPeriod_ns = 250'000'000;
constexpr std::int64_t kSilent_ns = 1'000'000'000;
constexpr std::int64_t kForeignRecently_ns = 1'000'000'000;

void check_range(const char* option, double value, double min, double max, const char* unit, const char* remedy) {
  if (value >= min && value <= max) return;
  throw Error({option, fmt::format("{}{} is out of range: {} to {}{}", value, unit, min, max, unit), "", remedy});
}

}  // namespace

std::string spin_end_text(SpinEnd end, const SpinOptions& o) {
  switch (end) {
    case SpinEnd::running:
      return "running";
    case SpinEnd::done:
      return "time over";
    case SpinEnd::released:
      return "released";
    case SpinEnd::foreign_commander:
      return "another node sends commands on this bus";
    case SpinEnd::silent:
      return fmt::format("ESC {} does not report", o.esc_index);
    case SpinEnd::shared_index:
      return fmt::format("two nodes have esc_index {}", o.esc_index);
    case SpinEnd::current:
      return fmt::format("current above {:.1f} A", o.most_current_A);
    case SpinEnd::temperature:
      return fmt::format("temperature above {:.0f} °C", o.most_temperature_C);
    case SpinEnd::too_fast:
      return fmt::format("speed above {:.0f} rpm", o.most_rpm);
    case SpinEnd::fault:
      return "the ESC reports an error";
  }
  return "";
}

void check_spin(const SpinOptions& o) {
  check_range("--index", o.esc_index, 0, 15, "", "count motors from 0, as the autopilot does; see them with: rotorloop esc list");
  if (o.duty) {
    check_range("--duty", o.value, -1.0, 1.0, " of full duty", "0.1 turns most motors");
  } else {
    check_range("--rpm", o.value, -30'000.0, 30'000.0, " rpm", "3000 is slow for a 5-inch motor; a minus turns it backwards");
  }
  check_range("--ramp", o.ramp_s, 0.0, 60.0, " s", "1 is gentle");
  check_range("--for", o.for_s, 0.1, 600.0, " s", "5 is enough to see it turn");
  check_range("--max-current", o.most_current_A, 0.1, 200.0, " A", "more than the motor draws at this speed, less than it survives");
  check_range("--max-temperature", o.most_temperature_C, 0.0, 150.0, " °C", "80 spares the board");
  check_range("--max-rpm", o.most_rpm, 1.0, 200'000.0, " rpm", "more than is asked for, less than the propeller survives");
}

Spin::Spin(ToolNode& tool, EscTable& table, const SpinOptions& options) : tool_(tool), table_(table), options_(options) {
  check_spin(options);
  const auto foreign = [this](const auto&, std::uint8_t) { foreign_ns_ = tool_.now_ns(); };
  tool.on<protocols::RawCommand>(foreign);
  tool.on<protocols::RpmCommand>(foreign);
}

SpinEnd Spin::watch() const {
  if (foreign_ns_ >= 0 && tool_.now_ns() - foreign_ns_ < kForeignRecently_ns) return SpinEnd::foreign_commander;
  const EscRow* row = table_.of_index(options_.esc_index);
  if (row == nullptr || tool_.now_ns() - row->heard_ns > kSilent_ns) return SpinEnd::silent;
  if (row->shares_index) return SpinEnd::shared_index;
  if (std::fabs(static_cast<double>(row->status.current_A)) > options_.most_current_A) return SpinEnd::current;
  if (static_cast<double>(row->status.temperature_K) - 273.15 > options_.most_temperature_C) return SpinEnd::temperature;
  if (std::abs(row->status.rpm) > options_.most_rpm) return SpinEnd::too_fast;
  const auto node = tool_.nodes().find(row->node);
  if (node != tool_.nodes().end() && node->second.status.health >= protocols::Health::error) return SpinEnd::fault;
  return SpinEnd::running;
}

SpinEnd Spin::check_before() const { return watch(); }

void Spin::begin() {
  phase_ = Phase::turning;
  begun_ns_ = next_command_ns_ = next_arming_ns_ = tool_.now_ns();
}

void Spin::arm(bool armed) {
  tool_.broadcast(protocols::ArmingStatus{.status = armed ? protocols::ArmingStatus::kFullyArmed : protocols::ArmingStatus::kDisarmed},
                  kSpinArmingPriority);
}

// All positions before this one are zero: a stop for the other ESCs.
void Spin::send(double value) {
  set_point_ = value;
  const auto count = static_cast<std::uint8_t>(options_.esc_index + 1);
  const auto index = static_cast<std::size_t>(options_.esc_index);
  if (options_.duty) {
    protocols::RawCommand c;
    c.count = count;
    c.command[index] = static_cast<std::int16_t>(std::lround(value * protocols::RawCommand::kFullScale));
    tool_.broadcast(c, kSpinPriority);
  } else {
    protocols::RpmCommand c;
    c.count = count;
    c.rpm[index] = static_cast<std::int32_t>(std::lround(value));
    tool_.broadcast(c, kSpinPriority);
  }
}

void Spin::step(bool held) {
  const std::int64_t now_ns = tool_.now_ns();
  if (phase_ == Phase::turning) {
    if (const EscRow* row = table_.of_index(options_.esc_index))
      fastest_rpm_ = std::max(fastest_rpm_, std::fabs(static_cast<double>(row->status.rpm)));
    end_ = watch();
    if (end_ == SpinEnd::running && !held) end_ = SpinEnd::released;
    if (end_ == SpinEnd::running && now_ns - begun_ns_ >= static_cast<std::int64_t>(options_.for_s * 1e9)) end_ = SpinEnd::done;
    if (end_ != SpinEnd::running) {
      phase_ = Phase::stopping;
      stopping_ns_ = next_command_ns_ = now_ns;
      // A limit or another commander: at once, not after the zeros.
      if (end_ != SpinEnd::done && end_ != SpinEnd::released) arm(false);
    }
  }
  if (phase_ == Phase::stopping && now_ns - stopping_ns_ >= kStopping_ns) {
    arm(false);
    phase_ = Phase::done;
  }
  if (phase_ != Phase::turning && phase_ != Phase::stopping) return;
  if (phase_ == Phase::turning && now_ns >= next_arming_ns_) {
    arm(true);
    next_arming_ns_ = now_ns + kArmingPeriod_ns;
  }
  if (now_ns < next_command_ns_) return;
  next_command_ns_ = now_ns + kCommandPeriod_ns;
  const double share = options_.ramp_s > 0.0 ? std::min(1.0, static_cast<double>(now_ns - begun_ns_) * 1e-9 / options_.ramp_s) : 1.0;
  send(phase_ == Phase::turning ? share * options_.value : 0.0);
}

}  // namespace rotorloop::tools
