#include "bench/stand/evaluate/compare/thrust_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

double degrees_of(double u_a, double degrees_a, double u_b, double degrees_b) {
  const double over = std::pow(u_a, 4) / degrees_a + std::pow(u_b, 4) / degrees_b;
  return over > 0.0 ? std::min(1e6, std::pow(u_a * u_a + u_b * u_b, 2) / over) : 1e6;
}

}  // namespace

PairComparison compare_pair(const Compared& a, const Compared& b, double margin, double shared) {
  PairComparison p{a.name, b.name};
  const double u_a = a.u / a.value, u_b = b.u / b.value;
  p.margin = margin;
  p.d = std::log(a.value / b.value);
  p.u = std::sqrt(std::max(1e-12, u_a * u_a + u_b * u_b - 2.0 * shared * shared));
  p.degrees = degrees_of(u_a, a.degrees, u_b, b.degrees);
  const double two_sided = student_quantile(0.95, p.degrees), one_sided = student_quantile(0.90, p.degrees);
  p.low = p.d - two_sided * p.u;
  p.high = p.d + two_sided * p.u;
  p.z = std::abs(p.d) / p.u;
  p.e_n = std::abs(p.d) / (2.0 * p.u);
  p.significant = p.low > 0.0 || p.high < 0.0;
  // A difference that is real and smaller than what matters is an equivalence: the margin is what matters.
  const bool within = std::abs(p.d) + one_sided * p.u < margin;
  p.verdict = within ? ComparisonVerdict::equivalent : p.significant ? ComparisonVerdict::different : ComparisonVerdict::cannot_tell;
  if (p.verdict == ComparisonVerdict::cannot_tell) p.needed_u = std::max(std::abs(p.d) / two_sided, (margin - std::abs(p.d)) / one_sided);
  return p;
}

std::string verdict_text(const PairComparison& p) {
  if (p.verdict == ComparisonVerdict::different) return "different";
  if (p.verdict == ComparisonVerdict::equivalent) return "equivalent";
  return fmt::format("cannot tell: need u < {:.2g} %", 100.0 * p.needed_u);
}

std::vector<Attribution> attribution(const AttributionInputs& in, double observed_d) {
  std::vector<Attribution> rows;
  const auto add = [&](const char* cause, double d, double u, bool tested, const std::string& note) {
    rows.push_back({cause, d, u, tested, note});
  };
  if (in.stand_centre_rad_s > 0.0 && in.hover_rad_s > 0.0) {
    const double l = std::log(in.stand_centre_rad_s / in.hover_rad_s);
    add("speed (Reynolds number)", (in.exponent - 2.0) * l, in.exponent_u * std::abs(l), in.exponent_u > 0.0,
        "stand's window against hover, by the local exponent");
  }
  add("air density", 0.0, in.density_u * std::numbers::sqrt2, false, "0.37 % per kelvin, 0.10 % per hPa: of both days");
  if (in.arm_width_m > 0.0 && in.rotor_radius_m > 0.0 && !in.abab) {
    // Download on an arm across the slipstream: κ² C_d (w L / A) / 4 of the thrust, C_d 1.2 to 2, κ 1 to 1.4.
    const double share = in.arm_width_m * in.rotor_radius_m / (std::numbers::pi * in.rotor_radius_m * in.rotor_radius_m) / 4.0;
    const double low = 1.0 * 1.2 * share, high = 1.96 * 2.0 * share;
    add("arm below the rotor", 0.5 * (low + high), (high - low) / std::sqrt(12.0), false,
        "predicted from its width; measured by alternating runs with and without the arm");
  } else {
    add("arm below the rotor", 0.0, 0.0, in.abab,
        in.abab ? "the arm was behind the propeller on the stand" : "not described: --arm-width; 1 to 8 % for arms of 10 to 20 mm");
  }
  if (in.mass_u > 0.0) add("mass", 0.0, in.mass_u, false, "one to one on the flight's coefficient");
  add("disk area of the flight's model", 0.0, 0.48 * in.radius_u, false, "0.24 % of c_t per 1 % of area");
  if (in.rotor_scatter > 0.0)
    add("rotor to rotor", 0.0, in.rotor_scatter * std::sqrt(1.0 + 0.25), false, "one on the stand, four in flight");
  if (in.zero_share > 0.0) add("zero and hysteresis of the cell", 0.0, in.zero_share, true, "of the run's budget");
  Attribution sum{"sum", 0.0, 0.0, false, ""};
  for (const Attribution& a : rows) {
    sum.d += a.d;
    sum.u = std::hypot(sum.u, a.u);
  }
  sum.note = fmt::format("remaining {:+.2f} %", 100.0 * (observed_d - sum.d));
  rows.push_back(sum);
  return rows;
}

}  // namespace rotorloop::stand
