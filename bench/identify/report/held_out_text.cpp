#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/identify/held_out.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::identify {
namespace {

using nlohmann::ordered_json;

constexpr const char* kQuantityNames[] = {"position", "velocity", "attitude", "body rates"};
constexpr const char* kQuantityIds[] = {"position", "velocity", "attitude", "body_rates"};

// A ratio of errors that are both nil (one step without excitation) is none; a bound may lie anywhere.
std::string ratio_text(double v) {
  if (std::isinf(v)) return v > 0.0 ? "∞" : "-∞";
  if (std::isfinite(v)) return fmt::format("{:.2f}", std::fabs(v) < 0.005 ? 0.0 : v);  // no minus before a nil
  return "–";
}

// Of a gap that is there.
std::string closed_text(const score::ErrorRatio& r) {
  if (!std::isfinite(r.value)) return "– (no gap)";
  return fmt::format("{} ({} to {})", ratio_text(r.value), ratio_text(r.low), ratio_text(r.high));
}

std::string rotation_text(const HeldOutScores& s) {
  if (s.rotation_helps.to_s <= 0.0) return "the rotation model beats held rates nowhere";
  return fmt::format("the rotation model beats held rates from {:.2f} to {:.2f} s", s.rotation_helps.from_s, s.rotation_helps.to_s);
}

std::string one_step_table(const score::OneStepComparison& s) {
  if (s.poses == 0) return "";
  std::string out = fmt::format(
      "  One step: each of {} poses from the readings before it, states every {:g} s. Expected: the error of the identified model if it "
      "and its noise figures are right\n",
      s.poses, s.step_s);
  for (const score::OneStepComparison::Row& r : s.rows)
    out += fmt::format("  {:<10} one step {:9.3g} -> {:9.3g} {:<5}  {:>5} ({} to {})  expected {:7.3g}\n", kQuantityNames[r.quantity],
                       r.before, r.after, score::kPredictedUnits[r.quantity], ratio_text(r.ratio.value), ratio_text(r.ratio.low),
                       ratio_text(r.ratio.high), r.expected);
  return out + fmt::format(
                   "  size {:.3f} -> {:.3f} of the expected (rms; 1: model and noise are right); log likelihood of a pose {:.3f} -> "
                   "{:.3f}, gain {:+.3f} ({:+.3f} to {:+.3f})\n",
                   s.size_before, s.size_after, s.log_density_before, s.log_density_after, s.gain.value, s.gain.low, s.gain.high);
}

}  // namespace

std::string held_out_table(const HeldOutScores& s) {
  std::string out = fmt::format(
      "Held out: {} ({} starts, open loop). Mean error before -> after, ratio with 95 % interval; floor: what noise alone would give a "
      "model that is right; share of the gap down to it that is closed:\n",
      fmt::join(s.flights, ", "), s.starts);
  for (const HeldOutRow& r : s.rows)
    out += fmt::format("  {:<10} {:5.3f} s  {:9.3g} -> {:9.3g} {:<5}  {:>5} ({} to {})  floor {:9.3g}  closed {}\n",
                       kQuantityNames[r.quantity], r.horizon_s, r.before, r.after, score::kPredictedUnits[r.quantity], ratio_text(r.ratio.value),
                       ratio_text(r.ratio.low), ratio_text(r.ratio.high), r.floor, closed_text(r.closed));
  out += "  " + rotation_text(s) + "\n" + one_step_table(s.one_step);
  for (const std::string& remark : s.remarks) out += "  " + remark + "\n";
  return out + wrench_table(s.wrench);
}

