#include "bench/sysid/score/one_step.hpp"

#include <cmath>
#include <numbers>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/estimate/mean_noise.hpp"
#include "host/base/random.hpp"

namespace rotorloop::score {
namespace {

constexpr std::uint64_t kExpectedModule = 0x4F4E4553u;
constexpr PredictedQuantity kPoseQuantities[] = {kPredictedPosition, kPredictedAttitude};
using Six = Eigen::Matrix<double, 6, 1>;

// States alone: the mass is tied to its value, for a fit without any parameter is none.
estimate::FitProblem states_only(const estimate::ModelValues& values, std::vector<const estimate::GridFlight*> flights,
                                 std::vector<estimate::NoiseModel> noise) {
  estimate::FitProblem p{
      .start = values, .free = {}, .flights = std::move(flights), .noise = {}, .flight_noise = std::move(noise), .flight_start = {}};
  p.free.push_back({estimate::kMass, false, 1e-9});
  return p;
}

// One number for each pose as errors of a quantity, for what is computed from those.
std::vector<PredictionErrors> as_errors(std::span<const OneStepErrors> flights, std::vector<double> OneStepErrors::*number) {
  std::vector<PredictionErrors> out;
  for (const OneStepErrors& f : flights) {
    out.push_back(f.error);
    out.back().error = {};
    out.back().error[kPredictedPosition] = f.*number;
  }
  return out;
}

std::vector<PredictionErrors> all(std::span<const OneStepErrors> flights, PredictionErrors OneStepErrors::*which) {
  std::vector<PredictionErrors> out;
  for (const OneStepErrors& f : flights) out.push_back(f.*which);
  return out;
}

double mean(std::span<const OneStepErrors> flights, std::vector<double> OneStepErrors::*number) {
  double sum = 0.0, n = 0.0;
  for (const OneStepErrors& f : flights) {
    for (const double v : f.*number) sum += v;
    n += static_cast<double>((f.*number).size());
  }
  return sum / n;
}

}  // namespace

OneStepErrors one_step(const estimate::GridFlight& g, const estimate::ModelValues& values, const estimate::NoiseModel& noise,
                       std::uint64_t seed) {
  OneStepErrors out;
  out.error = out.expected = {.flight = g.name, .step_s = g.step_s, .horizon = 1, .starts = {}, .error = {}};
  if (g.pose.empty()) return out;
  estimate::FitOptions with_innovations;
  with_innovations.innovations = true;
  const estimate::Fit found = estimate::fit(states_only(values, {&g}, {noise}), with_innovations);
  Six sigma;
  sigma << noise.position_m, noise.attitude_rad;
  const double log_sigma = sigma.array().log().sum() + 3.0 * std::log(2.0 * std::numbers::pi);
  const RandomStream random(seed, kExpectedModule);
  std::uint64_t draw = 0;
  for (const estimate::Innovation& i : found.reduced.front().innovations) {
    const auto lower = i.root.triangularView<Eigen::Lower>();
    Six drawn;
    for (double& d : drawn) d = random.gaussian(draw++);
    const Six ahead = sigma.cwiseProduct(lower * i.value), would = sigma.cwiseProduct(lower * drawn);
    const auto start = static_cast<std::size_t>(std::lround((i.t_s - g.start_s) / g.step_s));
    for (PredictionErrors* e : {&out.error, &out.expected}) {
      const Six& by = e == &out.error ? ahead : would;
      e->starts.push_back(start);
      e->error[kPredictedPosition].push_back(by.head<3>().norm());
      e->error[kPredictedAttitude].push_back(by.tail<3>().norm());
    }
    out.squares.push_back(i.value.squaredNorm());
    out.log_density.push_back(-0.5 * i.value.squaredNorm() - i.root.diagonal().array().log().sum() - log_sigma);
  }
  return out;
}

OneStepComparison compare(std::span<const OneStepErrors> before, std::span<const OneStepErrors> after) {
  OneStepComparison out;
  for (const OneStepErrors& f : after) out.poses += f.squares.size();
  if (out.poses == 0) return out;
  out.step_s = after.front().error.step_s;
  const auto a = all(before, &OneStepErrors::error), b = all(after, &OneStepErrors::error), right = all(after, &OneStepErrors::expected);
  const auto mean_of = [](const std::vector<PredictionErrors>& flights, PredictedQuantity q) {
    double sum = 0.0, n = 0.0;
    for (const PredictionErrors& f : flights) {
      for (const double e : f.error[q]) sum += e;
      n += static_cast<double>(f.starts.size());
    }
    return sum / n;
  };
  for (const PredictedQuantity q : kPoseQuantities)
    out.rows.push_back({q, mean_of(a, q), mean_of(b, q), error_ratio(b, a, q, 1, 1), mean_of(right, q)});
  out.size_before = std::sqrt(mean(before, &OneStepErrors::squares) / 6.0);
  out.size_after = std::sqrt(mean(after, &OneStepErrors::squares) / 6.0);
  out.log_density_before = mean(before, &OneStepErrors::log_density);
  out.log_density_after = mean(after, &OneStepErrors::log_density);
  out.gain =
      mean_difference(as_errors(after, &OneStepErrors::log_density), as_errors(before, &OneStepErrors::log_density), kPredictedPosition, 1);
  return out;
}

estimate::NoiseModel noise_under(const estimate::ModelValues& values, std::span<const estimate::GridFlight> flights,
                                 std::span<const estimate::NoiseModel> start, const estimate::NoiseFit& search, int threads) {
  if (search.rounds == 0) return estimate::mean_noise(start);
  std::vector<const estimate::GridFlight*> list;
  for (const estimate::GridFlight& g : flights) list.push_back(&g);
  estimate::FitOptions o;
  o.threads = threads;
  o.noise = search;
  return estimate::mean_noise(estimate::fit(states_only(values, std::move(list), {start.begin(), start.end()}), o).noise);
}

}  // namespace rotorloop::score
