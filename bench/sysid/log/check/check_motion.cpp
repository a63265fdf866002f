// Position, velocity, attitude and accelerometer agree on one motion: what the position does twice differentiated is what the
// accelerometer shows turned by the attitude, or, without one, what the tilt of the thrust axis does to a vehicle of its weight.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "bench/sysid/log/check/check_steps.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::log {
namespace {

constexpr double kMotionCorner_hz = 3.0;  // position is differentiated twice: millimetres at 3 Hz are 0.4 m/s²

using Vectors = std::vector<Eigen::Vector3d>;

// How `seen` follows `expected`, at the best lag: gain, correlation, and the turn about z that fits best.
struct Likeness {
  double gain = 0.0, correlation = 0.0, turn_rad = 0.0, correlation_turned = 0.0, expected_rms = 0.0;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // correlation axis by axis
};

Likeness likeness(const Vectors& seen, const Vectors& expected, const std::vector<char>& valid, double dt_s, double longest_lag_s) {
  Likeness best;
  const auto reach = static_cast<std::ptrdiff_t>(longest_lag_s / dt_s);
  const auto n = static_cast<std::ptrdiff_t>(seen.size());
  for (std::ptrdiff_t lag = -reach; lag <= reach; lag += 4) {
    Eigen::Vector3d ss = Eigen::Vector3d::Zero(), ee = ss, se = ss, ms = ss, me = ss;
    double cross = 0.0, count = 0.0;
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, lag); i < n + std::min<std::ptrdiff_t>(0, lag); i += 2) {
      const auto is = static_cast<std::size_t>(i), ie = static_cast<std::size_t>(i - lag);
      if (!valid[is] || !valid[ie]) continue;
      const Eigen::Vector3d &a = seen[is], &b = expected[ie];
      ms += a;
      me += b;
      ss += a.cwiseAbs2();
      ee += b.cwiseAbs2();
      se += a.cwiseProduct(b);
      cross += b.x() * a.y() - b.y() * a.x();
      count += 1.0;
    }
    if (count < 50.0) continue;
    cross -= (me.x() * ms.y() - me.y() * ms.x()) / count;
    ss -= ms.cwiseAbs2() / count;
    ee -= me.cwiseAbs2() / count;
    se -= ms.cwiseProduct(me) / count;
    const double scale = std::sqrt(ss.sum() * ee.sum()) + 1e-30;
    const double straight = se.x() + se.y();
    const double turned = (std::hypot(straight, cross) + se.z()) / scale;
    if (std::max(turned, std::abs(se.sum()) / scale) <= std::max(best.correlation_turned, std::abs(best.correlation))) continue;
    best.correlation = se.sum() / scale;
    best.correlation_turned = turned;
    best.turn_rad = std::atan2(cross, straight);
    best.gain = std::sqrt(ss.sum() / (ee.sum() + 1e-30));
    best.expected_rms = std::sqrt(ee.sum() / count);
    best.axis = se.cwiseQuotient((ss.cwiseProduct(ee)).cwiseSqrt() + Eigen::Vector3d::Constant(1e-30));
  }
  return best;
}

// A right-handed turn of axes onto axes: position's x, y, z are sign × the attitude world's axes.
struct AxisOrder {
  std::array<int, 3> axis{0, 1, 2};
  std::array<int, 3> sign{1, 1, 1};
  double correlation = -1.0;  // of what is seen, so turned, with what is expected
};

std::vector<AxisOrder> axis_orders() {
  std::vector<AxisOrder> all;
  std::array<int, 3> axis{0, 1, 2};
  do {
    const int parity = (axis[0] - axis[1]) * (axis[1] - axis[2]) * (axis[2] - axis[0]) > 0 ? 1 : -1;
    for (int bits = 0; bits < 8; ++bits) {
      const std::array<int, 3> sign{bits & 1 ? -1 : 1, bits & 2 ? -1 : 1, bits & 4 ? -1 : 1};
      if (sign[0] * sign[1] * sign[2] * parity > 0) all.push_back({axis, sign, -1.0});
    }
  } while (std::next_permutation(axis.begin(), axis.end()));
  return all;
}

