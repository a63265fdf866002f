// Force and torque before and after, as table and as a section of the report.
#include <fmt/format.h>

#include <array>

#include "bench/identify/wrench_score.hpp"
#include "bench/render/svg_pieces.hpp"

namespace rotorloop::identify {
namespace {

using Index = Eigen::Index;

constexpr std::array<const char*, 6> kAxes{"force x", "force y", "force z", "torque x", "torque y", "torque z"};
constexpr std::array<const char*, 2> kUnits{"N", "N m"};

const char* unit_of(Index axis) { return kUnits[static_cast<std::size_t>(axis / 3)]; }
bool has(const WrenchComparison& c, Index axis) { return axis < 3 ? c.force : c.torque; }

std::string band_text(const WrenchBand& b) {
  if (b.from_Hz <= 0.0) return b.to_Hz > 0.0 ? fmt::format("below {:g} Hz", b.to_Hz) : "at all frequencies";
  return b.to_Hz > 0.0 ? fmt::format("{:g} to {:g} Hz", b.from_Hz, b.to_Hz) : fmt::format("above {:g} Hz", b.from_Hz);
}

// Of one flight: lengths of both errors, and the delays.
std::string flight_text(const WrenchComparison& c, std::size_t i) {
  const WrenchScore &b = c.before[i], &a = c.after[i];
  std::string out;
  if (c.force) out += fmt::format("force {:.4g} -> {:.4g} N", b.force_N(), a.force_N());
  if (c.torque) out += fmt::format("{}torque {:.4g} -> {:.4g} N m", out.empty() ? "" : ", ", b.torque_N_m(), a.torque_N_m());
  if (c.torque && i + 1 < c.after.size()) out += fmt::format(", readings {:+.1f} ms late", 1e3 * c.after_aligned[i].delay_s);
  return out;
}

}  // namespace

std::string wrench_table(const WrenchComparison& c) {
  if (c.after.empty()) return {};
  const WrenchScore &b = c.before.back(), &a = c.after.back(), &ba = c.before_aligned.back(), &aa = c.after_aligned.back();
  std::string out = fmt::format("Force and torque that the held-out flights show, {} ({} samples):\n", band_text(c.band), a.samples);
  out += fmt::format("  {:<10} {:<32} {:<20} {}\n", "", "rms error", "share explained", "each flight's stamps aligned");
  for (Index i = 0; i < 6; ++i) {
    if (!has(c, i)) continue;
    out += fmt::format("  {:<10} {:>10.4g} -> {:>10.4g} {:<5}  {:>6.3f} -> {:>6.3f}     {:>6.3f} -> {:>6.3f}\n",
                       kAxes[static_cast<std::size_t>(i)], b.rms[i], a.rms[i], unit_of(i), b.explained[i], a.explained[i], ba.explained[i],
                       aa.explained[i]);
  }
  for (std::size_t f = 0; f < c.after.size(); ++f) out += fmt::format("  {}: {}\n", c.after[f].flight, flight_text(c, f));
  return out;
}

std::string wrench_html(const WrenchComparison& c) {
  if (c.after.empty()) return {};
  const WrenchScore &b = c.before.back(), &a = c.after.back(), &ba = c.before_aligned.back(), &aa = c.after_aligned.back();
  std::string out = fmt::format(
      "<h3 id=\"wrench\">Force and torque, {}</h3>\n<p>What accelerometer and gyro of these flights show, times mass and inertia of the "
      "vehicle "
      "file, against what the model foretells; both through the same filters. Aligned: the readings of each flight moved by the delay at "
      "which the model explains most torque.</p>\n<div class=\"scroll\"><table><thead><tr><th class=\"l\">axis</th><th>rms before</th>"
      "<th>after</th><th class=\"l\">unit</th><th>explained before</th><th>after</th><th>aligned before</th><th>after</th></tr></thead>"
      "<tbody>\n",
      band_text(c.band));
  for (Index i = 0; i < 6; ++i) {
    if (!has(c, i)) continue;
    out += fmt::format(
        "<tr><td class=\"l\">{}</td><td>{:.4g}</td><td class=\"big\">{:.4g}</td><td class=\"l\">{}</td><td>{:.3f}</td><td>{:.3f}</td>"
        "<td>{:.3f}</td><td>{:.3f}</td></tr>\n",
        kAxes[static_cast<std::size_t>(i)], b.rms[i], a.rms[i], unit_of(i), b.explained[i], a.explained[i], ba.explained[i],
        aa.explained[i]);
  }
  out += "</tbody></table></div>\n<ul>\n";
  for (std::size_t f = 0; f < c.after.size(); ++f)
    out += fmt::format("<li>{}: {}</li>\n", render::xml_escaped(c.after[f].flight), render::xml_escaped(flight_text(c, f)));
  return out + "</ul>\n";
}

}  // namespace rotorloop::identify
