// Lines that a person reads: the fit, and measured against predicted for every throttle step.
#include <fmt/format.h>

#include <cmath>

#include "bench/propeller/motor_bench.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::propeller {

std::vector<std::string> report_lines(const MotorBenchResult& r) {
  std::vector<std::string> lines;
  const BenchParameters& p = r.parameters;
  lines.push_back(fmt::format(
      "HQ 5136 on a 2306 of 1800 rpm/V, six-step drive and blade-element rotor; {} scalars fitted, rms {:.2f} of the tolerances",
      r.form.size(), r.fitted_rms));
  lines.push_back(fmt::format(
      "R {:.3f} ohm, L {:.1f} uH, pitch offset {:.1f} deg, chord scale {:.3f}, drag scale {:.2f}, twist at full speed {:+.1f} deg",
      p.resistance_ohm, 1e6 * p.phase_inductance_H, p.pitch_offset_deg, p.chord_scale, p.drag_scale, p.twist_deg));
  lines.push_back(fmt::format("friction {:.2f} mN m + {:.2f} uN m s (rms {:.2f} mN m)", 1e3 * r.esc.static_friction_N_m,
                              1e6 * r.esc.viscous_friction_N_m_s, 1e3 * r.esc.friction_rms_N_m));
  lines.push_back("throttle        rpm  error %       A  error %       N  error %   overlap   unfitted: rpm, A, N error %");
  for (const BenchComparison& c : r.rows) {
    const BenchValues e = c.relative_error();
    lines.push_back(fmt::format("{:5.1f} {:8} {:6.0f} {:+8.2f} {:7.2f} {:+8.2f} {:7.3f} {:+8.2f} {:9.2f}   {:+.1f} {:+.1f} {:+.1f}",
                                c.throttle, c.held_out ? "held out" : "", c.measured.omega_rad_s / kRad_s_per_rpm, 100 * e.omega_rad_s,
                                c.measured.bus_A, 100 * e.bus_A, c.measured.thrust_N, 100 * e.thrust_N, c.overlap_share,
                                100 * (c.unfitted.omega_rad_s / c.measured.omega_rad_s - 1),
                                100 * (c.unfitted.bus_A / c.measured.bus_A - 1), 100 * (c.unfitted.thrust_N / c.measured.thrust_N - 1)));
  }
  lines.push_back(fmt::format("held out, worst: rpm {:.2f} % (limit {:.0f}), A {:.2f} % ({:.0f}), N {:.2f} % ({:.0f})",
                              100 * r.worst_held_out.omega_rad_s, 100 * kBenchLimits.omega, 100 * r.worst_held_out.bus_A,
                              100 * kBenchLimits.bus_A, 100 * r.worst_held_out.thrust_N, 100 * kBenchLimits.thrust));
  return lines;
}

}  // namespace rotorloop::propeller
