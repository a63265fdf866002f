#include "bench/propeller/polar/section_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {

constexpr double kCountsAbove = 1.5;              // first numbers above it are Lednicer's counts: no coordinate of a chord of 1 is so large
constexpr std::size_t kFewest = 10, kMost = 600;  // XFOIL's splines need the first, its buffers hold more than the second
constexpr double kThinnest_percent = 2.0, kThickest_percent = 40.0;
constexpr double kWidestGap = 0.1;  // of the trailing edge, of the chord
constexpr int kSlices = 100;

struct Loop {
  std::vector<double> x, y;
  std::vector<int> line;
  void add(double px, double py, int number) {
    if (!x.empty() && x.back() == px && y.back() == py) return;  // both sides of a Lednicer file begin at the leading edge
    x.push_back(px);
    y.push_back(py);
    line.push_back(number);
  }
};

std::vector<const TextLine*> rows_below_name(const TextFile& file) {
  std::vector<const TextLine*> rows;
  for (const TextLine& l : file.lines)
    if (!l.fields.empty() && l.number > 1) rows.push_back(&l);
  return rows;
}

void point(const TextFile& file, const TextLine& l, Loop& to) {
  if (l.fields.size() != 2)
    file.fail(l.number, fmt::format("{} fields, expected 2: x and y of one point", l.fields.size()),
              "a line of text or of another format among the coordinates",
              "first line the section's name, then one \"x y\" a line, chord 1");
  to.add(file.number(l, 0, "x", {-0.2, 1.2, "chord"}), file.number(l, 1, "y", {-0.5, 0.5, "chord"}), l.number);
}

Loop lednicer(const TextFile& file, const std::vector<const TextLine*>& rows) {
  const auto count = [&](std::size_t column) {
    return static_cast<std::size_t>(file.number(*rows[0], column, "count of points", {3.0, static_cast<double>(kMost), "1"}));
  };
  const std::size_t upper = count(0), lower = count(1);
  if (rows.size() != 1 + upper + lower)
    file.fail(rows[0]->number, fmt::format("{} and {} points announced, {} lines follow", upper, lower, rows.size() - 1),
              "the file was cut off or edited", "correct the counts, or give the points as one loop from the trailing edge without them");
  Loop loop;
  for (std::size_t i = upper; i >= 1; --i) point(file, *rows[i], loop);
  for (std::size_t i = upper + 1; i < rows.size(); ++i) point(file, *rows[i], loop);
  return loop;
}

// Chord from the middle of the trailing edge to the farthest point, turned level: XFOIL measures angles against the x axis.
void to_unit_chord(const TextFile& file, Loop& loop) {
  const double tx = 0.5 * (loop.x.front() + loop.x.back()), ty = 0.5 * (loop.y.front() + loop.y.back());
  std::size_t nose = 0;
  double most = 0.0;
  if (const double gap = std::hypot(loop.x.front() - loop.x.back(), loop.y.front() - loop.y.back()); gap > kWidestGap)
    file.fail(loop.line.back(), fmt::format("the last point is {:.2f} chords from the first, expected at most {}", gap, kWidestGap),
              "the points do not begin and end at the trailing edge",
              "order them from the trailing edge over the upper side to the leading edge and back below");
  for (std::size_t i = 0; i < loop.x.size(); ++i)
    if (const double d = std::hypot(loop.x[i] - tx, loop.y[i] - ty); d > most) {
      most = d;
      nose = i;
    }
  if (most < 0.5)
    file.fail(loop.line.front(), fmt::format("the chord is {:.3f}, expected about 1", most),
              "the points do not begin and end at the trailing edge",
              "order them from the trailing edge over the upper side and back below");
  const double lx = loop.x[nose], ly = loop.y[nose], c = (tx - lx) / (most * most), s = (ty - ly) / (most * most);
  for (std::size_t i = 0; i < loop.x.size(); ++i) {
    const double dx = loop.x[i] - lx, dy = loop.y[i] - ly;
    loop.x[i] = c * dx + s * dy;
    loop.y[i] = c * dy - s * dx;
  }
}

// y of one side (points from..to) at x, by straight lines.
double height(const SectionShape& s, std::size_t from, std::size_t to, double x) {
  for (std::size_t i = from; i < to; ++i) {
    const double a = s.x[i], b = s.x[i + 1];
    if (a != b && (x - a) * (x - b) <= 0.0) return s.y[i] + (x - a) / (b - a) * (s.y[i + 1] - s.y[i]);
  }
  return 0.0;
}

