#include "bench/stand/evaluate/stand_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/stand/evaluate/misread_speed.hpp"
#include "bench/stand/evaluate/rest_points.hpp"
#include "host/base/block_fit.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kSameSpeed = 0.15;     // rotors on one command differ by a few per cent
constexpr double kMisreadShare = 0.05;  // of the points: more is a sensor, less a transient
constexpr std::size_t kLeastMisread = 2;
constexpr double kZeroRmsRatio = 3.0;        // fall of the rms by a constant …
constexpr double kZeroBeyondExponent = 2.0;  // … and by how much more than an exponent does
constexpr double kZeroShare = 0.03;          // of the largest reading: less is no fault that matters

bool turns(const StandPoint& p, std::size_t rotor) { return p.omega_rad_s[rotor] > kAtRest_rad_s; }
bool any_turns(const StandRecord& r, const StandPoint& p) {
  for (std::size_t k = 0; k < r.rotors; ++k)
    if (turns(p, k)) return true;
  return false;
}

double largest(const StandRecord& r, double StandPoint::*value) {
  double most = 0.0;
  for (const auto& p : r.points)
    if (p.*value == p.*value) most = std::max(most, std::abs(p.*value));
  return most;
}

// Speed reads zero while the rotor pulls.
void check_dead_speed(CheckedStand& s) {
  StandRecord& r = s.record;
  const RestPoints rest(r);
  for (std::size_t k = 0; k < r.rotors; ++k) {
    std::size_t dead = 0, running = 0;
    for (const auto& p : r.points) {
      const bool runs = r.rotors == 1 ? turns(p, k) || rest.pulls(p) : any_turns(r, p);
      running += runs;
      dead += runs && !turns(p, k);
    }
    if (static_cast<double>(dead) <= kMisreadShare * static_cast<double>(running) || running == 0) continue;
    s.faults.push_back(
        {fmt::format("rotor {} speed", k + 1),
         fmt::format("reads 0 in {} of {} points where {}", dead, running, r.rotors == 1 ? "it turns or pulls" : "other rotors turn"),
         r.rotors == 1 ? "the speed sensor was not connected or lost the rotor, or the load cell was not tared"
                       : "the speed sensor was not connected or lost the rotor"});
    if (dead == running && r.rotors == 1) s.speed = StandChannelState::faulty;
  }
  if (s.speed == StandChannelState::faulty) return;
  // Without its speed a rotor that is alone says nothing; among several, the next check looks at what is left.
  if (r.rotors > 1) return;
  const std::size_t before = r.points.size();
  std::erase_if(r.points, [&](const StandPoint& p) { return !turns(p, 0) && rest.pulls(p); });
  if (r.points.size() < before) s.notes.push_back(fmt::format("{} points without a speed left out", before - r.points.size()));
}

// How far rotor k's speed is from a smooth function of command and voltage, relative; nothing when there are no commands.
double scatter_on_command(const StandRecord& r, std::size_t k) {
  std::vector<const StandPoint*> use;
  for (const auto& p : r.points)
    if (p.command > 0.0 && any_turns(r, p)) use.push_back(&p);
  if (use.size() < 8) return kNotMeasured;
  Eigen::MatrixXd X(static_cast<Eigen::Index>(use.size()), 3);
  Eigen::VectorXd y(X.rows());
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    const StandPoint& p = *use[static_cast<std::size_t>(i)];
    X.row(i) << 1.0, p.command, p.command * p.command;
    y(i) = p.omega_rad_s[k];
  }
  return fit_in_blocks(X, y, std::vector<int>(use.size(), 0)).rms / y.mean();
}

