// Rotor speeds against what the vehicle does: when it stood on the ground, and a rotor that reads nothing or a fraction for a while, both
// without a thrust model. What hover, order and moments tell is in files of its own; their order is here.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/sysid/log/check/check_moments.hpp"
#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"
#include "host/base/constants.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::log {
namespace {

constexpr double kRotorCorner_hz = 5.0;
constexpr double kGroundMargin_s = 0.5;  // spool-up past the weight, the bounce of a landing

RotorValues squares(const RotorValues& w) { return {w[0] * w[0], w[1] * w[1], w[2] * w[2], w[3] * w[3]}; }
double middle_of_four(RotorValues v) {
  std::sort(v.begin(), v.end());
  return 0.5 * (v[1] + v[2]);
}

// Specific force along the thrust axis, from the accelerometer or from the path.
std::vector<double> specific_force_up(const FlightGrid& g) {
  std::vector<double> f(g.grid.count);
  for (std::size_t i = 0; i < f.size(); ++i) {
    const Eigen::Vector3d gravity = kGravity_m_s2 * Eigen::Vector3d::UnitZ();
    if (g.has_accel)
      f[i] = g.accel_B_m_s2[i].z();
    else if (g.has_attitude)
      f[i] = (g.q_WB[i].conjugate() * (g.position_acc_W_m_s2[i] + gravity)).z();
    else
      f[i] = (g.position_acc_W_m_s2[i] + gravity).norm();
  }
  return f;
}

// Something that grows with thrust: the middle of the four squared speeds (one dead rotor does not move it), or of the commands.
std::vector<double> lift_figure(const CheckState& s, const FlightGrid& g) {
  std::vector<double> lift(g.grid.count);
  if (g.has_rotors) {
    for (std::size_t i = 0; i < lift.size(); ++i) lift[i] = middle_of_four(squares(g.omega_rad_s[i]));
    return lift;
  }
  const auto& m = s.record.motor_command;
  std::vector<double> c[4];
  for (std::size_t k = 0; k < 4; ++k) c[k] = low_pass(on_grid(m.t_s, channel(m, k), g.grid), g.grid.dt_s, kRotorCorner_hz);
  for (std::size_t i = 0; i < lift.size(); ++i) lift[i] = middle_of_four({c[0][i], c[1][i], c[2][i], c[3][i]});
  return lift;
}

// On the ground the accelerometer shows one g whatever the rotors do; in the air it shows what they lift. So: lift far below what
// the specific force asks for, and the stretches around it in which the vehicle does not move.
void find_ground(CheckState& s, const FlightGrid& g, const std::vector<double>& up, std::vector<char>& airborne) {
  constexpr double kFarBelow = 0.55, kBelow = 0.9, kAtRest_m_s = 0.05;
  const std::vector<double> lift = lift_figure(s, g);
  const double high = quantile(lift, 0.95);
  std::vector<double> ratio(g.grid.count), flying;
  for (std::size_t i = 0; i < ratio.size(); ++i) {
    ratio[i] = lift[i] / std::max(1.0, up[i]);
    if (lift[i] > 0.3 * high && up[i] > 0.5 * kGravity_m_s2) flying.push_back(ratio[i]);
  }
  const double usual = median(std::move(flying));
  if (!(usual > 0.0)) return;
  const auto slower_than = [&](double speed_m_s, double turning_rad_s, std::size_t i) {
    const Eigen::Vector3d v = g.has_velocity ? g.velocity_W_m_s[i] : g.has_position ? g.position_rate_W_m_s[i] : Eigen::Vector3d::Zero();
    return v.norm() < speed_m_s && (!g.has_gyro || g.gyro_B_rad_s[i].norm() < turning_rad_s);
  };
  std::vector<char> ground(g.grid.count, 0);
  for (std::size_t i = 0; i < ground.size(); ++i)
    ground[i] = ratio[i] < kFarBelow * usual && std::abs(up[i] / kGravity_m_s2 - 1.0) < 0.2 && slower_than(0.3, 1.0, i);
  const auto grow = [&](std::size_t from, std::size_t to) {
    if (ground[from] && !ground[to] && ratio[to] < kBelow * usual && slower_than(kAtRest_m_s, 0.15, to)) ground[to] = 1;
  };
  for (std::size_t i = 1; i < ground.size(); ++i) grow(i - 1, i);
  for (std::size_t i = ground.size() - 1; i > 0; --i) grow(i, i - 1);
  std::vector<double> t(g.grid.count);
  for (std::size_t i = 0; i < t.size(); ++i) t[i] = g.grid.t_s(i);
  const TimeRange whole{t.front(), t.back()};
  std::vector<TimeRange> found;
  for (TimeRange r : stretches(t, ground, 0.5)) {
    if (r.span_s() < 0.1) continue;
    r.from_s = r.from_s - whole.from_s < 1.0 ? whole.from_s : r.from_s - kGroundMargin_s;  // nothing worth keeping in the last second
    r.to_s = whole.to_s - r.to_s < 1.0 ? whole.to_s : r.to_s + kGroundMargin_s;
    found.push_back(r);
  }
  for (const TimeRange& r : joined(found, 1.0)) {
    s.leave_out(stream_name::flight,
                fmt::format("on the ground, taking off or landing for {:.2f} s: the rotors lift less than the weight", r.span_s()), r);
    s.lose(r);
    for (std::size_t i = g.grid.nearest(r.from_s); i <= g.grid.nearest(r.to_s); ++i) airborne[i] = 0;
  }
}

// Angular acceleration in roll and pitch: what the vehicle did, and what the speeds would have done to it. The inertia is that of any
// quadrotor to a factor of 1.5: (0.45 ± 0.05) m l², with l half the distance of two rotors, for five vehicles of 27 g to 750 g.
class Turning {
 public:
  explicit Turning(const CheckState& s) : vehicle_(s.vehicle), g_(make_grid(s, 12.0)) {
    std::vector<double> sums;
    for (const RotorValues& w : g_.omega_rad_s) {
      const RotorValues q = squares(w);
      sums.push_back(4.0 * middle_of_four(q));
    }
    usual_ = median(std::move(sums)) + 1e-9;
  }
  bool known() const { return g_.has_gyro || g_.has_attitude; }
  // Squared difference within `r`, with the speeds as read over that with `rotor` put level with the others: above 1 the reading is
  // the worse explanation of what the vehicle did.
  double doubt(std::size_t rotor, TimeRange r) const {
    double as_read = 0.0, level = 0.0;
    for (std::size_t i = g_.grid.nearest(r.from_s); i <= g_.grid.nearest(r.to_s); ++i) {
      RotorValues q = squares(g_.omega_rad_s[i]);
      const Eigen::Vector2d did = seen(i);
      as_read += (did - implied(q)).squaredNorm();
      q[rotor] = 0.0;
      q[rotor] = (q[0] + q[1] + q[2] + q[3]) / 3.0;
      level += (did - implied(q)).squaredNorm();
    }
    return as_read / (level + 1e-9);
  }

