#include "bench/render/disk_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "bench/render/svg_pieces.hpp"

namespace rotorloop::render {
namespace {

constexpr int kShades = 96;        // more are indistinguishable, and cells of one shade share a path
constexpr double kMargin_px = 46;  // around the disk: arrows and words
constexpr double kScale_px = 16, kScaleRoom_px = 96;
constexpr double kNarrow_px = 1.0;
constexpr double kPi = std::numbers::pi;

struct Scale {
  double low = 0, high = 1;
  bool cut_low = false, cut_high = false;  // data lie beyond
  double share(double v) const { return std::clamp((v - low) / (high - low), 0.0, 1.0); }
  int shade(double v) const { return std::min(kShades - 1, static_cast<int>(share(v) * kShades)); }
};

Scale scale_of(const DiskMap& m) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const double v : m.values)
    if (std::isfinite(v)) {
      low = std::min(low, v);
      high = std::max(high, v);
    }
  if (!(low <= high)) {
    low = 0;
    high = 1;
  }
  Scale s{m.low.value_or(low), m.high.value_or(high)};
  s.cut_low = low < s.low;
  s.cut_high = high > s.high;
  // A field that is the same everywhere still gets a scale to be read from.
  const double least = 1e-6 * std::max({std::fabs(s.low), std::fabs(s.high), 1e-6});
  if (!(s.high - s.low > least)) {
    s.low -= least;
    s.high += least;
  }
  return s;
}

std::string css(Rgb c) { return fmt::format("#{:02x}{:02x}{:02x}", c.r, c.g, c.b); }
std::string shade_colour(int shade) { return css(field_colour((shade + 0.5) / kShades)); }

// From metres and an azimuth to the page.
struct View {
  double centre_x, centre_y, px_per_m;
  double x(double r_m, double azimuth) const { return centre_x - px_per_m * r_m * std::sin(azimuth); }
  double y(double r_m, double azimuth) const { return centre_y - px_per_m * r_m * std::cos(azimuth); }
  std::string at(double r_m, double azimuth) const { return px(x(r_m, azimuth)) + " " + px(y(r_m, azimuth)); }
};

// A path in steps from point to point: a page holds thousands of cells, and steps are shorter to write than places. Places are
// rounded first, so that no rounding error adds up.
class Pen {
 public:
  explicit Pen(const View& view) : view_(view) {}
  void move(double r_m, double azimuth) {
    go(r_m, azimuth);
    d_ += "M" + px(x_) + " " + px(y_);
  }
  void line(double r_m, double azimuth) { d_ += "l" + step(r_m, azimuth); }
  // Along the ring; azimuth rises counter-clockwise on the page, sweep flag 0 in SVG. The chord is drawn where it is indistinguishable from
  // the arc.
  void arc(double r_m, double from, double to) {
    constexpr double kSagitta_px = 0.15;
    const double radius_px = r_m * view_.px_per_m, turn = to - from;
    if (radius_px * (1 - std::cos(turn / 2)) < kSagitta_px) return line(r_m, to);
    d_ += fmt::format("a{0} {0} 0 {1} {2} {3}", px(radius_px), std::fabs(turn) > kPi ? 1 : 0, turn > 0 ? 0 : 1, step(r_m, to));
  }
  std::string closed() const { return d_ + "z"; }

 private:
  void go(double r_m, double azimuth) {
    x_ = std::round(10 * view_.x(r_m, azimuth)) / 10;
    y_ = std::round(10 * view_.y(r_m, azimuth)) / 10;
  }
  std::string step(double r_m, double azimuth) {
    const double x = x_, y = y_;
    go(r_m, azimuth);
    return px(x_ - x) + " " + px(y_ - y);
  }
  View view_;
  double x_ = 0, y_ = 0;
  std::string d_;
};

std::string cell_path(const View& view, double r0, double r1, double from, double to) {
  Pen pen(view);
  pen.move(r0, from);
  pen.line(r1, from);
  pen.arc(r1, from, to);
  pen.line(r0, to);
  pen.arc(r0, to, from);
  return pen.closed();
}

