// Which rotor is which: the speeds of a column must turn the vehicle as a rotor at that hub would. Roll and pitch acceleration against
// the moments of the speeds, in the order given and in all others; how large the inertia is does not matter to a correlation.
// Judged between 2 and 15 Hz: below, the moments of drag and of inflow, which go with the velocity, are as large as those of the speeds.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/sysid/log/check/check_moments.hpp"
#include "bench/sysid/log/check/flight_content.hpp"
#include "bench/sysid/log/check/stream_access.hpp"

namespace rotorloop::log {
namespace {

using RotorOrder = std::array<std::size_t, 4>;  // rotor k is what the column of rotor order[k] shows
constexpr RotorOrder kAsGiven{0, 1, 2, 3};

// Where the order is judged, and how plain the answer must be.
struct OrderBand {
  double low_hz, high_hz;
  double longest_lag_s;   // of the speeds behind the rates: streams of measured logs are up to 50 ms off against each other
  double least_rad_s;     // rms of roll rate and of pitch rate in the band
  double agrees, better;  // what the best order must reach, and by how much it must beat the order given
};
// Set on the nano-drone's runs, where the right order reaches 0.58 to 0.96 and leads by at least 0.23; judged on all other flights.
// Half of the turning that the promise asks for, since gyro noise alone shows 0.02 rad/s at most there.
constexpr OrderBand kOrderBand{
    .low_hz = kTurningLow_hz, .high_hz = kTurningHigh_hz, .longest_lag_s = 0.06, .least_rad_s = 0.05, .agrees = 0.6, .better = 0.15};
// Of a vehicle that turns, but slowly. 62 clean measured flights: where another order reaches 0.8 there, the given one has 0.88.
constexpr OrderBand kSlowOrderBand{.low_hz = 0.0, .high_hz = 5.0, .longest_lag_s = 0.15, .least_rad_s = 0.05, .agrees = 0.8, .better = 0.3};

struct OrderSignals {
  std::array<std::vector<double>, 2> turning;  // roll and pitch acceleration, rad/s²
  std::array<std::vector<double>, 4> square;   // ω² of each column, over its median
  std::vector<char> valid;
  double dt_s = 0.0;
  double least_rad_s = 0.0;  // the smaller of roll's and pitch's rms rate
};

std::vector<double> above(std::vector<double> v, double dt_s, double low_hz) {
  if (low_hz <= 0.0) return v;
  const std::vector<double> slow = low_pass(v, dt_s, low_hz);
  for (std::size_t i = 0; i < v.size(); ++i) v[i] -= slow[i];
  return v;
}

// `grid` and `in_flight`: where the vehicle flies.
OrderSignals order_signals(const CheckState& s, const Grid& grid, const std::vector<char>& in_flight, const OrderBand& band) {
  const CheckState turning{
      .record = turning_streams(s.record), .vehicle = s.vehicle, .limits = s.limits, .result = {}, .unusable = s.unusable};
  const FlightGrid g = make_grid(turning, band.high_hz);
  OrderSignals out;
  if (!g.has_rotors || (!g.has_gyro && !g.has_attitude)) return out;
  out.dt_s = g.grid.dt_s;
  out.valid = g.valid;
  for (std::size_t i = 0; i < out.valid.size(); ++i) out.valid[i] = out.valid[i] && in_flight[grid.nearest(g.grid.t_s(i))];
  if (band.low_hz > 0.0) out.valid = shrunk(out.valid, out.dt_s, 0.5 / band.low_hz);
  const auto& rate = g.has_gyro ? g.gyro_B_rad_s : g.pose_rate_B_rad_s;
  out.least_rad_s = HUGE_VAL;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    std::vector<double> v(g.grid.count);
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = rate[i][static_cast<Eigen::Index>(axis)];
    v = above(std::move(v), out.dt_s, band.low_hz);
    double square = 0.0, n = 0.0;
    for (std::size_t i = 0; i < v.size(); ++i)
      if (out.valid[i]) square += v[i] * v[i], n += 1.0;
    out.least_rad_s = std::min(out.least_rad_s, std::sqrt(square / std::max(1.0, n)));
    out.turning[axis] = derivative(v, out.dt_s);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    std::vector<double> q(g.grid.count), usual;
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i] = g.omega_rad_s[i][k] * g.omega_rad_s[i][k];
      if (out.valid[i]) usual.push_back(q[i]);
    }
    const double scale = 1.0 / (median(std::move(usual)) + 1e-9);
    for (double& x : q) x *= scale;
    out.square[k] = above(std::move(q), out.dt_s, band.low_hz);
  }
  return out;
}

// Covariances of turning with the columns, and of the columns, at one lag.
struct OrderSums {
  Eigen::Matrix<double, 2, 4> cross = Eigen::Matrix<double, 2, 4>::Zero();
  Eigen::Matrix4d columns = Eigen::Matrix4d::Zero();
  Eigen::Vector2d turning = Eigen::Vector2d::Zero();
  double seconds = 0.0;

