#include "host/control/trajectory_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/toml_file.hpp"

namespace rotorloop::host {

namespace {

struct Channel {
  std::string_view key;
  std::string_view unit;
  Polynomial Segment::*polynomial;
};
constexpr std::array<Channel, 4> kChannels{
    {{"x_m", "m", &Segment::x_m}, {"y_m", "m", &Segment::y_m}, {"z_m", "m", &Segment::z_m}, {"yaw_rad", "rad", &Segment::yaw_rad}}};

struct Derivative {
  std::string_view name;
  std::string_view per;
  double jump;
};
constexpr std::array<Derivative, 3> kDerivatives{
    {{"position", "", kJumpPosition_m}, {"velocity", "/s", kJumpVelocity_m_s}, {"acceleration", "/s²", kJumpAcceleration_m_s2}}};

Polynomial read_polynomial(const TomlTable& t, const Channel& channel) {
  const std::vector<double> c = t.numbers(channel.key, 0, {-1e6, 1e6, channel.unit});
  if (c.size() > kCoefficients)
    t.fail(channel.key, fmt::format("{} has order {}, the highest is {}", channel.key, c.size() - 1, kCoefficients - 1),
           "a polynomial of a higher order than minimum snap needs", "split the segment, or fit it with order 7");
  Polynomial out;
  std::copy(c.begin(), c.end(), out.c.begin());
  return out;
}

void check_joint(const Segment& before, const Segment& after, const TomlTable& where, std::size_t number) {
  for (const Channel& channel : kChannels)
    for (std::size_t n = 0; n < kDerivatives.size(); ++n) {
      const double a = (before.*channel.polynomial).at(before.duration_s, n), b = (after.*channel.polynomial).at(0.0, n);
      if (std::fabs(b - a) <= kDerivatives[n].jump) continue;
      const std::string unit = fmt::format("{}{}", channel.unit, kDerivatives[n].per);
      where.fail(channel.key,
                 fmt::format("{} of {} jumps from {:.6g} {} to {:.6g} {} between segments {} and {}", kDerivatives[n].name, channel.key, a,
                             unit, b, unit, number - 1, number),
                 n == 0 ? "segments in the wrong order, or coefficients taken from the flight's start instead of the segment's"
                        : "coefficients for normalised time instead of seconds",
                 fmt::format("make {} continuous within {:g} {}", kDerivatives[n].name, kDerivatives[n].jump, unit));
    }
}

void check_rest(const Segment& s, double t_s, const TomlTable& where, std::string_view which) {
  for (const Channel& channel : kChannels)
    for (std::size_t n = 1; n < kDerivatives.size(); ++n) {
      const double value = (s.*channel.polynomial).at(t_s, n);
      if (std::fabs(value) <= kDerivatives[n].jump) continue;
      where.fail(channel.key,
                 fmt::format("the flight {} with {} of {} = {:.6g} {}{}, expected rest", which, kDerivatives[n].name, channel.key, value,
                             channel.unit, kDerivatives[n].per),
                 "a piece cut out of a longer flight", "add a segment that comes to rest");
    }
}

TrajectoryFile trajectory_from(const TomlFile& file) {
  file.format({1});
  const TomlTable root = file.root();
  TrajectoryFile out;
  out.name = root.text("name");
  const std::vector<TomlTable> segments = root.tables("segment", 1, kMaxSegments);
  for (const TomlTable& t : segments) {
    Segment& s = out.trajectory.segments[out.trajectory.count++];
    s.duration_s = t.number("duration_s", {1e-3, 3600.0, "s"});
    for (const Channel& channel : kChannels) s.*channel.polynomial = read_polynomial(t, channel);
  }
  file.refuse_unknown_keys();
  const auto& s = out.trajectory.segments;
  check_rest(s[0], 0.0, segments.front(), "starts");
  for (std::size_t i = 1; i < out.trajectory.count; ++i) check_joint(s[i - 1], s[i], segments[i], i + 1);
  const Segment& last = s[out.trajectory.count - 1];
  check_rest(last, last.duration_s, segments.back(), "ends");
  return out;
}

}  // namespace

TrajectoryFile read_trajectory(const std::filesystem::path& path) { return trajectory_from(TomlFile::read(path)); }
TrajectoryFile parse_trajectory(std::string_view text, const std::filesystem::path& name_for_errors) {
  return trajectory_from(TomlFile::parse(text, name_for_errors));
}

std::string trajectory_text(const TrajectoryFile& file) {
  std::string s = fmt::format(
      "# Piecewise polynomials c0 + c1 t + … with t in seconds since the segment's start; metres and radians.\n"
      "format = 1\nname = \"{}\"\n",
      file.name);
  for (std::size_t i = 0; i < file.trajectory.count; ++i) {
    const Segment& segment = file.trajectory.segments[i];
    s += fmt::format("\n[[segment]]\nduration_s = {}\n", number_text(segment.duration_s));
    for (const Channel& channel : kChannels) {
      const auto& c = (segment.*channel.polynomial).c;
      std::size_t size = kCoefficients;
      while (size > 1 && c[size - 1] == 0.0) --size;
      s += fmt::format("{} = [", channel.key);
      for (std::size_t k = 0; k < size; ++k) s += (k ? ", " : "") + number_text(c[k]);
      s += "]\n";
    }
  }
  return s;
}

}  // namespace rotorloop::host
