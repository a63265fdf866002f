#include "bench/hil/esc_lab/lab_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "bench/hil/flight/limiter_names.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::esc_lab {
namespace {

using Traced = LabFigures::Traced;
enum Colour { kSpeed, kPhase, kTorque, kBus, kState };

constexpr std::array<std::string_view, 11> kStateNames = {"off",   "align",    "ramp",     "hand-over", "running", "braking",
                                                          "fault", "catching", "stopping", "holding",   "tone"};
constexpr std::array<std::string_view, 8> kFaultNames = {"none",  "over-current", "under-voltage", "over-voltage",
                                                         "stall", "start failed", "sensor",        "over-temperature"};

std::vector<double> scaled(const std::vector<double>& values, double by) {
  std::vector<double> out(values);
  for (double& v : out) v *= by;
  return out;
}

// Where `value` stood, a row for each that occurred.
template <class Value, class Name>
void rows_of(render::Timeline& timeline, const EscTrace& t, const std::vector<double>& x, const std::vector<Value>& values,
             const Name& name, int colour) {
  for (int code = 0; code < 32; ++code) {
    render::TimelineRow row;
    for (std::size_t i = 0; i < t.t_s.size(); ++i) {
      if (static_cast<int>(values[i]) != code || x[i] < timeline.x_min || x[i] > timeline.x_max) continue;
      const double end = i + 1 < x.size() ? x[i + 1] : x[i];
      if (!row.intervals.empty() && i > 0 && static_cast<int>(values[i - 1]) == code)
        row.intervals.back().to = end;
      else
        row.intervals.push_back({x[i], end});
    }
    row.label = name(code);
    row.colour = colour;
    if (!row.intervals.empty() && !row.label.empty()) timeline.rows.push_back(std::move(row));
  }
}

render::Plot plot_of(std::string title, std::string y_label, double x_min) {
  render::Plot p;
  p.title = std::move(title);
  p.x_label = "time, s";
  p.y_label = std::move(y_label);
  p.x_min = x_min;
  return p;
}

// Speed, currents, and what limited or stopped them, below each other on one time axis.
std::string traced_html(const Traced& f, const std::string& caption) {
  const EscTrace& t = f.trace;
  std::vector<double> x = t.t_s;
  for (double& v : x) v -= f.from_s;
  const double x_min = std::max(0.0, x.front()), x_max = std::min(x.back(), f.to_s);
  const auto from = static_cast<std::size_t>(std::lower_bound(x.begin(), x.end(), 0.0) - x.begin());
  const auto to = static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), x_max) - x.begin());
  const auto cut = [&](const std::vector<double>& v) {
    return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(from), v.begin() + static_cast<std::ptrdiff_t>(to));
  };
  render::Plot speed = plot_of("rotor speed", "speed, 10³ RPM", x_min);
  const double kilo_rpm = 1e-3 / kRpm;
  speed.series.push_back({"asked for", cut(x), cut(scaled(t.order_rad_s, kilo_rpm)), render::kNeutral, true, true});
  speed.series.push_back({"true", cut(x), cut(scaled(t.omega_rad_s, kilo_rpm)), kSpeed});
  render::Plot current = plot_of("motor currents", "current, A", x_min);
  current.height_px = 200;
  current.series.push_back({"largest of a phase (vector length)", cut(x), cut(t.phase_A), kPhase});
  current.series.push_back({"torque current", cut(x), cut(t.torque_A), kTorque});
  render::Timeline what;
  what.title = "state, limits and faults";
  what.x_label = "time, s";
  what.x_min = x_min;
  what.x_max = x_max;
  rows_of(
      what, t, x, t.state,
      [](int c) { return c < static_cast<int>(kStateNames.size()) ? std::string(kStateNames[static_cast<std::size_t>(c)]) : ""; }, kState);
  rows_of(
      what, t, x, t.limiter,
      [](int c) { return c == 0 ? std::string() : "limit: " + std::string(hil::limiter_name(static_cast<firmware::Limiter>(c))); }, kPhase);
  rows_of(
      what, t, x, t.fault,
      [](int c) {
        return c == 0 || c >= static_cast<int>(kFaultNames.size()) ? std::string()
                                                                   : "fault: " + std::string(kFaultNames[static_cast<std::size_t>(c)]);
      },
      kTorque);
  return render::figure_html(caption, plot_svg(speed)) + render::figure_html("", plot_svg(current)) +
         render::figure_html("", timeline_svg(what));
}

render::Section traced_section(const char* title, const char* id, const std::string& text, const std::vector<Traced>& traced) {
  render::Section s{.title = title, .id = id};
  s.blocks.push_back(render::Paragraph{text});
  for (const Traced& t : traced)
    s.blocks.push_back(render::Markup{
        traced_html(t, fmt::format("Draw {}{}.", t.seed, t.what.empty() ? "" : ": " + t.what) + (t.missed ? " A limit is missed." : ""))});
  return s;
}