  // Mean of the correlations of roll and of pitch.
  double agreement(const RotorOrder& order, const host::VehicleModel& vehicle) const {
    double sum = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
      Eigen::Vector4d arm = Eigen::Vector4d::Zero();
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector3d hub = vehicle.arm_m(static_cast<int>(k));
        arm[static_cast<Eigen::Index>(order[k])] = axis == 0 ? hub.y() : -hub.x();
      }
      sum += cross.row(axis).dot(arm) / std::sqrt(turning[axis] * arm.dot(columns * arm) + 1e-30);
    }
    return 0.5 * sum;
  }
};

OrderSums order_sums(const OrderSignals& f, std::ptrdiff_t lag) {
  constexpr std::ptrdiff_t kEvery = 4;  // 100 Hz, for what ends at 15 Hz
  OrderSums out;
  Eigen::Vector2d mean_turning = Eigen::Vector2d::Zero();
  Eigen::Vector4d mean_square = Eigen::Vector4d::Zero();
  const auto n = static_cast<std::ptrdiff_t>(f.valid.size());
  double count = 0.0;
  for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, -lag); i < n - std::max<std::ptrdiff_t>(0, lag); i += kEvery) {
    const auto at = static_cast<std::size_t>(i), shown = static_cast<std::size_t>(i + lag);
    if (!f.valid[at] || !f.valid[shown]) continue;
    const Eigen::Vector2d turning(f.turning[0][at], f.turning[1][at]);
    const Eigen::Vector4d square(f.square[0][shown], f.square[1][shown], f.square[2][shown], f.square[3][shown]);
    mean_turning += turning;
    mean_square += square;
    out.cross += turning * square.transpose();
    out.columns += square * square.transpose();
    out.turning += turning.cwiseAbs2();
    count += 1.0;
  }
  if (count == 0.0) return out;
  out.cross -= mean_turning * mean_square.transpose() / count;
  out.columns -= mean_square * mean_square.transpose() / count;
  out.turning -= mean_turning.cwiseAbs2() / count;
  out.seconds = count * static_cast<double>(kEvery) * f.dt_s;
  return out;
}

struct OrderFound {
  RotorOrder order = kAsGiven;
  double best = -1.0, given = -1.0;  // at one lag: at a lag of its own an order of the wrong sign finds half a period
};

OrderFound best_order(const OrderSignals& f, const OrderBand& band, const host::VehicleModel& vehicle) {
  constexpr double kLeast_s = 2.0;
  constexpr std::ptrdiff_t kStep = 2;
  OrderFound found;
  const auto reach = static_cast<std::ptrdiff_t>(band.longest_lag_s / f.dt_s) / kStep * kStep;
  for (std::ptrdiff_t lag = -reach; lag <= reach; lag += kStep) {
    const OrderSums sums = order_sums(f, lag);
    if (sums.seconds < kLeast_s) continue;
    RotorOrder order = kAsGiven;
    do {
      if (const double a = sums.agreement(order, vehicle); a > found.best) found = {order, a, sums.agreement(kAsGiven, vehicle)};
    } while (std::next_permutation(order.begin(), order.end()));
  }
  return found;
}

std::string order_words(const RotorOrder& order, bool has_attitude) {
  std::string words;
  std::vector<std::size_t> moved;
  for (std::size_t k = 0; k < 4; ++k) {
    if (order[k] == k) continue;
    moved.push_back(k + 1);
    words += fmt::format("{}rotor {} is in the column of rotor {}", words.empty() ? "" : ", ", k + 1, order[k] + 1);
  }
  if (moved.size() == 2) words = fmt::format("the columns of rotor {} and rotor {} are exchanged", moved[0], moved[1]);
  // What turned axes of the body do to roll and pitch, these orders do too; attitude and path would have shown pitch alone reversed.
  if (order == RotorOrder{3, 2, 1, 0} && !has_attitude)
    words += "; or the gyro is in forward-right-down axes: then give body = \"FRD\" in the mapping's [axes]";
  if (order == RotorOrder{1, 0, 3, 2}) words += "; or x of gyro and attitude points to the rear";
  return words;
}

}  // namespace

void check_rotor_order(CheckState& s, const Grid& grid, const std::vector<char>& in_flight) {
  for (const OrderBand& band : {kOrderBand, kSlowOrderBand}) {
    const OrderSignals signals = order_signals(s, grid, in_flight, band);
    if (signals.valid.empty()) return;
    if (signals.least_rad_s < band.least_rad_s) continue;
    const OrderFound found = best_order(signals, band, s.vehicle);
    if (found.order == kAsGiven || found.best < band.agrees || found.best < found.given + band.better) return;
    s.refuse(
        stream_name::rotors,
        fmt::format("the speeds turn the vehicle as it turned in roll and pitch by {:.2f} between {:.0f} and {:.0f} Hz (correlation; "
                    "allowed within {:.2f} of the best order), by {:.2f} when read as stated below",
                    found.given, band.low_hz, band.high_hz, band.better, found.best),
        s.span(), order_words(found.order, !s.record.pose.empty()),
        fmt::format("give the columns in this order: 1 front right, 2 rear left, 3 front left, 4 rear right. In the mapping's stream of "
                    "rotor_speed that is your column {}, {}, {}, {}; or check [[rotor]] in the vehicle file",
                    found.order[0] + 1, found.order[1] + 1, found.order[2] + 1, found.order[3] + 1));
    return;
  }
}

}  // namespace rotorloop::log
