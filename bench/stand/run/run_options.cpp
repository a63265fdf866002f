#include "bench/stand/run/run_options.hpp"

#include <fmt/format.h>

#include <cmath>

#include "bench/sysid/log/column_table.hpp"
#include "bench/sysid/log/log_reader.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"

namespace rotorloop::stand_run {
namespace {

std::vector<ReplayPoint> read_replay(const std::filesystem::path& path) {
  const log::ColumnTable t = log::parse_csv(log::read_log_bytes(path), path, nullptr, {});
  const auto first = [&](std::initializer_list<std::pair<const char*, double>> names) -> std::pair<const std::vector<double>*, double> {
    for (const auto& [n, factor] : names)
      if (t.has(n)) return {&t.columns.at(n), factor};
    return {nullptr, 0.0};
  };
  const auto [time, s_per_unit] = first({{"t_s", 1.0}, {"time_s", 1.0}, {"time_us", 1e-6}, {"t_us", 1e-6}});
  const auto [speed, rad_s_per_unit] = first({{"omega_rad_s", 1.0},
                                              {"omega_1_rad_s", 1.0},
                                              {"omega1_rad_s", 1.0},
                                              {"rotor_1_rad_s", 1.0},
                                              {"rpm", kRad_s_per_rpm},
                                              {"rpm_1", kRad_s_per_rpm}});
  if (time == nullptr || speed == nullptr)
    throw Error({path.generic_string(), "has no time and rotor speed that are known", "another program's file",
                 "give a CSV with t_s and omega_rad_s (or rpm)"});
  std::vector<ReplayPoint> out;
  for (std::size_t i = 0; i < time->size(); ++i)
    if (const double w = std::abs((*speed)[i]) * rad_s_per_unit;
        std::isfinite(w) && std::isfinite((*time)[i]) && (out.empty() || (*time)[i] * s_per_unit > out.back().t_s))
      out.push_back({(*time)[i] * s_per_unit, w});
  return out;
}

}  // namespace

Plan plan_of(const RunOptions& o, const modbus::StandSetup& setup) {
  const double most = setup.limits.at("omega_rad_s").max;
  SequenceOptions s = o.sequence;
  s.low_rad_s = o.rpm.size() == 2 ? o.rpm[0] * kRad_s_per_rpm : most / 3.0;
  s.high_rad_s = o.rpm.size() == 2 ? o.rpm[1] * kRad_s_per_rpm : 0.9 * most;
  s.idle_rad_s = o.idle_rpm * kRad_s_per_rpm;
  if (!o.replay.empty()) s.replay = read_replay(o.replay);
  return make_plan(o.sequences, s);
}

void refuse_unsafe(const modbus::StandSetup& setup, const Plan& plan, const RunOptions& o) {
  const Prediction p = predict(setup, plan, o.session.settle_s, o.supply_V);
  const std::string where = setup.path.generic_string();
  if (!p.exceeded.empty())
    throw Error(
        {where, "the plan exceeds what the stand file allows: " + p.exceeded.front(),
         p.typical_coefficients
             ? "thrust and torque are predicted by typical coefficients: give the propeller's expected_c_t_N_s2 and expected_c_q_N_m_s2"
             : "",
         "lower --rpm, shorten the sequence, or look at --dry-run"},
        ExitCode::safety);
  const std::string today = RunClock().started_utc().substr(0, 10);
  if (setup.expired(today))
    throw Error({where, fmt::format("the calibration expired on {}, today is {}", setup.expires_on, today), "",
                 "calibrate again, with at least six load cases"},
                ExitCode::data_quality);
  bool temperature = false, pressure = false;
  for (const modbus::BoundChannel& a : setup.axes) {
    temperature |= a.axis == modbus::StandAxis::air_temperature;
    pressure |= a.axis == modbus::StandAxis::air_pressure;
  }
  if (!o.density_kg_m3 && !(temperature && pressure))
    throw Error({where, "nothing on this stand measures the density of the air", "",
                 "bind air_temperature and air_pressure, or give --density: 1 % of it is 1 % of every coefficient"});
}

}  // namespace rotorloop::stand_run