render::Section sag_section(const std::vector<Traced>& sags) {
  render::Section s{.title = "Falling supply", .id = "sag"};
  s.blocks.push_back(
      render::Paragraph{"From 4.2 to 3.5 V per cell in one second, at 60 % of the highest speed that the lower voltage holds."});
  for (const Traced& f : sags) {
    render::Plot bus = plot_of("supply voltage", "supply, V", 0.0), error = plot_of("speed error", "speed error, %", 0.0);
    bus.height_px = error.height_px = 180;
    bus.series.push_back({"", f.trace.t_s, f.trace.bus_V, kBus});
    std::vector<double> percent;
    for (std::size_t i = 0; i < f.trace.t_s.size(); ++i) percent.push_back(100.0 * (f.trace.omega_rad_s[i] / f.trace.order_rad_s[i] - 1.0));
    error.series.push_back({"", f.trace.t_s, percent, kSpeed});
    s.blocks.push_back(
        render::Markup{render::figure_html(fmt::format("Draw {}.", f.seed), plot_svg(bus)) + render::figure_html("", plot_svg(error))});
  }
  return s;
}

render::Section gain_section(const std::vector<GainPoint>& gains) {
  render::Section s{.title = "Response to small sines", .id = "chirp"};
  s.blocks.push_back(render::Paragraph{
      "True speed over the speed asked for, ± 1.1 % around half of the highest speed, of the draw with the lowest -3 dB."});
  render::Plot p;
  p.title = "gain of the closed loop";
  p.x_label = "frequency, Hz";
  p.y_label = "gain";
  p.log_x = true;
  p.y_min = 0.0;
  render::Series series{"gain", {}, {}, kSpeed};
  for (const GainPoint& g : gains) {
    series.x.push_back(g.frequency_Hz);
    series.y.push_back(g.gain);
  }
  p.series.push_back(std::move(series));
  p.marks.push_back({kMinus3dB, "−3 dB"});
  s.blocks.push_back(render::Markup{render::figure_html("", plot_svg(p))});
  return s;
}

render::Section commission_section(const std::vector<LabFigures::Quantity>& quantities) {
  render::Section s{.title = "Commissioning", .id = "commission"};
  s.blocks.push_back(render::Paragraph{
      "Error of each quantity that the ESC measured itself, as a share of its limit: the mean over the draws, and each of them."});
  render::BarChart chart;
  chart.title = "commissioning errors over their limits";
  chart.x_label = "error over its limit";
  for (const LabFigures::Quantity& q : quantities) {
    render::Bar bar;
    bar.label = fmt::format("{} (limit {:.3g}{}{})", q.name, q.limit, q.unit.empty() ? "" : " ", q.unit);
    bar.colour = kSpeed;
    for (const double e : q.errors) {
      bar.points.push_back(e / q.limit);
      bar.value += e / q.limit / static_cast<double>(q.errors.size());
    }
    chart.bars.push_back(std::move(bar));
  }
  chart.limit = 1.0;
  chart.limit_label = "limit";
  s.blocks.push_back(render::Markup{render::figure_html("", bar_chart_svg(chart))});
  return s;
}

render::Section fault_section(const LabFigures& f) {
  render::Section s{.title = "Schedules of faults", .id = "fault"};
  s.blocks.push_back(
      render::Paragraph{"One or two things break at random times, for a while or for good; in half of the schedules the set-point falls "
                        "silent. What is judged is that nothing is "
                        "driven without a fresh set-point and that nothing stays dead without a reason; a trip or a latch is what the ESC "
                        "should do. A shorted FET no firmware can save."});
  render::Table t;
  t.columns = {render::left("what broke"), {"schedules"}, {"with a trip"}, {"latched at the end"}, {"failed"}};
  for (const auto& c : f.fault_counts) {
    render::Row row;
    row.cells = {c.kind, std::to_string(c.flown), std::to_string(c.tripped), std::to_string(c.latched),
                 render::Cell(std::to_string(c.failed), c.failed > 0 ? "fail" : "")};
    t.rows.push_back(std::move(row));
  }
  s.blocks.push_back(std::move(t));
  for (const Traced& traced : f.faults)
    s.blocks.push_back(render::Markup{traced_html(traced, fmt::format("Schedule {}: {}.", traced.seed, traced.what))});
  return s;
}

}  // namespace

render::Sections figure_sections(const LabResult& r) {
  const LabFigures& f = r.figures;
  render::Sections out;
  if (!f.steps.empty())
    out.push_back(traced_section(
        "Step", "step",
        "40 to 60 % of the highest speed that the draw holds, with commissioned parameters; best is what current and voltage limits allow.",
        f.steps));
  if (!f.gains.empty()) out.push_back(gain_section(f.gains));
  if (!f.starts.empty())
    out.push_back(traced_section("Start and random steps", "start",
                                 "From power-up with data-sheet parameters, then 4 s of steps between 15 and 95 % of the highest speed.",
                                 f.starts));
  if (!f.catches.empty())
    out.push_back(traced_section("Catch", "catch",
                                 "The rotor turns already when the set-point comes; the share of the highest speed stands with the draw.",
                                 f.catches));
  if (!f.sags.empty()) out.push_back(sag_section(f.sags));
  if (!f.commissioned.empty()) out.push_back(commission_section(f.commissioned));
  if (!f.fault_counts.empty()) out.push_back(fault_section(f));
  return out;
}

}  // namespace rotorloop::esc_lab
