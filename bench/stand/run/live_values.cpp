#include "bench/stand/run/live_values.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace rotorloop::stand_run {
namespace {

using Json = nlohmann::ordered_json;
using modbus::StandAxis;

Json known(std::optional<double> v) { return v && std::isfinite(*v) ? Json(*v) : Json(nullptr); }

const char* state_of(const Session& s) {
  if (s.done()) return s.end() == RunEnd::tripped ? "stopped at a limit" : s.end() == RunEnd::done ? "done" : "stopped";
  if (s.stopping()) return s.end() == RunEnd::tripped ? "a limit: stopping" : "stopping";
  return s.turning() ? "running" : "waiting for readings";
}

Json limits_of(const Session& s) {
  const auto unwatched = s.unwatched();
  Json out = Json::array();
  for (const auto& [key, limit] : s.limits().limits()) {
    std::optional<LimitMonitor::Nearest> now = s.limits().nearest(key);
    if (key == "run_time_s") now = LimitMonitor::Nearest{"", s.elapsed_s()};
    const bool watched = std::find(unwatched.begin(), unwatched.end(), key) == unwatched.end();
    out.push_back({{"name", key},
                   {"source", now ? now->source : ""},
                   {"value", known(now ? std::optional(now->value) : std::nullopt)},
                   {"max", limit.max},
                   {"action", name(limit.action)},
                   {"watched", watched}});
  }
  return out;
}

}  // namespace

Json live_values(const Session& s, std::size_t most_steps) {
  Json out{{"state", state_of(s)},
           {"t_s", s.elapsed_s()},
           {"planned_s", s.plan().typical_s(s.settle_s())},
           {"segment", s.segment()},
           {"segments", s.plan().segments.size()},
           {"set_point_rad_s", s.set_point_rad_s()},
           {"omega_rad_s", s.esc_rad_s()}};
  for (const auto& [key, axis] : {std::pair{"thrust_N", StandAxis::thrust}, std::pair{"torque_N_m", StandAxis::torque},
                                  std::pair{"voltage_V", StandAxis::voltage}, std::pair{"current_A", StandAxis::current},
                                  std::pair{"vibration_m_s2", StandAxis::vibration}, std::pair{"motor_degC", StandAxis::motor_temperature}})
    out[key] = known(s.newest(axis));
  out["limits"] = limits_of(s);
  Json steps = Json::array();
  for (std::size_t i = s.steps().size() - std::min(most_steps, s.steps().size()); i < s.steps().size(); ++i) {
    const StepMeans& m = s.steps()[i];
    steps.push_back({{"step", m.number},
                     {"configuration", std::string(1, m.configuration)},
                     {"omega_rad_s", m.omega_rad_s},
                     {"thrust_N", m.thrust_N},
                     {"torque_N_m", m.torque_N_m},
                     {"voltage_V", known(m.voltage_V)},
                     {"current_A", known(m.current_A)},
                     {"settled", m.settled}});
  }
  out["steps"] = std::move(steps);
  if (s.trip()) out["trip"] = text(*s.trip());
  return out;
}

}  // namespace rotorloop::stand_run
