#include <fmt/format.h>

#include "bench/stand/instruments/poll_plan.hpp"
#include "bench/stand/instruments/stand_setup.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::modbus {

std::string stand_setup_text(const StandSetup& s, const std::string& today) {
  std::string out =
      fmt::format("{}: motor {} ({}), ESC {} ({}, {} pole pairs), propeller {} ({}, {} m)\n", s.name, s.motor.name, s.motor.serial,
                  s.esc.name, s.esc.serial, s.pole_pairs, s.propeller.name, s.propeller.serial, number_text(s.diameter_m));
  for (const StandBus& b : s.buses) {
    out += fmt::format("bus {}{}{}\n", b.port.tcp ? "tcp:" : "rtu:", b.port.path,
                       b.port.tcp ? fmt::format(":{}", b.port.port) : ", " + text(b.format));
    std::int64_t cycle = 0;
    for (const StandDevice& d : b.devices) {
      out += fmt::format("  {} is {} at address {}, evidence {}\n", d.name, d.profile.title(), d.slave, d.profile.evidence);
      for (const ReadGroup& g : make_plan(d.profile, d.channels).fast)
        cycle += exchange_ns(g, b.port.tcp ? tcp_timing(d.profile) : rtu_timing(d.profile, b.format),
                             static_cast<std::int64_t>(d.profile.turnaround_ms * 1e6));
    }
    if (cycle)
      out += fmt::format("  fast channels at {:.0f} Hz at most, as byte times, gaps and typical turnarounds allow\n",
                         1e9 / static_cast<double>(cycle));
  }
  for (const BoundChannel& a : s.axes) {
    const StandDevice& d = s.buses[a.bus].devices[a.device];
    out += fmt::format("axis {:<18} {}.{}{}\n", name(a.axis), d.name, d.profile.channels[a.channel].name,
                       a.lag_ms != 0.0 ? fmt::format(", lag {} ± {} ms", number_text(a.lag_ms), number_text(a.u_lag_ms)) : "");
  }
  const LoadCalibration& c = s.calibration;
  out += fmt::format("calibration of {}, expires {}{}: condition {:.2f}; standard uncertainty of the loads {:.2f} %\n", s.calibrated_on,
                     s.expires_on, s.expired(today) ? " (EXPIRED)" : "", c.condition, 100.0 * s.u_calibration);
  for (std::size_t i = 0; i < 2; ++i)
    out += fmt::format(
        "  {}: leaves {:.3f} % of full scale (standard deviation; greatest {:.3f} %), cross-talk from {} {:.2f} % before the matrix\n",
        i ? "torque" : "thrust", 100.0 * c.residual_sd[i] / c.full_scale[i], 100.0 * c.residual_max[i] / c.full_scale[i],
        i ? "thrust" : "torque", c.cross_talk_percent[i]);
  for (const std::string& n : s.notes) out += "note: " + n + "\n";
  return out;
}

}  // namespace rotorloop::modbus
