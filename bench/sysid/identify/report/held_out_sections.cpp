#include "bench/sysid/identify/report/held_out_sections.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::identify {
namespace {

using Json = nlohmann::ordered_json;
using render::Cell;
using render::figure_text;
using render::left;

constexpr std::array kAxes{"force x", "force y", "force z", "torque x", "torque y", "torque z"};

std::string name_of(const Json& row) {
  std::string out = row.at("quantity");
  std::replace(out.begin(), out.end(), '_', ' ');
  return out;
}
Cell figure_cell(const Json& of, const char* key, const char* format = "{:.3g}", const char* kind = "") {
  return {figure_text(value_of(of.at(key)), format), kind};
}
Cell unit_cell(const Json& row) { return row.at("unit").get<std::string>(); }

std::string ratio_text(double v) { return figure_text(std::fabs(v) < 0.005 ? 0.0 : v, "{:.2f}"); }  // no minus before a nil
std::string interval(const Json& of, const char* low, const char* high) {
  return ratio_text(value_of(of.at(low))) + " … " + ratio_text(value_of(of.at(high)));
}

// Green or red is a difference that the interval distinguishes from none and that is worth a colour.
Cell ratio_cell(const Json& row) {
  constexpr double kWorthColour = 0.02;
  const double v = value_of(row.at("ratio"));
  const bool better =
      value_of(row.at("high")) < 1.0 && v<1.0 - kWorthColour, worse = value_of(row.at("low"))> 1.0 && v > 1.0 + kWorthColour;
  return {ratio_text(v), better ? "pass" : worse ? "fail" : ""};
}

// Error over horizon: both models and the floor.
std::string horizon_figure(const Json& rows, const std::string& quantity) {
  render::Plot p;
  p.x_label = "prediction horizon, s";
  p.width_px = 500;
  p.log_x = p.log_y = true;
  p.series = {{.label = "before", .x = {}, .y = {}, .colour = 1},
              {.label = "identified", .x = {}, .y = {}, .colour = 0, .width_px = 2.5},
              {.label = "floor", .x = {}, .y = {}, .colour = render::kNeutral, .dashed = true}};
  for (const Json& row : rows) {
    if (name_of(row) != quantity) continue;
    p.y_label = fmt::format("mean error, {}", row.at("unit").get<std::string>());
    constexpr const char* kLines[] = {"before", "after", "floor"};
    for (std::size_t i = 0; i < p.series.size(); ++i) {
      p.series[i].x.push_back(row.at("horizon_s"));
      p.series[i].y.push_back(value_of(row.at(kLines[i])));
    }
  }
  p.title = fmt::format("error of {} over horizon", quantity);
  return render::figure_html(fmt::format("<b>{}</b>", quantity), render::plot_svg(p));
}

render::Section one_step_section(const Json& s) {
  render::Section out{"One step", "", {}};
  out.blocks.push_back(render::Paragraph{fmt::format("Each of {} poses from the measurements before it, states every {:g} s.",
                                                     s.at("poses").get<std::size_t>(), s.at("step_s").get<double>())});
  out.blocks.push_back(
      render::Paragraph{"Expected: what the identified model errs if it and its noise figures are right. Size: root mean square of the "
                        "errors in units of what "
                        "each model expects of itself; 1 when model and noise figures are right, above it lies what they lack. Log "
                        "likelihood: mean of a pose, "
                        "natural logarithm, m and rad; the larger one predicts better. Each model has the noise figures found for it.",
                        render::On::page});
  render::Table errors{{left("error of"), {"before"}, {"identified"}, left("unit"), {"ratio"}, {"95 %"}, {"expected"}}};
  for (const Json& r : s.at("rows"))
    errors.rows.push_back({{name_of(r), figure_cell(r, "before"), figure_cell(r, "after", "{:.3g}", "big"), unit_cell(r), ratio_cell(r),
                            interval(r, "low", "high"), figure_cell(r, "expected")}});
  const Json &size = s.at("size"), &likelihood = s.at("log_likelihood");
  const char* kind = value_of(likelihood.at("low")) > 0.0 ? "pass" : value_of(likelihood.at("high")) < 0.0 ? "fail" : "";
  render::Table poses{{left("of a pose"), {"before"}, {"identified"}, {"gain"}, {"95 %"}}};
  poses.rows = {
      {{"size", figure_cell(size, "before", "{:.3f}"), figure_cell(size, "after", "{:.3f}", "big"), "", ""}},
      {{"log likelihood", figure_cell(likelihood, "before", "{:.3f}"), figure_cell(likelihood, "after", "{:.3f}", "big"),
        figure_cell(likelihood, "gain", "{:+.3f}", kind),
        figure_text(value_of(likelihood.at("low")), "{:+.3f}") + " … " + figure_text(value_of(likelihood.at("high")), "{:+.3f}")}}};
  out.blocks.insert(out.blocks.end(), {errors, poses});
  return out;
}

std::string band_text(double from_Hz, double to_Hz) {
  if (from_Hz <= 0.0) return to_Hz > 0.0 ? fmt::format("below {:g} Hz", to_Hz) : "at all frequencies";
  return to_Hz > 0.0 ? fmt::format("{:g} to {:g} Hz", from_Hz, to_Hz) : fmt::format("above {:g} Hz", from_Hz);
}

double length(const Json& score, std::size_t first) {
  double sum = 0.0;
  for (std::size_t i = first; i < first + 3; ++i) sum += std::pow(value_of(score.at("rms")[i]), 2);
  return std::sqrt(sum);
}

}  // namespace

