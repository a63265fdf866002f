#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/identify/beside.hpp"

namespace rotorloop::identify {
namespace {

// Columns count characters, not bytes.
std::string padded(const std::string& text, std::size_t width) {
  std::size_t shown = 0;
  for (const char c : text) shown += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  return text + std::string(width > shown ? width - shown : 1, ' ');
}
std::string or_blank(double v, const char* format, std::size_t width) {
  return std::isfinite(v) ? fmt::format(fmt::runtime(format), v) : std::string(width, ' ');
}

std::string line(const std::string& symbol, double found, const std::string& unit, const Said& s, const std::string& origin,
                 std::size_t width) {
  return fmt::format("  {}{:>13.5g}  {}{:>13.5g} {:>9}  {}{}{}\n", padded(symbol, width), found, padded(unit, 9), s.value,
                     s.u > 0.0 ? fmt::format("{:.2g}", s.u) : "", padded(origin, 7), or_blank(s.percent, "{:>+9.2f}", 9),
                     or_blank(s.z, "{:>8.1f}", 8));
}

}  // namespace

std::string beside_table(const Identification& r, const FileComparison& c, const std::vector<DerivedQuantity>& derived) {
  std::size_t width = 22;
  for (const ParameterRow& row : c.rows) width = std::max(width, row.symbol.size() + 9);  // with "(held)"
  std::string out;
  for (const BesideColumn& b : c.beside) {
    out += fmt::format("{}beside {} (difference: these flights above the file)\n  {}{:>13}  {}{:>13} {:>9}  {}{:>9}{:>8}\n",
                       out.empty() ? "" : "\n", b.label, padded("parameter", width), "flights", padded("unit", 9), "file", "u",
                       padded("origin", 7), "%", "z");
    for (std::size_t i = 0; i < c.rows.size(); ++i) {
      if (!b.parameters[i]) continue;
      const std::string unit = estimate::parameter_info(c.rows[i].parameter, r.problem.start.terms).unit;
      out += line(c.rows[i].symbol + (c.rows[i].estimate ? "" : " (held)"), c.rows[i].value, unit, *b.parameters[i],
                  std::string(host::name(b.parameters[i]->origin)), width);
    }
    for (std::size_t i = 0; i < b.derived.size(); ++i)
      out += line(derived[i].symbol, derived[i].value, derived[i].unit, b.derived[i], "", width);
  }
  return out;
}

std::string static_thrust_table(const FileComparison& c, const std::vector<DerivedQuantity>& derived) {
  const DerivedQuantity* found = derived_named("static_c_t", derived);
  if (c.static_thrust.empty() || !found) return "";
  std::string out = fmt::format("static thrust of these flights: c_t {:.5g} ± {:.2g} {}\n", found->value,
                                std::max(found->u, found->u_robust), found->unit);
  for (const ThrustBeside& t : c.static_thrust) {
    out += fmt::format("  {}{}{:>13.5g} ± {:<9.2g} flights {:+.2f} %", padded(t.label, 28),
                       padded(std::string(host::name(t.said.origin)), 8), t.said.value, t.said.u, t.said.percent);
    if (std::isfinite(t.said.z)) out += fmt::format(", z {:.1f}", t.said.z);
    out += fmt::format("  ({:.0f} to {:.0f} RPM)\n", t.rpm_window[0], t.rpm_window[1]);
  }
  return out;
}

std::string sensor_rotation_text(const Identification& r) {
  const auto q = sensor_rotation(r);
  if (!q) return "";
  const Eigen::Quaterniond& s = r.problem.start.start_q_BS;
  return fmt::format(
      "q_BS (w x y z): {:.6f} {:.6f} {:.6f} {:.6f}; the rows q_BS,x to z are its rotation vector about the start value {:.6g} {:.6g} "
      "{:.6g} "
      "{:.6g}\n",
      q->w(), q->x(), q->y(), q->z(), s.w(), s.x(), s.y(), s.z());
}

}  // namespace rotorloop::identify