namespace {

// With the minus sign of a book.
std::string typeset(std::string text) {
  for (std::size_t at = text.find('-'); at != std::string::npos; at = text.find('-', at + 3)) text.replace(at, 1, "−");
  return text;
}
std::string cell(const std::string& text, const char* kind = "") { return fmt::format("<td{}>{}</td>", kind, typeset(text)); }
std::string three(double v) { return std::isfinite(v) ? fmt::format("{:.3g}", v) : "–"; }

// Green or red is a difference that the interval tells from none and that is worth a colour.
constexpr double kWorthColour = 0.02;
std::string ratio_cells(const score::ErrorRatio& r) {
  const char* kind = r.high < 1.0 && r.value < 1.0 - kWorthColour ? " class=\"pass\"" : "";
  if (r.low > 1.0 && r.value > 1.0 + kWorthColour) kind = " class=\"fail\"";
  return cell(ratio_text(r.value), kind) + cell(ratio_text(r.low) + " … " + ratio_text(r.high));
}

constexpr const char* kTableEnd = "</tbody></table></div>\n";

std::string one_step_html(const score::OneStepComparison& s) {
  if (s.poses == 0) return "";
  std::string out = fmt::format(
      "<h3 id=\"one-step\">One step</h3>\n<p>Each of {} poses from the readings before it alone, states every {:g} s. Expected: what the "
      "identified model errs if it and its noise figures are right. Size: root mean square of the errors in units of what each model "
      "expects of itself; 1 when model and noise figures are right, above it lies what they lack. Log likelihood: mean of a pose, natural "
      "logarithm, m and rad; the larger one foretells better. Each model has the noise figures found for it.</p>\n"
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">error of</th><th>before</th><th>identified</th><th class=\"l\">unit</th>"
      "<th>ratio</th><th>95 %</th><th>expected</th></tr></thead><tbody>\n",
      s.poses, s.step_s);
  for (const score::OneStepComparison::Row& r : s.rows)
    out += "<tr>" + cell(kQuantityNames[r.quantity], " class=\"l\"") + cell(three(r.before)) + cell(three(r.after), " class=\"big\"") +
           cell(score::kPredictedUnits[r.quantity], " class=\"l\"") + ratio_cells(r.ratio) + cell(three(r.expected)) + "</tr>\n";
  out += kTableEnd;
  out +=
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">of a pose</th><th>before</th><th>identified</th><th>gain</th><th>95 "
      "%</th></tr></thead><tbody>\n";
  out += "<tr>" + cell("size", " class=\"l\"") + cell(fmt::format("{:.3f}", s.size_before)) +
         cell(fmt::format("{:.3f}", s.size_after), " class=\"big\"") + cell("") + cell("") + "</tr>\n";
  out += "<tr>" + cell("log likelihood", " class=\"l\"") + cell(fmt::format("{:.3f}", s.log_density_before)) +
         cell(fmt::format("{:.3f}", s.log_density_after), " class=\"big\"") +
         cell(fmt::format("{:+.3f}", s.gain.value), s.gain.low > 0.0    ? " class=\"pass\""
                                                    : s.gain.high < 0.0 ? " class=\"fail\""
                                                                        : "") +
         cell(fmt::format("{:+.3f} … {:+.3f}", s.gain.low, s.gain.high)) + "</tr>\n";
  return out + kTableEnd;
}

// Error over horizon: both models and the floor.
std::string horizon_figure(const HeldOutScores& s, std::size_t quantity) {
  render::Plot p;
  p.title = fmt::format("error of {} over horizon", kQuantityNames[quantity]);
  p.x_label = "foretold ahead, s";
  p.y_label = fmt::format("mean error, {}", score::kPredictedUnits[quantity]);
  p.width_px = 500;
  p.log_x = p.log_y = true;
  p.series = {{.label = "before", .x = {}, .y = {}, .colour = 1},
              {.label = "identified", .x = {}, .y = {}, .colour = 0, .width_px = 2.5},
              {.label = "floor", .x = {}, .y = {}, .colour = render::kNeutral, .dashed = true}};
  for (const HeldOutRow& r : s.rows) {
    if (r.quantity != quantity) continue;
    for (render::Series& line : p.series) line.x.push_back(r.horizon_s);
    p.series[0].y.push_back(r.before);
    p.series[1].y.push_back(r.after);
    p.series[2].y.push_back(r.floor);
  }
  return render::figure_html(fmt::format("<b>{}</b>", kQuantityNames[quantity]), render::plot_svg(p));
}

}  // namespace