// The turn of axes with which `seen` follows `expected` best, over the lags, and how well it does as it is read: means of the axes'
// correlations, so that the axis along which the vehicle moves most does not speak for the others.
std::pair<AxisOrder, double> best_axes(const Vectors& seen, const Vectors& expected, const std::vector<char>& valid, double dt_s,
                                       double longest_lag_s) {
  static const std::vector<AxisOrder> kOrders = axis_orders();
  constexpr double kLeast_m_s2 = 0.1;
  AxisOrder best;
  double as_read = -1.0;
  const auto reach = static_cast<std::ptrdiff_t>(longest_lag_s / dt_s), n = static_cast<std::ptrdiff_t>(seen.size());
  for (std::ptrdiff_t lag = -reach; lag <= reach; lag += 4) {
    Eigen::Vector3d ms = Eigen::Vector3d::Zero(), me = ms, ss = ms, ee = ms;
    Eigen::Matrix3d se = Eigen::Matrix3d::Zero();
    double count = 0.0;
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, lag); i < n + std::min<std::ptrdiff_t>(0, lag); i += 2) {
      const auto is = static_cast<std::size_t>(i), ie = static_cast<std::size_t>(i - lag);
      if (!valid[is] || !valid[ie]) continue;
      ms += seen[is];
      me += expected[ie];
      ss += seen[is].cwiseAbs2();
      ee += expected[ie].cwiseAbs2();
      se += seen[is] * expected[ie].transpose();
      count += 1.0;
    }
    if (count < 50.0) continue;
    ss -= ms.cwiseAbs2() / count;
    ee -= me.cwiseAbs2() / count;
    se -= ms * me.transpose() / count;
    for (AxisOrder order : kOrders) {
      double sum = 0.0, axes = 0.0;
      for (int k = 0; k < 3; ++k) {  // an axis along which hardly anything moves tells nothing
        const int a = order.axis[static_cast<std::size_t>(k)];
        if (ee(k) < kLeast_m_s2 * kLeast_m_s2 * count || ss(a) < kLeast_m_s2 * kLeast_m_s2 * count) continue;
        sum += order.sign[static_cast<std::size_t>(k)] * se(a, k) / std::sqrt(ss(a) * ee(k));
        axes += 1.0;
      }
      if (axes < 2.0) continue;
      order.correlation = sum / axes;
      if (order.correlation > best.correlation) best = order;
      if (order.axis == AxisOrder{}.axis && order.sign == AxisOrder{}.sign) as_read = std::max(as_read, order.correlation);
    }
  }
  return {best, as_read};
}

std::string axes_text(const AxisOrder& o) {
  std::string text;
  for (std::size_t k = 0; k < 3; ++k)
    text += fmt::format("{}{} is {}{}", k == 0 ? "" : ", ", "xyz"[k], o.sign[k] < 0 ? "-" : "", "xyz"[o.axis[k]]);
  return text;
}

struct Unit {
  double factor;
  const char *length, *speed;
};
constexpr Unit kUnits[] = {{1000.0, "in mm, read as m", "in mm/s, read as m/s"},
                           {100.0, "in cm, read as m", "in cm/s, read as m/s"},
                           {0.001, "in m, converted from mm once too often", "in m/s, converted from mm/s once too often"}};

const Unit* unit_of(double gain) {
  for (const Unit& u : kUnits)
    if (gain > 0.5 * u.factor && gain < 2.0 * u.factor) return &u;
  return nullptr;
}

bool refuse_position_unit(CheckState& s, double gain, const std::string& what) {
  const Unit* u = unit_of(gain);
  if (u) s.refuse(stream_name::position, what, s.span(), fmt::format("position is {}", u->length), "give its unit in the mapping");
  return u != nullptr;
}

// A velocity a thousand times the rate of the position: which of the two is wrong only a third sensor decides, the acceleration that the
// position shows. Where it has spoken the position is right.
void refuse_velocity_unit(CheckState& s, double gain, const std::string& what, bool position_is_right) {
  const Unit *speed = unit_of(gain), *length = unit_of(1.0 / gain);
  if (!speed && !length) return;
  std::string likely = speed ? fmt::format("velocity is {}", speed->speed) : "";
  if (length && !position_is_right) likely += fmt::format("{}position is {}", likely.empty() ? "" : "; or ", length->length);
  if (!likely.empty()) s.refuse(stream_name::velocity, what, s.span(), likely, "give the unit in the mapping");
}

void check_velocity(CheckState& s, const FlightGrid& g, bool position_is_right) {
  const Likeness as_read = likeness(g.velocity_W_m_s, g.position_rate_W_m_s, g.valid, g.grid.dt_s, s.limits.longest_lag_s);
  if (std::min(as_read.expected_rms, as_read.expected_rms * as_read.gain) < 0.05 && as_read.gain < 10.0 && as_read.gain > 0.1) return;
  const std::string what = fmt::format("agrees with the rate of the position by {:.2f} (allowed 0.7 to 1), {:.3g} times as large",
                                       as_read.correlation, as_read.gain);
  if (as_read.correlation > 0.7) {
    refuse_velocity_unit(s, as_read.gain, what, position_is_right);
    return;
  }
  if (g.has_attitude) {
    Vectors turned(g.velocity_W_m_s.size());
    for (std::size_t i = 0; i < turned.size(); ++i) turned[i] = g.q_WB[i] * g.velocity_W_m_s[i];
    const Likeness body = likeness(turned, g.position_rate_W_m_s, g.valid, g.grid.dt_s, s.limits.longest_lag_s);
    if (body.correlation > 0.9) {
      s.refuse(stream_name::velocity, what + fmt::format("; {:.2f} when turned by the attitude", body.correlation), s.span(),
               "velocity is in body axes", "give its frame as body in the mapping");
      return;
    }
  }
  if (as_read.correlation < 0.3 && as_read.correlation_turned > 0.85)
    s.refuse(stream_name::velocity,
             what + fmt::format("; {:.2f} when turned by {:.0f} deg about z", as_read.correlation_turned,
                                -as_read.turn_rad * 180.0 / std::numbers::pi),
             s.span(), "velocity and position in different world frames", "give the frames in the mapping");
  else
    s.note(stream_name::velocity, what, s.span());
}

