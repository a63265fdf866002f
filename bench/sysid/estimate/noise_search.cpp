#include "bench/sysid/estimate/noise_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace rotorloop::estimate {
namespace {

constexpr int kSteps = 15;            // at most
constexpr double kLargestMove = 1.0;  // of a logarithm in one step: a factor of e
constexpr std::array kFigures{&NoiseModel::force_m_s2_rtHz, &NoiseModel::angular_rad_s2_rtHz, &NoiseModel::position_m,
                              &NoiseModel::attitude_rad,    &NoiseModel::velocity_m_s,        &NoiseModel::gyro_rad_s,
                              &NoiseModel::accel_m_s2};
constexpr std::array kMoments{&NoiseMoments::force,    &NoiseMoments::angular, &NoiseMoments::position, &NoiseMoments::attitude,
                              &NoiseMoments::velocity, &NoiseMoments::gyro,    &NoiseMoments::accel};
// Of one measurement, the least, in the order of the figures: no pose is better than a tenth of a millimetre. With less the fit goes
// through every pose, the process explains the rest, and no step of the parameters leads anywhere.
constexpr std::array kLeast{0.0, 0.0, 1e-4, 1e-4, 1e-3, 1e-3, 1e-2};
constexpr std::size_t kForce = 0, kProcessFigures = 2;  // place of the force; how many, from the first, are of the process

// EM alone multiplies each standard deviation by the root of its moment, but creeps where measurements say little about one step. The
// logarithm of that root is, up to a positive factor, the slope of the likelihood, so each figure takes a secant step to the slope's
// zero instead.
class SecantSteps {
 public:
  // One step from the moments found with `noise`; returns the largest relative change.
  double step(NoiseModel& noise, const NoiseMoments& moments, const NoiseModel& limits, const NoiseFit& o) {
    double largest = 0.0;
    const bool tracked = moments.position.count > 0.0 || moments.velocity.count > 0.0;
    for (std::size_t figure = 0; figure < kFigures.size(); ++figure) {
      const NoiseMoment& of = moments.*kMoments[figure];
      if (!(figure < kProcessFigures ? o.process : o.measurements) || of.count <= 0.0) continue;
      // By gyro and accelerometer alone velocity is unobservable: with forces left to chance it would wander until it explains every
      // measurement of the accelerometer by inflow and drag.
      if (figure == kForce && !tracked) continue;
      Eigen::Vector3d& sd = noise.*kFigures[figure];
      Eigen::Vector3d factor = of.squares / of.count;
      if (!o.per_axis) factor.setConstant(factor.mean());
      for (Eigen::Index i = 0; i < 3; ++i) {
        Memory& last = memory_[3 * figure + static_cast<std::size_t>(i)];
        const double x = std::log(sd[i]), slope = 0.5 * std::log(std::clamp(factor[i], 1e-6, 1e6));
        double move = 4.0 * slope;
        if (last.seen && std::fabs(x - last.x) > 1e-9) {
          const double fall = (last.slope - slope) / (x - last.x);
          if (fall > 1e-3) move = slope / fall;
        }
        move = std::clamp(move, -kLargestMove, kLargestMove);
        if (kLeast[figure] > 0.0) move = std::max(move, std::min(0.0, std::log(kLeast[figure]) - x));
        move = std::min(move, std::log((limits.*kFigures[figure])[i]) - x);
        last = {true, x, slope};
        sd[i] = std::exp(x + move);
        largest = std::max(largest, std::fabs(move));
      }
    }
    return largest;
  }

 private:
  struct Memory {
    bool seen = false;
    double x = 0.0, slope = 0.0;
  };
  std::array<Memory, 3 * kFigures.size()> memory_{};
};

NoiseMoments pooled(const std::vector<NoiseMoments>& all) {
  NoiseMoments out;
  for (const NoiseMoments& m : all) {
    for (const auto figure : kMoments) {
      (out.*figure).squares += (m.*figure).squares;
      (out.*figure).count += (m.*figure).count;
    }
  }
  return out;
}

double largest_change(const NoiseModel& from, const NoiseModel& to) {
  double out = 0.0;
  for (const auto figure : kFigures) out = std::max(out, (to.*figure).cwiseQuotient(from.*figure).array().log().abs().maxCoeff());
  return out;
}

}  // namespace

double log_standard_deviations(const GridFlight& g, const NoiseModel& n) {
  std::size_t linked = 0;
  for (const auto l : g.linked) linked += l;
  const auto logs = [](const Eigen::Vector3d& v) { return v.array().log().sum(); };
  const double h = g.step_s, per_axis = std::log(h * h * h / 3.0) / 2.0 + std::log(h / 4.0) / 2.0;
  double sum = static_cast<double>(linked) * (2.0 * logs(n.force_m_s2_rtHz) + 2.0 * logs(n.angular_rad_s2_rtHz) + 6.0 * per_axis);
  sum += static_cast<double>(g.pose.size()) * (logs(n.position_m) + logs(n.attitude_rad));
  sum += static_cast<double>(g.position.size()) * logs(n.position_m) + static_cast<double>(g.velocity.size()) * logs(n.velocity_m_s);
  sum += static_cast<double>(g.gyro.size()) * logs(n.gyro_rad_s) + static_cast<double>(g.accel.size()) * logs(n.accel_m_s2);
  return sum;
}

SettledNoise settle_noise(const std::vector<FlightRows>& flights, const std::vector<NoiseModel>& noise, const NoiseFit& o,
                          const ForEachFlight& for_each) {
  SettledNoise out{.noise = noise, .moves = {}, .change = 0.0};
  std::vector<RowSmoother> smoothers;
  for (std::size_t f = 0; f < flights.size(); ++f) smoothers.emplace_back(flights[f].flight, flights[f].rows, noise[f]);
  std::vector<SecantSteps> steps(flights.size());
  std::vector<NoiseMoments> moments(flights.size());
  const auto smooth = [&] { for_each([&](std::size_t f) { moments[f] = smoothers[f].smooth(out.noise[f]); }); };
  smooth();
  for (int again = 0; again < kSteps; ++again) {
    if (!o.per_flight) moments.assign(flights.size(), pooled(moments));
    double change = 0.0;
    for (std::size_t f = 0; f < flights.size(); ++f)
      change = std::max(change, steps[f].step(out.noise[f], moments[f], flights[f].limits, o));
    smooth();
    if (change < o.tolerance) break;
  }
  for (std::size_t f = 0; f < flights.size(); ++f) {
    out.moves.push_back(smoothers[f].moves());
    out.change = std::max(out.change, largest_change(noise[f], out.noise[f]));
  }
  return out;
}

}  // namespace rotorloop::estimate