// Rotors on one command turn at about one speed: one that does not is misread. The one that follows the command best is the reference.
void check_rotors_agree(CheckedStand& s) {
  StandRecord& r = s.record;
  if (r.rotors < 2 || r.points.empty()) return;
  std::size_t reference = 0;
  double least = 1e300;
  for (std::size_t k = 0; k < r.rotors; ++k)
    if (const double scatter = scatter_on_command(r, k); scatter < least) {
      least = scatter;
      reference = k;
    }
  std::vector<bool> bad(r.rotors, false);
  for (std::size_t k = 0; k < r.rotors; ++k) {
    std::size_t twice = 0, wrong = 0, zero = 0, all = 0;
    for (const auto& p : r.points) {
      if (!turns(p, reference)) continue;
      const double ratio = p.omega_rad_s[k] / p.omega_rad_s[reference];
      ++all;
      zero += ratio == 0.0;
      twice += std::abs(ratio - 2.0) < 0.08 || std::abs(ratio - 3.0) < 0.12 || std::abs(ratio - 0.5) < 0.02;
      wrong += std::abs(ratio - 1.0) > kSameSpeed;
    }
    bad[k] = wrong >= kLeastMisread && static_cast<double>(wrong) > kMisreadShare * static_cast<double>(all);
    if (!bad[k] || wrong == zero) continue;  // zeros were reported above
    s.faults.push_back(
        {fmt::format("rotor {} speed", k + 1),
         fmt::format(
             "is more than {:.0f} % from rotor {} on the same command in {:.0f} % of {} points; {:.0f} % are near 2, 3 or half of it",
             100.0 * kSameSpeed, reference + 1, 100.0 * static_cast<double>(wrong) / static_cast<double>(all), all,
             100.0 * static_cast<double>(twice) / static_cast<double>(all)),
         "the sensor counts blades or marks more than once, or misses some"});
  }
  const std::size_t before = r.points.size();
  for (auto& p : r.points)
    for (std::size_t k = 0; k < r.rotors; ++k)
      if (bad[k]) p.omega_rad_s[k] = p.omega_rad_s[reference];
  if (std::count(bad.begin(), bad.end(), true) > 0)
    s.notes.push_back(fmt::format("the speed of rotor {} stands for those that are misread; it follows the command to {:.1f} %",
                                  reference + 1, 100.0 * least));
  std::erase_if(r.points, [&](const StandPoint& p) {
    for (std::size_t k = 0; k < r.rotors; ++k)
      if (any_turns(r, p) && std::abs(p.omega_rad_s[k] - p.omega_rad_s[reference]) > kSameSpeed * p.omega_rad_s[reference]) return true;
    return false;
  });
  if (r.points.size() < before)
    s.notes.push_back(
        fmt::format("{} points left out where rotors differ by more than {:.0f} %", before - r.points.size(), 100.0 * kSameSpeed));
}

// Mean reading at rest; points at rest take no part in a fit.
void take_rest(CheckedStand& s) {
  StandRecord& r = s.record;
  double n = 0.0, thrust = 0.0, torque = 0.0;
  for (const auto& p : r.points)
    if (!any_turns(r, p)) {
      n += 1.0;
      thrust += p.thrust_N;
      torque += p.torque_N_m;
    }
  if (n >= (r.means ? 1.0 : 3.0)) {
    s.rest_thrust_N = thrust / n;
    s.rest_torque_N_m = torque / n;
  }
  std::erase_if(r.points, [&](const StandPoint& p) { return !any_turns(r, p); });
}

// The smallest difference between two readings of the channel.
double resolution(std::vector<double> seen) {
  std::sort(seen.begin(), seen.end());
  double least = HUGE_VAL;
  for (std::size_t i = 1; i < seen.size(); ++i)
    if (seen[i] > seen[i - 1]) least = std::min(least, seen[i] - seen[i - 1]);
  return least;
}

// A reading that repeats to the bit while the speed changes: an instrument that stood still, or whose last answer was written again. What
// the change of speed would have shown must be far above the channel's resolution, and the reading no small one: there steps are coarse.
bool frozen(CheckedStand& s, double StandPoint::*value, std::string_view name, std::string_view unit, double resolution) {
  constexpr std::size_t kFewest = 3;
  constexpr double kSpeeds = 1.1, kSteps = 5.0, kLeastShare = 0.1;
  const auto& points = s.record.points;
  const double least = kLeastShare * largest(s.record, value);
  for (std::size_t first = 0; first < points.size();) {
    std::size_t last = first + 1;
    while (last < points.size() && points[last].*value == points[first].*value) ++last;
    const auto [low, high] =
        std::minmax_element(points.begin() + static_cast<std::ptrdiff_t>(first), points.begin() + static_cast<std::ptrdiff_t>(last),
                            [](const StandPoint& a, const StandPoint& b) { return a.omega_rad_s[0] < b.omega_rad_s[0]; });
    const double v = points[first].*value, ratio = high->omega_rad_s[0] / low->omega_rad_s[0];
    if (last - first >= kFewest && ratio > kSpeeds && std::abs(v) > least && std::abs(v) * (ratio * ratio - 1.0) > kSteps * resolution) {
      s.faults.push_back(
          {std::string(name),
           fmt::format("repeats {:.6g} {} to the last digit in {} points one behind the other (rows {} to {}) while the speed goes "
                       "from {:.0f} to {:.0f} rad/s",
                       v, unit, last - first, points[first].row, points[last - 1].row, low->omega_rad_s[0], high->omega_rad_s[0]),
           "the instrument stood still, or its last answer was written again"});
      return true;
    }
    first = last;
  }
  return false;
}

