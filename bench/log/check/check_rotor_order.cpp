// Which rotor is which: the speeds of a column must turn the vehicle as a rotor at that hub would. Roll and pitch acceleration against
// the moments of the speeds, in the order given and in all others; how large the inertia is does not matter to a correlation.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "bench/log/check/check_moments.hpp"

namespace rotorloop::log {
namespace {

using Order = std::array<std::size_t, 4>;  // rotor k is what the column of rotor order[k] shows

// Correlation of roll and pitch acceleration with the moments of the speeds, means taken out: a centre of mass off the middle is one.
double agreement(const std::vector<MomentSample>& samples, const Order& order, const host::VehicleModel& vehicle, std::ptrdiff_t lag) {
  Eigen::Array2d did = Eigen::Array2d::Zero(), asked = did, did2 = did, asked2 = did, both = did;
  double n = 0.0;
  const auto count = static_cast<std::ptrdiff_t>(samples.size());
  for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, lag); i < count + std::min<std::ptrdiff_t>(0, lag); ++i) {
    const MomentSample &speeds = samples[static_cast<std::size_t>(i)], &turning = samples[static_cast<std::size_t>(i - lag)];
    if (!speeds.valid || !turning.valid) continue;
    Eigen::Array2d m = Eigen::Array2d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d arm = vehicle.arm_m(static_cast<int>(k));
      m += speeds.square[order[k]] * Eigen::Array2d(arm.y(), -arm.x());
    }
    const Eigen::Array2d a = turning.acceleration_B_rad_s2.head<2>().array();
    did += a, asked += m, did2 += a * a, asked2 += m * m, both += a * m;
    n += 1.0;
  }
  constexpr double kLeastSamples = 100.0;
  if (n < kLeastSamples) return 0.0;
  both -= did * asked / n, did2 -= did * did / n, asked2 -= asked * asked / n;
  return both.sum() / std::sqrt(did2.sum() * asked2.sum() + 1e-30);
}

}  // namespace

void check_rotor_order(CheckState& s, const FlightGrid& g, const std::vector<char>& in_flight) {
  constexpr double kAgrees = 0.8, kFarBetter = 0.3;  // 62 clean measured flights: where another order reaches 0.8, the given one has 0.88
  const std::vector<MomentSample> samples = moment_samples(g, in_flight, s.vehicle);
  if (samples.empty()) return;
  const auto reach = static_cast<std::ptrdiff_t>(s.limits.longest_lag_s / (g.grid.dt_s * static_cast<double>(kMomentStride)));
  const auto best_lag = [&](const Order& order) {
    double best = -1.0;
    for (std::ptrdiff_t lag = -reach; lag <= reach; ++lag) best = std::max(best, agreement(samples, order, s.vehicle, lag));
    return best;
  };
  const Order as_given{0, 1, 2, 3};
  const double given = best_lag(as_given);
  if (given > 1.0 - kFarBetter) return;
  Order order = as_given, best_order = as_given;
  double best = given;
  while (std::next_permutation(order.begin(), order.end()))
    if (const double a = best_lag(order); a > best) best = a, best_order = order;
  if (best < kAgrees || best < given + kFarBetter) return;
  std::vector<std::size_t> moved;
  for (std::size_t k = 0; k < 4; ++k)
    if (best_order[k] != k) moved.push_back(k + 1);
  std::string likely;
  if (moved.size() == 2) {
    likely = fmt::format("the columns of rotor {} and rotor {} are exchanged", moved[0], moved[1]);
  } else {
    for (std::size_t k = 0; k < 4; ++k)
      likely += fmt::format("{}rotor {} is in the column of rotor {}", likely.empty() ? "" : ", ", k + 1, best_order[k] + 1);
  }
  s.refuse(stream_name::rotors,
           fmt::format("the speeds turn the vehicle as it turned in roll and pitch by {:.2f} (correlation; allowed {:.1f} to 1), by {:.2f} "
                       "when read as stated below",
                       given, kAgrees, best),
           s.span(), likely,
           "give the columns in this order: 1 front right, 2 rear left, 3 front left, 4 rear right; check [[rotor]] in the vehicle file");
}

}  // namespace rotorloop::log
