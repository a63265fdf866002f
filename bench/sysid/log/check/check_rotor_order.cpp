// Which rotor is which: the speeds of a column must turn the vehicle as a rotor at that hub would. Roll and pitch acceleration against
// the moments of the speeds, in the order given and in all others; how large the inertia is does not matter to a correlation.
// Judged between 2 and 15 Hz: below, the moments of drag and of inflow, which go with the velocity, are as large as those of the speeds.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

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
      if (out.valid[i]) {
        square += v[i] * v[i];
        n += 1.0;
      }
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

// Products of turning with the columns, and of the columns, at one lag; their covariances once the means are taken out.
struct OrderSums {
  Eigen::Matrix<double, 2, 4> cross = Eigen::Matrix<double, 2, 4>::Zero();
  Eigen::Matrix4d columns = Eigen::Matrix4d::Zero();
  Eigen::Vector2d turning = Eigen::Vector2d::Zero(), sum_turning = Eigen::Vector2d::Zero();
  Eigen::Vector4d sum_square = Eigen::Vector4d::Zero();
  double count = 0.0, seconds = 0.0;

  OrderSums& operator+=(const OrderSums& o) {
    cross += o.cross;
    columns += o.columns;
    turning += o.turning;
    sum_turning += o.sum_turning;
    sum_square += o.sum_square;
    count += o.count;
    seconds += o.seconds;
    return *this;
  }
  OrderSums centred() const {
    OrderSums c = *this;
    if (count == 0.0) return c;
    c.cross -= sum_turning * sum_square.transpose() / count;
    c.columns -= sum_square * sum_square.transpose() / count;
    c.turning -= sum_turning.cwiseAbs2() / count;
    return c;
  }
  // Mean of the correlations of roll and of pitch; of centred sums.
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

// In pieces of `piece_s` of the flight, one behind the other.
std::vector<OrderSums> order_sums(const OrderSignals& f, std::ptrdiff_t lag, double piece_s) {
  constexpr std::ptrdiff_t kEvery = 4;  // 100 Hz, for what ends at 15 Hz
  const auto n = static_cast<std::ptrdiff_t>(f.valid.size());
  std::vector<OrderSums> out(static_cast<std::size_t>(static_cast<double>(n) * f.dt_s / piece_s) + 1);
  for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, -lag); i < n - std::max<std::ptrdiff_t>(0, lag); i += kEvery) {
    const auto at = static_cast<std::size_t>(i), shown = static_cast<std::size_t>(i + lag);
    if (!f.valid[at] || !f.valid[shown]) continue;
    const Eigen::Vector2d turning(f.turning[0][at], f.turning[1][at]);
    const Eigen::Vector4d square(f.square[0][shown], f.square[1][shown], f.square[2][shown], f.square[3][shown]);
    OrderSums& piece = out[std::min(out.size() - 1, static_cast<std::size_t>(static_cast<double>(at) * f.dt_s / piece_s))];
    piece.sum_turning += turning;
    piece.sum_square += square;
    piece.cross += turning * square.transpose();
    piece.columns += square * square.transpose();
    piece.turning += turning.cwiseAbs2();
    piece.count += 1.0;
    piece.seconds += static_cast<double>(kEvery) * f.dt_s;
  }
  return out;
}

struct OrderFound {
  RotorOrder order = kAsGiven;
  double best = -1.0, given = -1.0;  // at one lag: at a lag of its own an order of the wrong sign finds half a period
};

// Lags up to the longest, two samples apart.
template <class Visit>
void for_each_lag(const OrderSignals& f, const OrderBand& band, Visit&& visit) {
  constexpr std::ptrdiff_t kStep = 2;
  const auto reach = static_cast<std::ptrdiff_t>(band.longest_lag_s / f.dt_s) / kStep * kStep;
  for (std::ptrdiff_t lag = -reach; lag <= reach; lag += kStep) visit(lag);
}

