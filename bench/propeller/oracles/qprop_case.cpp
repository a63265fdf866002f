// The .def file is a sequence of number groups with comments after '!' or '#'; the listing is fixed columns below '#' lines.
#include "bench/propeller/oracles/qprop_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {
struct Line {
  int number;
  std::vector<double> values;
};

[[noreturn]] void refuse(const std::filesystem::path& path, int line, const std::string& what) {
  throw Error({fmt::format("{}:{}", path.generic_string(), line), what, "not a file of QPROP 1.22, or cut off",
               "take the file again from where the data folder's PROVENANCE.md says"});
}

// After the title (the first line that is no comment): every line that starts with a number, up to the first field that is none.
std::vector<Line> number_lines(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) refuse(path, 0, "cannot be opened");
  std::vector<Line> lines;
  std::string text;
  bool have_title = false;
  for (int number = 1; std::getline(in, text); ++number) {
    const std::string code = text.substr(0, text.find_first_of("!#"));
    if (!have_title) {
      have_title = code.find_first_not_of(" \t\r") != std::string::npos;
      continue;
    }
    std::istringstream s(code);
    Line line{number, {}};
    for (double value = 0.0; s >> value;) line.values.push_back(value);
    if (!line.values.empty()) lines.push_back(line);
  }
  return lines;
}

double constant(const std::filesystem::path& path, const std::string& name) {
  std::ifstream in(path);
  for (std::string text; std::getline(in, text);) {
    std::istringstream s(text);
    std::string hash, key, equals;
    double value = 0.0;
    if (s >> hash >> key >> equals >> value && hash == "#" && key == name && equals == "=") return value;
  }
  refuse(path, 0, "no line '# " + name + " ='");
}
}  // namespace

QpropDefinition read_qprop_definition(const std::filesystem::path& path) {
  const auto lines = number_lines(path);
  constexpr std::size_t kHeader = 7;
  constexpr std::size_t kFields[kHeader] = {1, 2, 2, 4, 2, 3, 3};  // blades R | CL0 a | limits | drag | Re | factors | offsets
  if (lines.size() < kHeader + 3) refuse(path, lines.empty() ? 0 : lines.back().number, "fewer than seven header lines and three stations");
  for (std::size_t i = 0; i < kHeader; ++i)
    if (lines[i].values.size() < kFields[i])
      refuse(path, lines[i].number, fmt::format("{} numbers, expected {}", lines[i].values.size(), kFields[i]));
  const auto at = [&](std::size_t line, std::size_t field) { return lines[line].values[field]; };
  QpropDefinition d{};
  d.blades = static_cast<int>(at(0, 0));
  d.polar = {at(1, 0), at(1, 1), at(2, 0), at(2, 1), at(3, 0), at(3, 1), at(3, 2), at(3, 3), at(4, 0), at(4, 1)};
  for (std::size_t i = kHeader; i < lines.size(); ++i) {
    if (lines[i].values.size() < 3) refuse(path, lines[i].number, "a station needs radius, chord and angle");
    d.r_m.push_back(at(i, 0) * at(5, 0) + at(6, 0));
    d.chord_m.push_back(at(i, 1) * at(5, 1) + at(6, 1));
    d.beta_deg.push_back(at(i, 2) * at(5, 2) + at(6, 2));
    if (i > kHeader && !(d.r_m.back() > d.r_m[d.r_m.size() - 2])) refuse(path, lines[i].number, "radii do not rise");
  }
  return d;
}

QpropListing read_qprop_listing(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) refuse(path, 0, "cannot be opened");
  QpropListing q{};
  q.density_kg_m3 = constant(path, "rho");
  q.viscosity_Pa_s = constant(path, "mu");
  q.sound_speed_m_s = constant(path, "a");
  std::string text;
  bool have_point = false;
  for (int number = 1; std::getline(in, text); ++number) {
    const auto first = text.find_first_not_of(" \t");
    if (first == std::string::npos || (text[first] == '#' && have_point)) continue;
    std::istringstream s(text[first] == '#' ? text.substr(first + 1) : text);
    std::vector<double> v;
    for (double value = 0.0; s >> value;) v.push_back(value);
    // The operating point stands behind a '#' with its 19 numbers (so do the column numbers 1 to 19).
    if (!have_point && v.size() >= 19 && v[1] > 100.0) {
      q.speed_m_s = v[0];
      q.rpm = v[1];
      q.thrust_N = v[3];
      q.torque_N_m = v[4];
      have_point = true;
    } else if (have_point && v.size() >= 12) {
      q.stations.push_back({v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[9]});
    } else if (have_point) {
      refuse(path, number, "a station with fewer than 12 columns");
    }
  }
  if (!have_point || q.stations.empty()) refuse(path, 0, "no operating point with its stations");
  return q;
}

CubicSpline::CubicSpline(std::vector<double> x, std::vector<double> y) : x_(std::move(x)), y_(std::move(y)), slope_(x_.size()) {
  // Tridiagonal system in the slopes. Zero third derivative makes each end segment a parabola: the sum of its slopes is twice its secant.
  const std::size_t n = x_.size();
  std::vector<double> below(n), middle(n), above(n), right(n);
  const auto h = [&](std::size_t i) { return x_[i + 1] - x_[i]; };
  const auto secant = [&](std::size_t i) { return (y_[i + 1] - y_[i]) / h(i); };
  middle[0] = above[0] = below[n - 1] = middle[n - 1] = 1.0;
  right[0] = 2.0 * secant(0);
  right[n - 1] = 2.0 * secant(n - 2);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    below[i] = h(i);
    middle[i] = 2.0 * (h(i - 1) + h(i));
    above[i] = h(i - 1);
    right[i] = 3.0 * (h(i) * secant(i - 1) + h(i - 1) * secant(i));
  }
  for (std::size_t i = 1; i < n; ++i) {
    const double factor = below[i] / middle[i - 1];
    middle[i] -= factor * above[i - 1];
    right[i] -= factor * right[i - 1];
  }
  slope_[n - 1] = right[n - 1] / middle[n - 1];
  for (std::size_t i = n - 1; i-- > 0;) slope_[i] = (right[i] - above[i] * slope_[i + 1]) / middle[i];
}

double CubicSpline::operator()(double at) const {
  const auto above = std::lower_bound(x_.begin() + 1, x_.end() - 1, at);
  const auto i = static_cast<std::size_t>(above - x_.begin());
  const double h = x_[i] - x_[i - 1], t = (at - x_[i - 1]) / h, secant = (y_[i] - y_[i - 1]) / h;
  return y_[i - 1] + t * h * (secant + (1.0 - t) * ((1.0 - t) * (slope_[i - 1] - secant) - t * (slope_[i] - secant)));
}

sim::ReferenceGeometry qprop_geometry(const QpropDefinition& d, int elements) {
  const CubicSpline chord(d.r_m, d.chord_m), beta(d.r_m, d.beta_deg);
  sim::ReferenceGeometry g{d.blades, d.r_m.back(), d.r_m.front(), {}};
  const double width = (d.r_m.back() - d.r_m.front()) / elements;
  for (int i = 0; i < elements; ++i) {
    const double r = d.r_m.front() + (i + 0.5) * width;
    g.elements.push_back({r, width, chord(r), beta(r) * std::numbers::pi / 180.0, sim::qprop_section(d.polar)});
  }
  return g;
}

}  // namespace rotorloop::propeller