void measure(SectionShape& s) {
  const auto nose = static_cast<std::size_t>(std::min_element(s.x.begin(), s.x.end()) - s.x.begin());
  for (int i = 1; i < kSlices; ++i) {
    const double x = static_cast<double>(i) / kSlices, up = height(s, 0, nose, x), low = height(s, nose, s.x.size() - 1, x);
    s.thickness_percent = std::max(s.thickness_percent, 100.0 * (up - low));
    if (const double camber = 50.0 * (up + low); std::abs(camber) > std::abs(s.camber_percent)) s.camber_percent = camber;
  }
}

}  // namespace

std::optional<std::string> naca_digits(const std::string& text) {
  std::string t;
  for (const char c : text)
    if (c != ' ' && c != '-' && c != '_') t += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  if (t.starts_with("naca")) t.erase(0, 4);
  if ((t.size() != 4 && t.size() != 5) || t.find_first_not_of("0123456789") != std::string::npos) return std::nullopt;
  const int thickness = std::stoi(t.substr(t.size() - 2));
  const auto refuse = [&](const std::string& what, const std::string& remedy) { throw Error({"section " + text, what, "", remedy}); };
  if (thickness < kThinnest_percent || thickness > kThickest_percent)
    refuse(fmt::format("the last two digits are a thickness of {} %, expected 2 to 40", thickness), "give a section of that range");
  if (t.size() == 4 && (t[0] == '0') != (t[1] == '0'))
    refuse("camber and its place are the first two digits: both 0 or neither", "NACA 4412 has 4 % at 40 % of the chord, NACA 0012 none");
  if (t.size() == 5 && !std::set<std::string>{"210", "220", "230", "240", "250"}.contains(t.substr(0, 3)))
    refuse("of five digits the first three are 210, 220, 230, 240 or 250", "give coordinates as a .dat file for any other section");
  return t;
}

SectionShape naca_section(const std::string& digits) {
  SectionShape s;
  s.label = "NACA " + digits;
  s.naca = digits;
  s.thickness_percent = std::stod(digits.substr(digits.size() - 2));
  s.camber_percent = digits.size() == 4 ? digits[0] - '0' : 1.8;  // 210 to 250 have 1.1 to 2.3 %
  return s;
}

SectionShape read_section_file(const TextFile& file) {
  const auto rows = rows_below_name(file);
  if (rows.size() < kFewest || rows.size() > kMost)
    file.fail(static_cast<int>(file.lines.size()), fmt::format("{} lines below the name, expected {} to {}", rows.size(), kFewest, kMost),
              "not a file of coordinates, or cut off", "first line the section's name, then one \"x y\" a line, chord 1");
  Loop loop;
  if (rows[0]->fields.size() == 2 && file.number(*rows[0], 0, "x", {-0.2, 1e4, "chord"}) > kCountsAbove)
    loop = lednicer(file, rows);
  else
    for (const TextLine* l : rows) point(file, *l, loop);
  to_unit_chord(file, loop);
  double area = 0.0;
  for (std::size_t i = 0, n = loop.x.size(); i < n; ++i) area += 0.5 * (loop.x[i] * loop.y[(i + 1) % n] - loop.x[(i + 1) % n] * loop.y[i]);
  if (area < 0.0) {
    std::reverse(loop.x.begin(), loop.x.end());
    std::reverse(loop.y.begin(), loop.y.end());
  }
  SectionShape s;
  s.label = file.lines.front().text;
  s.label.erase(0, s.label.find_first_not_of(" \t"));
  s.label.erase(s.label.find_last_not_of(" \t\r") + 1);
  std::erase_if(s.label, [](char c) { return c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20; });
  if (s.label.empty()) s.label = file.name.stem().string();
  s.x = std::move(loop.x);
  s.y = std::move(loop.y);
  measure(s);
  if (s.thickness_percent < kThinnest_percent || s.thickness_percent > kThickest_percent)
    file.fail(rows[0]->number,
              fmt::format("the section is {:.1f} % thick, expected {} to {}", s.thickness_percent, kThinnest_percent, kThickest_percent),
              "the points are not one loop from the trailing edge to the trailing edge",
              "order them from the trailing edge over the upper side to the leading edge and back below");
  return s;
}

}  // namespace rotorloop::propeller
