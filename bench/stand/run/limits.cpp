#include "bench/stand/run/limits.hpp"

#include <fmt/format.h>

#include <cmath>

namespace rotorloop::stand_run {

std::string_view name(modbus::LimitAction action) {
  switch (action) {
    case modbus::LimitAction::hold:
      return "hold";
    case modbus::LimitAction::ramp_down:
      return "ramp_down";
    case modbus::LimitAction::cut:
      break;
  }
  return "cut";
}

std::string text(const Trip& t) {
  if (t.max == 0.0) return fmt::format("{}: {}", t.limit, t.source);
  return fmt::format("{} of {}: {:.4g}, limit {:.4g}; action {}", t.limit, t.source, t.value, t.max, name(t.action));
}

std::optional<Trip> LimitMonitor::see(const std::string& key, const std::string& source, double value, std::int64_t now_ns) {
  const modbus::StandLimit& limit = limits_.at(key);
  const auto id = std::pair(key, source);
  newest_[id] = value;
  if (std::abs(value) <= limit.max) {
    beyond_.erase(id);
    return std::nullopt;
  }
  const auto [at, fresh] = beyond_.try_emplace(id, Beyond{now_ns, false});
  if (at->second.told || static_cast<double>(now_ns - at->second.since_ns) < 1e6 * limit.debounce_ms) return std::nullopt;
  at->second.told = true;
  return Trip{key, source, value, limit.max, limit.action, now_ns};
}

std::optional<LimitMonitor::Nearest> LimitMonitor::nearest(const std::string& limit) const {
  std::optional<Nearest> out;
  for (auto at = newest_.lower_bound({limit, ""}); at != newest_.end() && at->first.first == limit; ++at)
    if (!out || std::abs(at->second) > std::abs(out->value)) out = Nearest{at->first.second, at->second};
  return out;
}

}  // namespace rotorloop::stand_run
