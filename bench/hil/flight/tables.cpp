// The tables of a run as fixed-width text, for terminals and logs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/hil/flight/metrics.hpp"
#include "bench/render/digits.hpp"

namespace rotorloop::hil {
namespace {

using Row = std::vector<std::string>;

// Width in characters, not bytes: "±" is two bytes wide in UTF-8.
std::size_t width(const std::string& s) {
  std::size_t n = 0;
  for (const char c : s) n += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  return n;
}

// Columns as wide as their widest cell; the first two left, the others right aligned. Empty columns are left out.
std::string aligned(const std::vector<Row>& rows, std::size_t left_columns) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  std::vector<bool> used(widths.size(), false);
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t c = 0; c < widths.size(); ++c) {
      widths[c] = std::max(widths[c], width(rows[r][c]));
      if (r > 0 && !rows[r][c].empty()) used[c] = true;
    }
  std::string out;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::string line;
    for (std::size_t c = 0; c < widths.size(); ++c) {
      if (!used[c]) continue;
      if (!line.empty()) line += "   ";
      const std::string pad(widths[c] - width(rows[r][c]), ' ');
      line += c < left_columns ? rows[r][c] + pad : pad + rows[r][c];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
    if (r == 0) {
      std::size_t total = 0;
      for (std::size_t c = 0; c < widths.size(); ++c)
        if (used[c]) total += widths[c] + (total ? 3 : 0);
      out += std::string(total, '-') + "\n";
    }
  }
  return out;
}

std::string cm(double v) { return std::isnan(v) ? "-" : fmt::format("{:.2f}", v); }
// With the digits that the spread allows; equal seeds have none.
std::string spread_text(double mean, double std, std::string (*alone)(double)) {
  return std > 0.0 ? render::measured_text(mean, std) : alone(mean) + " ± 0";
}
std::string percent(double v) { return fmt::format("{:.1f}", v); }

const PublishedError* published(const Scenario& s, const std::string& flight, Variant v, ErrorAxis axis) {
  for (const auto& p : s.published)
    if (p.flight == flight && p.variant == v && p.axis == axis) return &p;
  return nullptr;
}

}  // namespace

std::string tracking_table_text(const Scenario& s, const Assessment& a, const std::vector<FlightResult>& results) {
  std::vector<Row> rows{
      {"tracking error, cm", "variant", "mean ± std", "min … max", "seeds", "reduction", "from estimate", "other axis", "published"}};
  std::string previous;
  Variant first = Variant::pd_ff;
  for (const auto& c : a.table) {
    const auto axis = table_axis(s, c.flight);
    const bool z = axis == ErrorAxis::z;
    const auto& e = z ? c.error_z_cm : c.error_3d_cm;
    const bool new_flight = c.flight != previous;
    if (new_flight) first = c.variant;
    previous = c.flight;
    const auto less = new_flight ? Reduction{} : reduction(results, c.flight, first, c.variant, axis);
    const auto* p = published(s, c.flight, c.variant, axis);
    rows.push_back({new_flight ? fmt::format("{} ({})", c.flight, z ? "|z|" : "3-D") : "", std::string(variant_label(c.variant)),
                    e.n > 1 ? spread_text(e.mean, e.std, cm) : cm(e.mean), e.n > 1 ? fmt::format("{} … {}", cm(e.min), cm(e.max)) : "",
                    c.completed == c.flown ? std::to_string(c.flown) : fmt::format("{} of {}", c.completed, c.flown),
                    less.n == 0  ? ""
                    : less.n > 1 ? spread_text(less.percent, less.std_percent, percent) + " %"
                                 : fmt::format("{:.1f} %", less.percent),
                    cm((z ? c.estimate_error_z_cm : c.estimate_error_3d_cm).mean),
                    fmt::format("{} {}", z ? "3-D" : "|z|", cm((z ? c.error_3d_cm : c.error_z_cm).mean)), p ? cm(p->error_cm) : ""});
  }
  return aligned(rows, 2);
}

std::string controllers_text(const Assessment& a) {
  if (std::none_of(a.table.begin(), a.table.end(), [](const TableCell& c) { return c.variant.is_external(); })) return "";
  std::vector<Row> rows{{"controllers", "variant", "attitude error, deg", "mean motor command, rad/s", "its std over time, rad/s"}};
  std::string previous;
  for (const auto& c : a.table) {
    const auto figure = [](const Spread& s) { return s.n > 1 ? spread_text(s.mean, s.std, cm) : cm(s.mean); };
    rows.push_back({c.flight != previous ? c.flight : "", variant_label(c.variant), figure(c.attitude_error_deg),
                    figure(c.command_mean_rad_s), figure(c.command_std_rad_s)});
    previous = c.flight;
  }
  return aligned(rows, 2);
}

std::string pace_text(const PaceResult& p) {
  const Lateness& l = p.lateness;
  std::string out = fmt::format("pace {}: {} deadlines, {} missed; 99.9 % late by at most {:.0f} us, worst {:.0f} us; late by", p.pace,
                                l.steps, l.missed, l.quantile_us(0.999), 1e-3 * static_cast<double>(l.worst_ns));
  for (std::size_t i = 0; i < l.counts.size(); ++i) {
    if (l.counts[i] == 0) continue;
    const bool last = i == Lateness::kUpTo_us.size();
    out += fmt::format(" {} {} us: {},", last ? "more than" : "up to", Lateness::kUpTo_us[last ? i - 1 : i], l.counts[i]);
  }
  out.pop_back();
  return out;
}

std::string limits_text(const Assessment& a) {
  if (a.limits.empty()) return "";
  std::vector<Row> rows{{"limit", "", "measured", "allowed"}};
  for (const auto& l : a.limits)
    rows.push_back({l.name,
                    std::isnan(l.value) ? "not measured"
                    : l.pass            ? "pass"
                                        : "MISSED",
                    std::isnan(l.value) ? "-" : fmt::format("{:.2f} {}", l.value, l.unit),
                    fmt::format("{} {} {}", l.upper ? "<=" : ">=", l.limit, l.unit)});
  return aligned(rows, 2);
}

}  // namespace rotorloop::hil