OrderFound best_order(const OrderSignals& f, const OrderBand& band, const host::VehicleModel& vehicle) {
  constexpr double kLeast_s = 2.0;
  OrderFound found;
  for_each_lag(f, band, [&](std::ptrdiff_t lag) {
    const OrderSums sums = order_sums(f, lag, HUGE_VAL).front().centred();
    if (sums.seconds < kLeast_s) return;
    RotorOrder order = kAsGiven;
    do {
      if (const double a = sums.agreement(order, vehicle); a > found.best) found = {order, a, sums.agreement(kAsGiven, vehicle)};
    } while (std::next_permutation(order.begin(), order.end()));
  });
  return found;
}

// Columns that stand one, two or three places further on from a second on: a telemetry that lost a part of a message and goes on with
// what it takes for the first rotor.
struct Slip {
  double from_s = 0.0;  // since the begin of the grid
  RotorOrder order = kAsGiven;
  double before = 0.0, given_after = 0.0, after = 0.0;  // agreements: as given before, as given after, as found after
  double mean = 0.0;                                    // of `before` and `after` by their times
};

std::optional<Slip> find_slip(const OrderSignals& f, const OrderBand& band, const host::VehicleModel& vehicle) {
  // By how much each part must prefer its own order tells more than how well it agrees: parts of calm flights reach 0.45.
  constexpr double kPiece_s = 0.5, kLeast_s = 2.0, kBetter = 0.3, kAgrees = 0.4;
  constexpr std::array<RotorOrder, 3> kShifted{RotorOrder{1, 2, 3, 0}, RotorOrder{2, 3, 0, 1}, RotorOrder{3, 0, 1, 2}};
  std::optional<Slip> found;
  double most = 0.0;
  for_each_lag(f, band, [&](std::ptrdiff_t lag) {
    const std::vector<OrderSums> pieces = order_sums(f, lag, kPiece_s);
    std::vector<OrderSums> rest(pieces.size() + 1);
    for (std::size_t i = pieces.size(); i-- > 0;) {
      rest[i] = rest[i + 1];
      rest[i] += pieces[i];
    }
    OrderSums first;
    for (std::size_t at = 1; at < pieces.size(); ++at) {
      first += pieces[at - 1];
      if (first.seconds < kLeast_s || rest[at].seconds < kLeast_s) continue;
      const OrderSums a = first.centred(), b = rest[at].centred();
      const double before = a.agreement(kAsGiven, vehicle), given_after = b.agreement(kAsGiven, vehicle);
      for (const RotorOrder& order : kShifted) {
        const double after = b.agreement(order, vehicle), weight = before * a.seconds + after * b.seconds;
        const bool plain =
            before >= kAgrees && after >= kAgrees && after >= given_after + kBetter && before >= a.agreement(order, vehicle) + kBetter;
        if (plain && weight > most) {
          most = weight;

          found = Slip{kPiece_s * static_cast<double>(at), order, before, given_after, after, weight / (a.seconds + b.seconds)};
        }
      }
    }
  });
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
    // One order for the whole flight goes before two that do no better.
    constexpr double kBetterThanOne = 0.1;
    if (const auto slip = find_slip(signals, band, s.vehicle); slip && slip->mean > found.best + kBetterThanOne) {
      const double t0_s = grid.t_s(0);
      s.refuse(
          stream_name::rotors,
          fmt::format("the speeds turn the vehicle as it turned by {:.2f} up to {:.1f} s, and by {:.2f} from there on (correlation), where "
                      "columns that stand {} further on do so by {:.2f}",
                      slip->before, t0_s + slip->from_s, slip->given_after,
                      slip->order[0] == 1   ? "one place"
                      : slip->order[0] == 2 ? "two places"
                                            : "three places",
                      slip->after),
          {t0_s + slip->from_s, s.span().to_s}, "a telemetry that lost a part of a message and goes on with the wrong rotor",
          fmt::format("give the part of the log before {:.1f} s, or log again", t0_s + slip->from_s));
      return;
    }
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