std::string cells_svg(const DiskMap& m, const View& view, const Scale& scale) {
  std::map<int, std::string> paths;  // of each shade
  const double wide = 2 * kPi / m.sectors;
  const auto n = static_cast<std::size_t>(m.sectors);
  for (std::size_t ring = 0; ring + 1 < m.ring_edges_m.size(); ++ring) {
    const auto shade = [&](std::size_t k) {
      const double v = m.values[ring * n + k];
      return std::isfinite(v) ? scale.shade(v) : -1;
    };
    for (std::size_t k = 0; k < n;) {
      std::size_t end = k + 1;  // neighbours of one shade are drawn as one, up to half a turn: an arc must not close on itself
      while (end < n && shade(end) == shade(k) && end - k < n / 2) ++end;
      if (shade(k) >= 0)
        paths[shade(k)] +=
            cell_path(view, m.ring_edges_m[ring], m.ring_edges_m[ring + 1], static_cast<double>(k) * wide, static_cast<double>(end) * wide);
      k = end;
    }
  }
  std::string out;
  // The thin outline in the cell's own colour closes the seams that antialiasing leaves between neighbours.
  for (const auto& [shade, d] : paths)
    out += fmt::format("<path fill=\"{0}\" stroke=\"{0}\" stroke-width=\"1.2\" d=\"{1}\"/>\n", shade_colour(shade), d);
  return out;
}

// Cell edges across which the field changes its sign; not in rings too narrow to be seen, of which solvers put many at the tip.
std::string zero_line_svg(const DiskMap& m, const View& view) {
  std::string d;
  const double wide = 2 * kPi / m.sectors;
  const auto n = static_cast<std::size_t>(m.sectors);
  const std::size_t rings = m.ring_edges_m.size() - 1;
  const auto differ = [&](std::size_t a, std::size_t b) {
    const double va = m.values[a], vb = m.values[b];
    return std::isfinite(va) && std::isfinite(vb) && (va < 0) != (vb < 0);
  };
  const auto visible = [&](std::size_t ring) {
    return ring < rings && (m.ring_edges_m[ring + 1] - m.ring_edges_m[ring]) * view.px_per_m > kNarrow_px;
  };
  for (std::size_t ring = 0; ring < rings; ++ring)
    for (std::size_t k = 0; visible(ring) && k < n; ++k) {
      const double from = static_cast<double>(k) * wide, to = from + wide;
      const double r0 = m.ring_edges_m[ring], r1 = m.ring_edges_m[ring + 1];
      if (differ(ring * n + k, ring * n + (k + 1) % n)) d += "M" + view.at(r0, to) + "L" + view.at(r1, to);
      if (visible(ring + 1) && differ(ring * n + k, (ring + 1) * n + k)) d += "M" + view.at(r1, from) + "L" + view.at(r1, to);
    }
  return d.empty() ? "" : "<path class=\"zr\" d=\"" + d + "\"/>\n";
}

std::string arrow_head(double x, double y, double dx, double dy) {  // tip at (x, y), pointing along the unit vector (dx, dy)
  const double back = 9, half = 4.5;
  return fmt::format("<path class=\"hd\" d=\"M{} {}L{} {}L{} {}Z\"/>", px(x), px(y), px(x - back * dx - half * dy),
                     px(y - back * dy + half * dx), px(x - back * dx + half * dy), px(y - back * dy - half * dx));
}

// Three parallel arrows at the upstream rim.
std::string wind_svg(const DiskMap& m, const View& view, double radius_m) {
  if (!m.wind_from_rad) return "";
  const double out_x = -std::sin(*m.wind_from_rad), out_y = -std::cos(*m.wind_from_rad);  // towards the wind, on the page
  const double rim = radius_m * view.px_per_m + 8;
  std::string svg;
  for (const int side : {-1, 0, 1}) {
    const double across = side * 16.0, tip_x = view.centre_x + rim * out_x - across * out_y,
                 tip_y = view.centre_y + rim * out_y + across * out_x;
    svg += fmt::format("<path class=\"wd\" d=\"M{} {}L{} {}\"/>", px(tip_x + 26 * out_x), px(tip_y + 26 * out_y), px(tip_x + 6 * out_x),
                       px(tip_y + 6 * out_y)) +
           arrow_head(tip_x, tip_y, -out_x, -out_y);
  }
  // Beside the arrows, on the side that has room.
  const double side = 26;
  svg +=
      fmt::format("<text class=\"lb\" x=\"{}\" y=\"{}\">wind {}</text>\n", px(view.centre_x + (rim + 17) * out_x + side * std::fabs(out_y)),
                  px(view.centre_y + (rim + 17) * out_y + 4 - side * std::fabs(out_x)), xml_escaped(m.wind_label));
  return svg;
}

