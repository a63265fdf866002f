#include "bench/stand/run/prediction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/base/constants.hpp"

namespace rotorloop::stand_run {
namespace {

// Static coefficients of propellers of 4 to 28 inches (UIUC vol. 1 to 3): C_T 0.08 to 0.15, C_P 0.03 to 0.09.
constexpr double kTypicalC_T = 0.12, kTypicalC_P = 0.06;
constexpr double kDriveEfficiency = 0.75;  // ESC and motor at part load
constexpr double kDensity_kg_m3 = 1.2;
constexpr double kSmallShare = 0.05;  // of full scale: below, rounding and zero drift weigh

}  // namespace

ExpectedCoefficients expected_coefficients(const modbus::StandSetup& s) {
  const double per_turn = 2.0 * std::numbers::pi;
  const double c_t = kTypicalC_T * kDensity_kg_m3 * std::pow(s.diameter_m, 4) / (per_turn * per_turn);
  const double c_q = kTypicalC_P / per_turn * kDensity_kg_m3 * std::pow(s.diameter_m, 5) / (per_turn * per_turn);
  const bool has_t = s.expected_c_t_N_s2 > 0.0, has_q = s.expected_c_q_N_m_s2 > 0.0;
  return {has_t ? s.expected_c_t_N_s2 : c_t, has_q ? s.expected_c_q_N_m_s2 : c_q, !has_t, !has_q};
}

Prediction predict(const modbus::StandSetup& s, const Plan& plan, double settle_s, double supply_V) {
  Prediction p;
  const ExpectedCoefficients e = expected_coefficients(s);
  p.typical_coefficients = e.typical_c_t || e.typical_c_q;
  p.duration_s = plan.typical_s(settle_s);
  std::map<double, Prediction::Level> by_speed;
  const auto level = [&](double w) {
    const double torque = e.c_q_N_m_s2 * w * w, power = torque * w / kDriveEfficiency;
    return Prediction::Level{w, e.c_t_N_s2 * w * w, torque, power, power / supply_V, 0};
  };
  for (const Segment& g : plan.segments) {
    const double w = g.motion == Motion::ramp     ? std::max(g.from_rad_s, g.omega_rad_s)
                     : g.motion == Motion::replay ? plan.highest_rad_s()
                                                  : g.omega_rad_s * (1.0 + g.amplitude);
    if (w == 0.0) continue;
    auto& l = by_speed.try_emplace(std::round(w * 10.0) / 10.0, level(w)).first->second;
    ++l.times;
    p.energy_J += l.power_W * (g.duration_s + (g.motion == Motion::hold ? settle_s : 0.0));
  }
  for (const auto& [w, l] : by_speed) p.levels.push_back(l);
  const auto exceed = [&](const char* key, double value, const char* unit) {
    const double max = s.limits.at(key).max;
    if (value > max) p.exceeded.push_back(fmt::format("{}: {:.4g} {} of at most {:.4g}", key, value, unit, max));
  };
  const Prediction::Level top = level(plan.highest_rad_s());
  exceed("omega_rad_s", top.omega_rad_s, "rad/s");
  exceed("thrust_N", top.thrust_N, "N");
  exceed("torque_N_m", top.torque_N_m, "N m");
  exceed("current_A", top.current_A, "A");
  exceed("run_time_s", p.duration_s, "s");
  exceed("voltage_V", supply_V, "V");
  if (top.omega_rad_s > s.propeller_omega_max_rad_s)
    p.exceeded.push_back(fmt::format("propeller: {:.0f} rad/s of at most {:.0f}", top.omega_rad_s, s.propeller_omega_max_rad_s));
  if (!p.levels.empty()) {
    const auto& full = s.calibration.full_scale;
    if (top.thrust_N < kSmallShare * full[0])
      p.warnings.push_back(fmt::format("thrust stays below {:.1f} % of full scale, {:.3g} N: rounding and drift will weigh",
                                       100.0 * top.thrust_N / full[0], full[0]));
    if (top.torque_N_m < kSmallShare * full[1])
      p.warnings.push_back(fmt::format("torque stays below {:.1f} % of full scale, {:.3g} N m: a smaller cell would say more",
                                       100.0 * top.torque_N_m / full[1], full[1]));
  }
  return p;
}

std::string prediction_text(const modbus::StandSetup& s, const Plan& plan, const Prediction& p) {
  std::string out = fmt::format("plan: {}; {} segments, about {:.0f} s, {:.1f} Wh\n", fmt::join(plan.names, ", "), plan.segments.size(),
                                p.duration_s, p.energy_J / 3600.0);
  out += fmt::format(
      "predicted with {}: propeller {}, {} m\n",
      p.typical_coefficients ? "typical coefficients of such a propeller (to a factor of two)" : "the stand file's expected coefficients",
      s.propeller.name, s.diameter_m);
  out += fmt::format("{:>8} {:>9} {:>9} {:>10} {:>8} {:>8} {:>6}\n", "RPM", "rad/s", "thrust N", "torque N m", "power W", "amps", "times");
  for (const auto& l : p.levels)
    out += fmt::format("{:>8.0f} {:>9.1f} {:>9.3f} {:>10.5f} {:>8.1f} {:>8.2f} {:>6}\n", l.omega_rad_s * kRpm_per_rad_s, l.omega_rad_s,
                       l.thrust_N, l.torque_N_m, l.power_W, l.current_A, l.times);
  for (const std::string& w : p.warnings) out += "note: " + w + "\n";
  for (const std::string& e : p.exceeded) out += "EXCEEDED " + e + "\n";
  return out;
}

std::string prediction_json(const modbus::StandSetup& s, const Plan& plan, const Prediction& p) {
  nlohmann::ordered_json j{{"format", 1},
                           {"command", "stand run --dry-run"},
                           {"sequences", plan.names},
                           {"segments", plan.segments.size()},
                           {"duration_s", p.duration_s},
                           {"energy_J", p.energy_J},
                           {"propeller", s.propeller.name},
                           {"diameter_m", s.diameter_m},
                           {"coefficients", p.typical_coefficients ? "typical" : "stand file"}};
  j["levels"] = nlohmann::ordered_json::array();
  for (const auto& l : p.levels)
    j["levels"].push_back({{"omega_rad_s", l.omega_rad_s},
                           {"thrust_N", l.thrust_N},
                           {"torque_N_m", l.torque_N_m},
                           {"power_W", l.power_W},
                           {"current_A", l.current_A},
                           {"times", l.times}});
  j["warnings"] = p.warnings;
  j["exceeded"] = p.exceeded;
  return j.dump(1) + "\n";
}

}  // namespace rotorloop::stand_run