render::Sections wrench_sections(const Json& c) {
  const Json &before = c.at("before"), &after = c.at("after");
  const bool force = c.at("force"), torque = c.at("torque");
  render::Section out{"Force and torque, " + band_text(c.at("from_Hz"), c.at("to_Hz")), "", {}};
  out.blocks.push_back(render::Paragraph{
      "What accelerometer and gyro of these flights show, times mass and inertia of the vehicle file, against what the model predicts; "
      "both "
      "through the same filters. Aligned: the measurements of each flight moved by the delay at which the model explains most torque.",
      render::On::page});
  render::Table t{{left("axis"), {"rms before"}, {"after"}, left("unit"), {"explained before"}, {"after"}, {"aligned before"}, {"after"}}};
  const auto last = [&](const char* list, const char* what, std::size_t i, const char* format) {
    return figure_text(value_of(c.at(list).back().at(what)[i]), format);
  };
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    if (!(i < 3 ? force : torque)) continue;
    t.rows.push_back({{kAxes[i], last("before", "rms", i, "{:.4g}"), Cell{last("after", "rms", i, "{:.4g}"), "big"}, i < 3 ? "N" : "N m",
                       last("before", "explained", i, "{:.3f}"), last("after", "explained", i, "{:.3f}"),
                       last("before_aligned", "explained", i, "{:.3f}"), last("after_aligned", "explained", i, "{:.3f}")}});
  }
  render::List flights;
  for (std::size_t i = 0; i < after.size(); ++i) {
    std::vector<std::string> parts;
    if (force) parts.push_back(fmt::format("force {:.4g} → {:.4g} N", length(before[i], 0), length(after[i], 0)));
    if (torque) parts.push_back(fmt::format("torque {:.4g} → {:.4g} N m", length(before[i], 3), length(after[i], 3)));
    if (torque && i + 1 < after.size())
      parts.push_back(fmt::format("measurements {:+.1f} ms late", 1e3 * value_of(c.at("after_aligned")[i].at("delay_s"))));
    flights.items.push_back(fmt::format("{}: {} ({} samples)", after[i].at("flight").get<std::string>(), fmt::join(parts, ", "),
                                        after[i].at("samples").get<std::size_t>()));
  }
  out.blocks.insert(out.blocks.end(), {t, flights});
  return {out};
}

render::Sections held_out_sections(const Json& s) {
  const double helps_to_s = s.at("rotation_helps").at("to_s");
  render::Section out{"Validation flights (held out)", "held-out", {}};
  out.blocks.push_back(render::Paragraph{fmt::format(
      "{}; {} starts, open loop with the logged rotor speeds from the same smoothed states. The rotation model beats held rates {}.",
      fmt::join(s.at("flights").get<std::vector<std::string>>(), ", "), s.at("starts").get<std::size_t>(),
      helps_to_s > 0.0 ? fmt::format("from {:.2f} to {:.2f} s", s.at("rotation_helps").at("from_s").get<double>(), helps_to_s)
                       : "nowhere")});
  out.blocks.push_back(render::Paragraph{
      "Before: the vehicle file; identified: the model of this fit. Floor: what the noise of measurements and motion alone would give a "
      "model that is exactly right; an error at the floor says nothing about the model. Closed: share of the gap between the error before "
      "and that floor.",
      render::On::page});
  out.blocks.push_back(render::List{s.at("remarks").get<std::vector<std::string>>()});
  render::Table t{
      {left("error of"), {"horizon, s"}, {"before"}, {"identified"}, left("unit"), {"ratio"}, {"95 %"}, {"floor"}, {"closed"}, {"95 %"}}};
  std::vector<std::string> drawn;
  for (const Json& r : s.at("rows")) {
    const std::string name = name_of(r);
    const bool first = drawn.empty() || drawn.back() != name, gap = !r.at("closed").is_null();
    if (first) drawn.push_back(name);
    t.rows.push_back(
        {{first ? name : "", figure_cell(r, "horizon_s", "{:.3f}"), figure_cell(r, "before"), figure_cell(r, "after", "{:.3g}", "big"),
          unit_cell(r), ratio_cell(r), interval(r, "low", "high"), figure_cell(r, "floor"),
          gap ? ratio_text(value_of(r.at("closed"))) : "no gap", gap ? interval(r, "closed_low", "closed_high") : ""},
         first});
  }
  std::string drawings;
  for (const std::string& quantity : drawn) drawings += horizon_figure(s.at("rows"), quantity);
  out.blocks.insert(out.blocks.end(), {render::Markup{"<div class=\"two\">" + drawings + "</div>\n"}, t});
  render::Sections all{out};
  if (!s.at("one_step").is_null()) all.push_back(one_step_section(s.at("one_step")));
  if (s.contains("wrench")) all.push_back(wrench_sections(s.at("wrench")).front());
  return all;
}

std::string held_out_table(const HeldOutScores& s) { return render::terminal_text(held_out_sections(held_out_json(s))); }
std::string held_out_html(const HeldOutScores& s) { return render::page_html(held_out_sections(held_out_json(s))); }

}  // namespace rotorloop::identify
