#include "bench/studies/command_thrust.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/constants.hpp"
#include "host/base/error.hpp"

namespace rotorloop::studies {
namespace {

constexpr double kBlock_s = 5.0;
constexpr std::size_t kLeastCommandSamples = 500;
constexpr double kIndistinguishableRmsRatio = 1.25;  // held-out rms within this factor of the best
constexpr double kLeastFall = 0.02;                  // of the held-out rms
constexpr int kRounds = 8;                           // of map and numbers in turn: the second changes the sixth digit only

double at(const log::Stream<double>& s, double t_s) {
  const auto it = std::upper_bound(s.t_s.begin(), s.t_s.end(), t_s);
  return s.value[it == s.t_s.begin() ? 0 : static_cast<std::size_t>(it - s.t_s.begin()) - 1];
}

struct Map {
  double a = 0.0, b = 0.0;  // specific force = a Σ u² + b Σ u
  double operator()(double u_V, double u2_V2, double gain) const { return gain * (a * gain * u2_V2 + b * u_V); }
};
enum class Kind { none, battery_gain, force_offset };

double modelled(const Map& m, const CommandThrust& f, std::size_t i, Kind kind, double number) {
  return kind == Kind::battery_gain ? m(f.u_V[i], f.u2_V2[i], 1.0 + number)
                                    : m(f.u_V[i], f.u2_V2[i], 1.0) + (kind == Kind::force_offset ? number : 0.0);
}

// The flight's number from samples [from, to), for a given map: one Gauss-Newton step is exact for the offset, three for the gain.
double number_of(const Map& m, const CommandThrust& f, Kind kind, std::size_t from, std::size_t to) {
  double number = 0.0;
  if (kind == Kind::none) return number;
  for (int round = 0; round < 3; ++round) {
    double gradient = 0.0, square = 0.0;
    for (std::size_t i = from; i < to; ++i) {
      const double g = 1.0 + number;
      const double slope = kind == Kind::force_offset ? 1.0 : 2.0 * m.a * g * f.u2_V2[i] + m.b * f.u_V[i];
      gradient += slope * (f.force_m_s2[i] - modelled(m, f, i, kind, number));
      square += slope * slope;
    }
    number += gradient / square;
  }
  return number;
}

// Map of several flights with a number each, in turn; the numbers' mean is zero, as the map has it.
Map fit_map(const std::vector<const CommandThrust*>& flights, Kind kind, std::vector<double>& numbers) {
  Map m;
  numbers.assign(flights.size(), 0.0);
  for (int round = 0; round < (kind == Kind::none ? 1 : kRounds); ++round) {
    double s11 = 0.0, s12 = 0.0, s22 = 0.0, y1 = 0.0, y2 = 0.0;
    for (std::size_t k = 0; k < flights.size(); ++k) {
      const CommandThrust& f = *flights[k];
      const double g = kind == Kind::battery_gain ? 1.0 + numbers[k] : 1.0, offset = kind == Kind::force_offset ? numbers[k] : 0.0;
      for (std::size_t i = 0; i < f.t_s.size(); ++i) {
        const double x1 = g * g * f.u2_V2[i], x2 = g * f.u_V[i], y = f.force_m_s2[i] - offset;
        s11 += x1 * x1;
        s12 += x1 * x2;
        s22 += x2 * x2;
        y1 += x1 * y;
        y2 += x2 * y;
      }
    }
    const double det = s11 * s22 - s12 * s12;
    m = {(s22 * y1 - s12 * y2) / det, (s11 * y2 - s12 * y1) / det};
    double mean = 0.0;
    for (std::size_t k = 0; k < flights.size(); ++k) mean += numbers[k] = number_of(m, *flights[k], kind, 0, flights[k]->t_s.size());
    for (auto& n : numbers) n -= mean / static_cast<double>(flights.size());
  }
  return m;
}

double scatter(const std::vector<double>& v) {
  double mean = 0.0, squares = 0.0;
  for (const double x : v) mean += x / static_cast<double>(v.size());
  for (const double x : v) squares += (x - mean) * (x - mean);
  return std::sqrt(squares / static_cast<double>(v.size() - 1));
}

std::vector<const CommandThrust*> all_but(const std::vector<CommandThrust>& flights, std::size_t without) {
  std::vector<const CommandThrust*> out;
  for (std::size_t k = 0; k < flights.size(); ++k)
    if (k != without) out.push_back(&flights[k]);
  return out;
}

struct HeldOut {
  Eigen::VectorXd error;
  std::vector<int> block;
};
HeldOut held_out(const std::vector<CommandThrust>& flights, Kind kind) {
  HeldOut h;
  std::vector<double> errors, numbers;
  for (std::size_t k = 0; k < flights.size(); ++k) {
    const Map m = fit_map(all_but(flights, k), kind, numbers);
    const CommandThrust& f = flights[k];
    const std::size_t half = f.t_s.size() / 2;
    const double number = number_of(m, f, kind, 0, half);
    for (std::size_t i = half; i < f.t_s.size(); ++i) {
      errors.push_back(f.force_m_s2[i] - modelled(m, f, i, kind, number));
      h.block.push_back(static_cast<int>(k) * 1000 + static_cast<int>((f.t_s[i] - f.t_s[0]) / kBlock_s));
    }
  }
  h.error = Eigen::Map<const Eigen::VectorXd>(errors.data(), static_cast<Eigen::Index>(errors.size()));
  return h;
}

FlightDifference describe(const std::vector<CommandThrust>& flights, Kind kind, std::string id, std::string meaning) {
  FlightDifference d;
  d.id = std::move(id);
  d.meaning = std::move(meaning);
  const Map m = fit_map(all_but(flights, flights.size()), kind, d.per_flight);
  double squares = 0.0, sum = 0.0, n = 0.0, y2 = 0.0;
  for (std::size_t k = 0; k < flights.size(); ++k) {
    const CommandThrust& f = flights[k];
    for (std::size_t i = 0; i < f.t_s.size(); ++i) {
      const double e = f.force_m_s2[i] - modelled(m, f, i, kind, d.per_flight[k]);
      squares += e * e;
      sum += f.force_m_s2[i];
      y2 += f.force_m_s2[i] * f.force_m_s2[i];
      n += 1.0;
    }
    // From the two halves: what the number is worth, drift within a flight included.
    const std::size_t half = f.t_s.size() / 2;
    d.u.push_back(0.5 * std::abs(number_of(m, f, kind, 0, half) - number_of(m, f, kind, half, f.t_s.size())));
  }
  d.rms_m_s2 = std::sqrt(squares / n);
  d.r2 = 1.0 - squares / (y2 - sum * sum / n);
  return d;
}

}  // namespace

CommandThrust command_thrust(const log::FlightRecord& f, const CommandThrustOptions& o) {
  CommandThrust c;
  c.flight = f.name;
  const bool pose = !f.pose.empty();
  const std::vector<double>& stamp = pose ? f.pose.t_s : f.position_W_m.t_s;
  if (f.motor_command.empty() || f.battery_V.empty() || f.accel_B_m_s2.empty() || stamp.empty()) return c;
  const auto height = [&](std::size_t i) { return pose ? f.pose.value[i].p_W_m.z() : f.position_W_m.value[i].z(); };
  double lowest = height(0);
  for (std::size_t i = 0; i < stamp.size(); ++i) lowest = std::min(lowest, height(i));
  log::RotorValues lagged{};
  std::size_t p = 0, a = 0;
  for (std::size_t i = 0; i < f.motor_command.size(); ++i) {
    const double t = f.motor_command.t_s[i], volts = at(f.battery_V, t);
    const double dt = i > 0 ? t - f.motor_command.t_s[i - 1] : 0.0;
    double u = 0.0, u2 = 0.0;
    for (std::size_t r = 0; r < 4; ++r) {
      const double now = f.motor_command.value[i][r] * volts;
      lagged[r] = i == 0 ? now : lagged[r] + dt / (o.lag_s + dt) * (now - lagged[r]);
      u += lagged[r];
      u2 += lagged[r] * lagged[r];
    }
    while (p + 1 < stamp.size() && stamp[p + 1] <= t) ++p;
    while (a + 1 < f.accel_B_m_s2.size() && f.accel_B_m_s2.t_s[a + 1] <= t) ++a;
    const double force = f.accel_B_m_s2.value[a].z();
    if (height(p) < lowest + o.airborne_m || std::abs(force - kGravity_m_s2) > o.largest_m_s2) continue;
    c.t_s.push_back(t);
    c.u_V.push_back(u);
    c.u2_V2.push_back(u2);
    c.force_m_s2.push_back(force);
    c.battery_V.push_back(volts);
  }
  return c;
}

CommandThrustDiagnosis diagnose_command_thrust(const std::vector<log::FlightRecord>& records, const CommandThrustOptions& o) {
  std::vector<CommandThrust> flights;
  for (const auto& r : records)
    if (auto c = command_thrust(r, o); c.t_s.size() >= kLeastCommandSamples) flights.push_back(std::move(c));
  if (flights.size() < 3)
    throw Error(
        {"flights",
         fmt::format("{} flights with command, battery voltage, accelerometer and height in the air, at least 3 needed", flights.size()),
         "", "give more flights of the vehicle"},
        ExitCode::data_quality);
  CommandThrustDiagnosis d;
  for (const auto& f : flights) {
    d.flights.push_back(f.flight);
    d.own_r2.push_back(describe({f}, Kind::none, "", "").r2);
  }
  d.none = describe(flights, Kind::none, "none", "one map for all flights");
  const HeldOut before = held_out(flights, Kind::none);
  d.none.held_out_rms_m_s2 = rms_of(before.error);
  const auto add = [&](Kind kind, const char* id, const char* meaning) {
    FlightDifference x = describe(flights, kind, id, meaning);
    const HeldOut after = held_out(flights, kind);
    x.held_out_rms_m_s2 = rms_of(after.error);
    x.fall = rms_reduction(before.error, after.error, before.block, o.seed);
    d.differences.push_back(std::move(x));
  };
  add(Kind::battery_gain, "battery_gain", "motor voltage times 1 + number: battery, wiring, a warm motor");
  add(Kind::force_offset, "force_offset", "specific force plus number, m/s^2: accelerometer, load");
  std::stable_sort(d.differences.begin(), d.differences.end(),
                   [](const auto& a, const auto& b) { return a.held_out_rms_m_s2 < b.held_out_rms_m_s2; });
  // In level flight the accelerometer shows gravity over the cosine of tilt, whatever the map: an offset of its own shows there.
  std::vector<double> shown;
  for (const auto& f : flights) {
    double sum = 0.0;
    for (const double v : f.force_m_s2) sum += v;
    shown.push_back(sum / static_cast<double>(f.force_m_s2.size()));
  }
  for (auto& x : d.differences) {
    if (x.fall.value <= kLeastFall || x.fall.low <= 0.0)
      x.ruled_out_by = "flights that it was not fitted to gain nothing";
    else if (x.held_out_rms_m_s2 > kIndistinguishableRmsRatio * d.differences.front().held_out_rms_m_s2)
      x.ruled_out_by = d.differences.front().id + " serves held-out flights better";
    else if (x.id == "force_offset" && scatter(shown) < 0.5 * scatter(x.per_flight))
      x.ruled_out_by = fmt::format("the accelerometer's mean scatters by {:.3f} m/s^2 over the flights, the offset by {:.3f}",
                                   scatter(shown), scatter(x.per_flight));
    if (x.ruled_out_by.empty()) d.named.push_back(x.id);
  }
  d.verdict = d.named.empty()       ? diagnose::DiagnosisVerdict::clean
              : d.named.size() == 1 ? diagnose::DiagnosisVerdict::named
                                    : diagnose::DiagnosisVerdict::ambiguous;
  return d;
}

std::string command_thrust_text(const CommandThrustDiagnosis& d) {
  std::string s = fmt::format("thrust from command and battery voltage, {} flights: {}{}\n", d.flights.size(), name(d.verdict),
                              d.named.empty() ? "" : fmt::format(": {}", fmt::join(d.named, " | ")));
  s += fmt::format("  one map: rms {:.3f} m/s^2, R² {:.3f}, held out {:.3f} m/s^2\n", d.none.rms_m_s2, d.none.r2, d.none.held_out_rms_m_s2);
  for (const auto& x : d.differences)
    s += fmt::format("  {}: rms {:.3f} m/s^2, R² {:.3f}, held out {:.3f} m/s^2 ({:+.0f} %, 95 %: {:+.0f} to {:+.0f})\n", x.id, x.rms_m_s2,
                     x.r2, x.held_out_rms_m_s2, -100.0 * x.fall.value, -100.0 * x.fall.high, -100.0 * x.fall.low) +
         (x.ruled_out_by.empty() ? "" : "    ruled out: " + x.ruled_out_by + "\n");
  for (std::size_t k = 0; k < d.flights.size(); ++k) {
    s += fmt::format("    {:<28} own R² {:.3f}", d.flights[k], d.own_r2[k]);
    for (const auto& x : d.differences) s += fmt::format(", {} {:+.4f} ± {:.4f}", x.id, x.per_flight[k], x.u[k]);
    s += "\n";
  }
  return s;
}

}  // namespace rotorloop::studies