// A position whose axes are turned against the attitude's: exports that turn one of the two, or neither where both should be.
bool refuse_other_axes(CheckState& s, const FlightGrid& g, const Vectors& expected, const std::string& what) {
  constexpr double kPlain = 0.5, kBetter = 0.3;
  const auto [axes, as_read] = best_axes(g.position_acc_W_m_s2, expected, g.valid, g.grid.dt_s, s.limits.longest_lag_s);
  if (axes.correlation < kPlain || axes.correlation < as_read + kBetter) return false;
  const bool y_up = axes.axis[2] == 1 && axes.sign[2] > 0;
  s.refuse(
      stream_name::position,
      what + fmt::format("; the mean of its axes is {:.2f}, and {:.2f} where, of the attitude's axes, {} of the position", as_read,
                         axes.correlation, axes_text(axes)),
      s.span(), y_up ? "a position with y up (Motive, Unity) beside an attitude with z up" : "position and attitude have other axes",
      fmt::format(
          "give the position's columns in the order that this says, with sign = [{}, {}, {}], in the mapping's stream of position or pose",
          axes.sign[0], axes.sign[1], axes.sign[2]));
  return true;
}

// False when the flight moves too little to decide.
bool check_acceleration(CheckState& s, const FlightGrid& g) {
  Vectors expected(g.grid.count), seen = g.position_acc_W_m_s2;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Eigen::Vector3d up = g.q_WB[i] * Eigen::Vector3d::UnitZ();
    if (g.has_accel) {
      expected[i] = g.q_WB[i] * g.accel_B_m_s2[i] - kGravity_m_s2 * Eigen::Vector3d::UnitZ();
    } else {  // as if the vertical part were weight alone: right at moderate tilt, and what a unit or a sign would spoil is larger
      expected[i] = kGravity_m_s2 * Eigen::Vector3d(up.x(), up.y(), 0.0) / std::max(0.3, up.z());
      seen[i].z() = 0.0;
    }
  }
  const Likeness l = likeness(seen, expected, g.valid, g.grid.dt_s, s.limits.longest_lag_s);
  if (l.expected_rms < 0.3) return false;  // too little motion to judge by
  const char* by = g.has_accel ? "accelerometer turned by the attitude" : "tilt of the attitude";
  const std::string what =
      fmt::format("its acceleration agrees with the {} by {:.2f} (allowed 0.5 to 1), {:.3g} times as large", by, l.correlation, l.gain);
  const bool strange = l.gain > 30.0 || l.gain < 0.03;
  if ((l.correlation > 0.5 || strange) && refuse_position_unit(s, l.gain, what)) return true;
  const double turn_deg = l.turn_rad * 180.0 / std::numbers::pi;
  if (l.correlation_turned > 0.75 && std::abs(turn_deg) > 30.0) {
    const bool opposite = std::abs(turn_deg) > 150.0;
    std::string likely = "position and attitude are given in different world frames, or x and y are exchanged";
    std::string remedy = "give the quaternion's direction and the frames in the mapping";
    if (opposite) {
      likely = "tilting forward moves it backward: the quaternion is the conjugate (world to body), or an axis has the wrong sign";
      remedy = "give direction = \"world_to_body\" in the mapping's [[stream]] of pose, or the frames";
      if (!g.has_accel) {
        likely += ", or world and body are north-east-down and forward-right-down";
        remedy += ": world = \"NED\" and body = \"FRD\" in [axes]";
      }
    }
    s.refuse(stream_name::pose, what + fmt::format("; {:.2f} when turned by {:.0f} deg about z", l.correlation_turned, turn_deg), s.span(),
             likely, remedy);
    return true;
  }
  if (l.axis.x() < -0.5 || l.axis.y() < -0.5) {
    const bool half_turn = l.axis.x() > 0.0 && l.axis.y() < 0.0 && l.axis.z() < 0.0;
    s.refuse(stream_name::position, what + fmt::format("; axis by axis {:.2f}, {:.2f}, {:.2f}", l.axis.x(), l.axis.y(), l.axis.z()),
             s.span(),
             half_turn ? "the position is north-east-down, the attitude's world frame has z up"
                       : "an axis of the position has the wrong sign (east-north-up against north-west-up?)",
             half_turn ? "give world = \"NED\" in the mapping for what is logged so, and sign = [1, -1, -1] where a pose has both"
                       : "give the frame of the position in the mapping");
    return true;
  }
  if (refuse_other_axes(s, g, expected, what)) return true;
  if (l.correlation < 0.5) s.note(stream_name::position, what, s.span());
  return l.correlation > 0.5 && !strange;
}

}  // namespace

void check_motion(CheckState& s) {
  const FlightGrid g = make_grid(s, kMotionCorner_hz);
  if (!g.has_position) return;
  const bool position_is_right = g.has_attitude && check_acceleration(s, g);
  if (g.has_velocity && !s.refused()) check_velocity(s, g, position_is_right);
}

}  // namespace rotorloop::log