std::string held_out_html(const HeldOutScores& s) {
  std::string helps = rotation_text(s);
  helps.front() = 'T';
  std::string out = fmt::format(
      "<h2 id=\"held-out\">Flights that had no part in the fit</h2>\n<p>{}; {} starts, open loop with the logged rotor speeds from the "
      "same smoothed states. Before: the vehicle file; identified: the model of this fit. Floor: what the noise of readings and motion "
      "alone would give a model that is exactly right; an error at the floor tells nothing about the model. Closed: share of the gap "
      "between the error before and that floor. {}.</p>\n",
      render::xml_escaped(fmt::format("{}", fmt::join(s.flights, ", "))), s.starts, helps);
  if (!s.remarks.empty()) {
    out += "<ul>";
    for (const std::string& remark : s.remarks) out += "<li>" + render::xml_escaped(remark) + "</li>";
    out += "</ul>\n";
  }
  for (std::size_t q = 0; q < score::kPredictedQuantities; q += 2)
    out += "<div class=\"two\">" + horizon_figure(s, q) + horizon_figure(s, q + 1) + "</div>\n";
  out +=
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">error of</th><th>after, s</th><th>before</th><th>identified</th><th "
      "class=\"l\">unit</th><th>ratio</th><th>95 %</th><th>floor</th><th>closed</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < s.rows.size(); ++i) {
    const HeldOutRow& r = s.rows[i];
    const bool first = i == 0 || s.rows[i - 1].quantity != r.quantity;
    out += fmt::format("<tr{}>", first ? " class=\"first\"" : "") + cell(first ? kQuantityNames[r.quantity] : "", " class=\"l\"") +
           cell(fmt::format("{:.3f}", r.horizon_s)) + cell(three(r.before)) + cell(three(r.after), " class=\"big\"") +
           cell(score::kPredictedUnits[r.quantity], " class=\"l\"") + ratio_cells(r.ratio) + cell(three(r.floor)) + cell(closed_text(r.closed)) +
           "</tr>\n";
  }
  return out + kTableEnd + one_step_html(s.one_step) + wrench_html(s.wrench);
}

namespace {

ordered_json number(double v) { return std::isfinite(v) ? ordered_json(v) : ordered_json(nullptr); }

ordered_json one_step_json(const score::OneStepComparison& s) {
  if (s.poses == 0) return nullptr;
  ordered_json rows = ordered_json::array();
  for (const score::OneStepComparison::Row& r : s.rows)
    rows.push_back({{"quantity", kQuantityIds[r.quantity]},
                    {"unit", score::kPredictedUnits[r.quantity]},
                    {"before", number(r.before)},
                    {"after", number(r.after)},
                    {"expected", number(r.expected)},
                    {"ratio", number(r.ratio.value)},
                    {"low", number(r.ratio.low)},
                    {"high", number(r.ratio.high)}});
  return {{"poses", s.poses},
          {"step_s", s.step_s},
          {"rows", rows},
          {"size", {{"before", number(s.size_before)}, {"after", number(s.size_after)}}},
          {"log_likelihood",
           {{"before", number(s.log_density_before)},
            {"after", number(s.log_density_after)},
            {"gain", number(s.gain.value)},
            {"low", number(s.gain.low)},
            {"high", number(s.gain.high)}}}};
}

}  // namespace

ordered_json held_out_json(const HeldOutScores& s) {
  ordered_json rows = ordered_json::array();
  for (const HeldOutRow& r : s.rows)
    rows.push_back({{"horizon_s", r.horizon_s},
                    {"quantity", kQuantityIds[r.quantity]},
                    {"unit", score::kPredictedUnits[r.quantity]},
                    {"before", number(r.before)},
                    {"after", number(r.after)},
                    {"floor", number(r.floor)},
                    {"closed", number(r.closed.value)},
                    {"closed_low", number(r.closed.low)},
                    {"closed_high", number(r.closed.high)},
                    {"ratio", number(r.ratio.value)},
                    {"low", number(r.ratio.low)},
                    {"high", number(r.ratio.high)}});
  return {{"flights", s.flights}, {"starts", s.starts}, {"rows", rows}, {"one_step", one_step_json(s.one_step)}, {"remarks", s.remarks}};
}

}  // namespace rotorloop::identify