// Measured at all, not stuck, and which way round.
StandChannelState check_channel(CheckedStand& s, double StandPoint::*value, std::string_view name, std::string_view unit,
                                bool sign_matters) {
  StandRecord& r = s.record;
  std::vector<double> seen;
  double& rest = value == &StandPoint::thrust_N ? s.rest_thrust_N : s.rest_torque_N_m;
  double with_speed = 0.0;
  for (const auto& p : r.points) {
    if (!(p.*value == p.*value)) continue;
    seen.push_back(p.*value);
    with_speed += (p.*value - (rest == rest ? rest : 0.0)) * sum_omega_squared(r, p);
  }
  if (seen.size() < 4) return StandChannelState::absent;
  const auto [low, high] = std::minmax_element(seen.begin(), seen.end());
  if (*low == *high) {
    s.faults.push_back({std::string(name), fmt::format("reads {} {} in all {} points", *low, unit, seen.size()),
                        "the channel was not connected, or its instrument repeats one value"});
    return StandChannelState::faulty;
  }
  if (frozen(s, value, name, unit, resolution(seen))) return StandChannelState::faulty;
  if (with_speed < 0.0) {
    for (auto& p : r.points) p.*value = -(p.*value);
    rest *= -1.0;
    (value == &StandPoint::thrust_N ? s.thrust_sign : s.torque_sign) = -1.0;
    if (sign_matters)
      s.notes.push_back(
          fmt::format("{} is negative where the rotor turns (median {:.3g} {}): the stand counts pulling as negative; sign turned", name,
                      median(seen), unit));
  }
  return StandChannelState::good;
}

}  // namespace

CheckedStand check_stand(StandRecord record) {
  CheckedStand s;
  s.record = std::move(record);
  check_dead_speed(s);
  if (s.speed == StandChannelState::faulty) return s;
  check_rotors_agree(s);
  take_rest(s);
  if (s.record.points.empty()) {
    s.speed = StandChannelState::faulty;
    s.faults.push_back({"rotor speed", "no point is left in which a rotor turns", ""});
    return s;
  }
  check_misread_speed(s);
  if (s.speed == StandChannelState::faulty) return s;
  s.thrust = check_channel(s, &StandPoint::thrust_N, "thrust", "N", true);
  s.torque = check_channel(s, &StandPoint::torque_N_m, "torque", "N m", false);
  if (s.thrust == StandChannelState::good) check_zero(s, StandQuantity::thrust);
  if (s.torque == StandChannelState::good) check_zero(s, StandQuantity::torque);
  return s;
}

void check_zero(CheckedStand& s, StandQuantity channel) {
  const bool thrust = channel == StandQuantity::thrust;
  double StandPoint::*const value = thrust ? &StandPoint::thrust_N : &StandPoint::torque_N_m;
  const StandRecord& r = s.record;
  std::vector<const StandPoint*> use;
  for (const auto& p : r.points) {
    if (p.airspeed_m_s > 0.5) return;  // coefficients change with advance ratio: speed alone says nothing of the zero
    if (p.*value == p.*value) use.push_back(&p);
  }
  if (use.size() < 6) return;
  Eigen::MatrixXd square(static_cast<Eigen::Index>(use.size()), 1), zero(square.rows(), 2), exponent(square.rows(), 2);
  Eigen::VectorXd y(square.rows());
  std::vector<int> block;
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const StandPoint& p = *use[static_cast<std::size_t>(i)];
    const double w2 = sum_omega_squared(r, p);
    square(i, 0) = w2;
    zero.row(i) << w2, 1.0;
    exponent.row(i) << w2, w2 * std::sqrt(w2);
    y(i) = p.*value;
    block.push_back(static_cast<int>(i));
  }
  const BlockFit plain = fit_in_blocks(square, y, block), with_zero = fit_in_blocks(zero, y, block),
                 with_exponent = fit_in_blocks(exponent, y, block);
  const double most = y.cwiseAbs().maxCoeff(), offset = with_zero.c(1);
  if (plain.rms < kZeroRmsRatio * with_zero.rms || with_exponent.rms < kZeroBeyondExponent * with_zero.rms ||
      std::abs(offset) < kZeroShare * most || std::abs(offset) < 5.0 * with_zero.u(1))
    return;
  const double rest = thrust ? s.rest_thrust_N : s.rest_torque_N_m;
  const std::string unit = thrust ? "N" : "N m";
  const bool rest_agrees = rest == rest && std::abs(rest - offset) < 0.5 * std::abs(offset);
  s.faults.push_back(
      {thrust ? "thrust" : "torque",
       fmt::format(
           "has a constant of {:.3g} ± {:.2g} {} ({:.0f} % of the largest reading): with it the error falls from {:.3g} to {:.3g} {} rms, "
           "with a speed exponent only to {:.3g}{}",
           offset, 1.96 * with_zero.u(1), unit, 100.0 * std::abs(offset) / most, plain.rms, with_zero.rms, unit, with_exponent.rms,
           rest == rest ? fmt::format("; at rest the channel reads {:.2g} {}", rest, unit) : std::string()),
       rest == rest && !rest_agrees
           ? "not the tare, which the readings at rest contradict: a mount that carries part of the load, or friction in it"
           : "the load cell was tared under load, or not at all",
       true, rest == rest && !rest_agrees ? std::abs(rest - offset) / most : 0.0});
  (thrust ? s.thrust : s.torque) = StandChannelState::faulty;
}

}  // namespace rotorloop::stand