 private:
  Eigen::Vector2d seen(std::size_t i) const {
    const auto& rate = g_.has_gyro ? g_.gyro_B_rad_s : g_.pose_rate_B_rad_s;
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, rate.size() - 1);
    return ((rate[b] - rate[a]) / (g_.grid.dt_s * static_cast<double>(b - a))).head<2>();
  }
  Eigen::Vector2d implied(const RotorValues& q) const {
    Eigen::Vector2d moment = Eigen::Vector2d::Zero();  // per mass
    double arm2 = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d arm = vehicle_.arm_m(static_cast<int>(k));
      moment += kGravity_m_s2 * q[k] / usual_ * Eigen::Vector2d(arm.y(), -arm.x());
      arm2 += 0.25 * 0.5 * arm.head<2>().squaredNorm();
    }
    return moment / (0.45 * arm2);
  }
  const host::VehicleModel& vehicle_;
  FlightGrid g_;
  double usual_ = 0.0;  // Σω² that carries the weight
};

bool any_within(const std::vector<double>& t_s, const std::vector<char>& flag, TimeRange r) {
  for (std::size_t i = 0; i < t_s.size(); ++i)
    if (flag[i] && r.contains(t_s[i])) return true;
  return false;
}

// A rotor that reads far from the other three for longer than a spike, while the vehicle does not turn as that would make it: the
// reading fails, not the rotor.
void find_failing_rotor(CheckState& s, const FlightGrid& g, const std::vector<char>& airborne) {
  constexpr double kLow = 0.6, kHigh = 1.6, kDead = 0.2;
  constexpr double kLongest_s = 0.05;
  constexpr double kAtLimit_s = 0.15;  // a mixer that saturates holds a rotor at its lower limit for some motor time constants of 50 ms
  constexpr double kDoubt = 2.0;
  if (!(s.vehicle.mass_kg > 0.0)) return;  // no vehicle: how far it would turn is unknown
  const Turning turning(s);
  auto& w = s.record.rotor_omega_rad_s;
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    std::vector<char> bad(w.size(), 0), dead(w.size(), 0);
    std::vector<double> share;
    std::size_t in_flight = 0, zero = 0;
    for (std::size_t i = 0; i < w.size(); ++i) {
      if (!airborne[g.grid.nearest(w.t_s[i])]) continue;
      ++in_flight;
      std::array<double, 3> others{};
      for (std::size_t k = 0, n = 0; k < 4; ++k)
        if (k != rotor) others[n++] = w.value[i][k];
      std::sort(others.begin(), others.end());
      const double v = w.value[i][rotor];
      bad[i] = v < kLow * others[0] || v > kHigh * others[2];
      dead[i] = v < kDead * others[0];
      zero += dead[i] ? 1 : 0;
      if (bad[i] && !dead[i]) share.push_back(v / others[1]);
    }
    std::vector<TimeRange> ranges = stretches(w.t_s, bad, 0.1);
    std::erase_if(ranges, [&](const TimeRange& r) {
      const bool nothing = any_within(w.t_s, dead, r);
      return r.span_s() < (nothing ? kLongest_s : kAtLimit_s) || (turning.known() && turning.doubt(rotor, r) < kDoubt);
    });
    if (ranges.empty() || in_flight == 0) continue;
    const double usual = median(share);
    double lost_s = 0.0;
    ranges = joined(std::move(ranges), 0.5);
    const double air_s = static_cast<double>(in_flight) * period_s(w);
    for (const TimeRange& r : ranges) lost_s += r.span_s();
    const std::string name = fmt::format("rotor {} speed", rotor + 1);
    std::string what;
    if (zero > 0)
      what += fmt::format("reads less than a fifth of the others in {:.0f} % of its samples in flight",
                          100.0 * static_cast<double>(zero) / static_cast<double>(in_flight));
    if (!share.empty())
      what += fmt::format("{}reads {:.3g} times the middle of the others in {:.0f} %", what.empty() ? "" : ", ", usual,
                          100.0 * static_cast<double>(share.size()) / static_cast<double>(in_flight));
    what += ", while the vehicle flies on";
    if (lost_s > 0.5 * air_s) {
      s.refuse(name, what + fmt::format("; {:.1f} of {:.1f} s of flight are lost (allowed half)", lost_s, air_s),
               {ranges.front().from_s, ranges.back().to_s},
               std::abs(usual - 0.5) < 0.06 && !share.empty()
                   ? "an optical or telemetry sensor that misses every second pulse, or loses the rotor"
                   : "the speed sensor or telemetry of this rotor",
               "repair the sensor and fly again; or fit from the motor commands, leaving this stream out of the mapping");
      continue;
    }
    for (const TimeRange& r : ranges) {
      s.exclude(name, what, r);
      s.lose(r);
    }
  }
}

}  // namespace

void check_rotors(CheckState& s) {
  const FlightGrid g = make_grid(s, kRotorCorner_hz);
  if (g.grid.count < 100 || (!g.has_rotors && s.record.motor_command.empty()) || (!g.has_accel && !g.has_position)) return;
  const std::vector<double> up = specific_force_up(g);
  std::vector<char> airborne(g.grid.count, 1);
  find_ground(s, g, up, airborne);
  if (!g.has_rotors) return;
  const auto leave_unusable = [&] {
    for (const TimeRange& u : s.unusable)
      for (std::size_t i = g.grid.nearest(u.from_s); i <= g.grid.nearest(u.to_s); ++i) airborne[i] = 0;
  };
  leave_unusable();
  check_rotor_slip(s, g.grid, airborne);
  if (!s.refused()) check_rotor_order(s, g.grid, airborne);
  if (s.refused()) return;
  find_failing_rotor(s, g, airborne);
  if (s.refused()) return;
  leave_unusable();
  check_rotor_scale(s, g, airborne);
  if (s.refused()) return;
  leave_unusable();
  check_hover(s, g, up, airborne);
}

}  // namespace rotorloop::log
