#include "bench/render/zoom_plot.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "bench/render/page.hpp"
#include "bench/render/zoom_assets.hpp"

namespace rotorloop::render {
namespace {

// JSON within a script element: no "<", so that nothing in a label can end the element.
std::string json(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\' || c == '<' || static_cast<unsigned char>(c) < 0x20)
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      out += c;
  }
  return out + "\"";
}

// Every sample, in as many digits as a zoomed axis needs; a gap is null.
std::string json(const std::vector<double>& values) {
  std::string out = "[";
  for (const double v : values) {
    if (out.size() > 1) out += ',';
    if (std::isfinite(v))
      fmt::format_to(std::back_inserter(out), "{:.7g}", v);
    else
      out += "null";
  }
  return out + "]";
}

std::string values_json(const Plot& p) {
  std::string out = fmt::format("{{\"x\":{},\"y\":{},\"series\":[", json(p.x_label), json(p.y_label));
  for (const Series& s : p.series)
    out += fmt::format("{}{{\"label\":{},\"colour\":{},\"dashed\":{},\"x\":{},\"y\":{}}}", &s == p.series.data() ? "" : ",", json(s.label),
                       s.colour, s.dashed, json(s.x), json(s.y));
  return out + "]}";
}

}  // namespace

std::string zoom_figures_html(const std::vector<Plot>& plots) {
  std::string out =
      "<div class=\"zoom\">\n<p class=\"cap zoom-how\" hidden>Drag over a plot to zoom, double click to see all; on a screen that is "
      "touched two fingers zoom, one moves, two taps show all. The values under the cursor stand below each plot.</p>\n";
  for (const Plot& p : plots)
    out += figure_html(xml_escaped(p.title), plot_svg(p) + "<script type=\"application/json\">" + values_json(p) + "</script>\n");
  return out + "</div>\n";
}

std::string zoom_script_html() {
  std::string out = "<!-- uPlot 1.6.32, copyright (c) 2022 Leon Sorokin, MIT licence -->\n<style>\n";
  out.append(kUplotStyle).append(kZoomStyle).append("</style>\n<script>\n");
  return out.append(kUplotScript).append("</script>\n<script>\n").append(kZoomScript).append("</script>\n");
}

}  // namespace rotorloop::render