// An arc outside the disk, at the rear left, with its head in the sense of rotation.
std::string spin_svg(const DiskMap& m, const View& view, double radius_m) {
  if (m.spin == 0) return "";
  const double middle = 0.75 * kPi, half = 0.16 * kPi, r = radius_m + 11 / view.px_per_m;
  const double from = middle - m.spin * half, to = middle + m.spin * half, r_px = r * view.px_per_m;
  // Tangent at the head: azimuth rises to the left of forward.
  const double dx = -m.spin * std::cos(to), dy = m.spin * std::sin(to);
  const double x = view.x(r, to), y = view.y(r, to);
  return fmt::format("<path class=\"wd\" d=\"M{}A{} {} 0 0 {} {}\"/>", view.at(r, from), px(r_px), px(r_px), m.spin > 0 ? 0 : 1,
                     view.at(r, to)) +
         arrow_head(x + 6 * dx, y + 6 * dy, dx, dy) +
         fmt::format("<text class=\"tk\" x=\"{}\" y=\"{}\" text-anchor=\"end\">rotation</text>\n", px(view.x(r, middle) - 8),
                     px(view.y(r, middle) + 14));
}

std::string colour_bar_svg(const DiskMap& m, const Scale& scale, double left, double top, double bottom) {
  std::string out;
  const double step = (bottom - top) / kShades;
  for (int i = 0; i < kShades; ++i)  // overlapping upwards, again against seams
    out += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>", px(left), px(bottom - (i + 1) * step),
                       px(kScale_px), px(i == 0 ? step : step + 0.6), shade_colour(i));
  out += '\n';
  const auto end = [&](double y, double to, int shade) {
    out += fmt::format("<path fill=\"{}\" d=\"M{} {}h{}L{} {}Z\"/>\n", shade_colour(shade), px(left), px(y), px(kScale_px),
                       px(left + kScale_px / 2), px(to));
  };
  if (scale.cut_low) end(bottom + 1, bottom + 11, 0);
  if (scale.cut_high) end(top - 1, top - 11, kShades - 1);
  const Ticks ticks = nice_ticks(scale.low, scale.high, 6);
  double widest = 0;
  for (const double t : ticks.at) {
    const double y = bottom - (t - scale.low) / (scale.high - scale.low) * (bottom - top);
    const std::string text = tick_text(t, ticks.decimals);
    widest = std::max(widest, text_px(text));
    out += fmt::format("<path class=\"ax\" d=\"M{} {}h5\"/><text class=\"tk\" x=\"{}\" y=\"{}\">{}</text>\n", px(left + kScale_px), px(y),
                       px(left + kScale_px + 8), px(y + 4), text);
  }
  out += fmt::format("<text class=\"lb\" transform=\"translate({} {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     px(left + kScale_px + 8 + widest + 22), px((top + bottom) / 2), xml_escaped(m.label));
  return out;
}

}  // namespace

Rgb field_colour(double share) {
  constexpr std::array<Rgb, 10> kNodes{{{0x44, 0x01, 0x54},
                                        {0x48, 0x28, 0x78},
                                        {0x3e, 0x4a, 0x89},
                                        {0x31, 0x68, 0x8e},
                                        {0x26, 0x82, 0x8e},
                                        {0x1f, 0x9e, 0x89},
                                        {0x35, 0xb7, 0x79},
                                        {0x6d, 0xcd, 0x59},
                                        {0xb4, 0xde, 0x2c},
                                        {0xfd, 0xe7, 0x25}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kNodes.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kNodes.size() - 2);
  const double t = at - static_cast<double>(i);
  const auto mix = [&](std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(std::lround(a + t * (b - a))); };
  return {mix(kNodes[i].r, kNodes[i + 1].r), mix(kNodes[i].g, kNodes[i + 1].g), mix(kNodes[i].b, kNodes[i + 1].b)};
}

std::string disk_map_svg(const DiskMap& m) {
  const double disk_px = m.width_px - kScaleRoom_px - 2 * kMargin_px;
  const double height = disk_px + 2 * kMargin_px;
  std::string out = open_svg(m.width_px, height, m.title);
  if (m.ring_edges_m.size() < 2 || m.sectors < 3 || m.values.size() != (m.ring_edges_m.size() - 1) * static_cast<std::size_t>(m.sectors))
    return out + fmt::format("<text class=\"tk\" x=\"20\" y=\"{}\">nothing to draw</text></svg>\n", px(height / 2));
  const double radius_m = m.ring_edges_m.back();
  const View view{kMargin_px + disk_px / 2, kMargin_px + disk_px / 2, disk_px / 2 / radius_m};
  const Scale scale = scale_of(m);
  out += cells_svg(m, view, scale) + zero_line_svg(m, view);
  for (const double r : {m.ring_edges_m.front(), radius_m})
    out += fmt::format("<circle class=\"rm\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>", px(view.centre_x), px(view.centre_y), px(r * view.px_per_m));
  out += '\n' + wind_svg(m, view, radius_m) + spin_svg(m, view, radius_m);
  out += colour_bar_svg(m, scale, m.width_px - kScaleRoom_px, kMargin_px, height - kMargin_px);
  return out + "</svg>\n";
}

}  // namespace rotorloop::render
