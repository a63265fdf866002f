// How much a flight turned, flew and climbed; see flight_content.hpp.
#include "bench/sysid/log/check/flight_content.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"
#include "host/base/constants.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::log {
namespace {

constexpr double kMotionContent_hz = 5.0;  // of speed, climb and thrust: positions are differentiated up to twice

std::vector<char> judged(const FlightGrid& g, const std::vector<TimeRange>& segments, double margin_s) {
  std::vector<char> out = g.valid;
  if (!segments.empty())
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = out[i] && std::any_of(segments.begin(), segments.end(), [&](const TimeRange& r) { return r.contains(g.grid.t_s(i)); });
  return shrunk(out, g.grid.dt_s, margin_s);
}

Eigen::Vector3d turning_rms(const FlightGrid& g, const std::vector<char>& in) {
  const auto& rate = g.has_gyro ? g.gyro_B_rad_s : g.pose_rate_B_rad_s;
  Eigen::Vector3d rms = Eigen::Vector3d::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> v(rate.size());
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = rate[i][axis];
    const std::vector<double> slow = low_pass(v, g.grid.dt_s, kTurningLow_hz);
    double square = 0.0, n = 0.0;
    for (std::size_t i = 0; i < v.size(); ++i)
      if (in[i]) {
        square += (v[i] - slow[i]) * (v[i] - slow[i]);
        n += 1.0;
      }
    rms[axis] = std::sqrt(square / std::max(1.0, n));
  }
  return rms;
}

double rms_of(const std::vector<double>& v) {
  double square = 0.0;
  for (const double x : v) square += x * x;
  return v.empty() ? 0.0 : std::sqrt(square / static_cast<double>(v.size()));
}

TimeRange most_of(const std::vector<double>& v) { return {quantile(v, 0.01), quantile(v, 0.99)}; }

void add_motion(FlightContent& c, const FlightGrid& g, const std::vector<char>& in) {
  std::vector<double> speed, climb, thrust;
  for (std::size_t i = 0; i < in.size(); ++i) {
    if (!in[i]) continue;
    if (g.has_velocity || g.has_position) {
      const Eigen::Vector3d& v = g.has_velocity ? g.velocity_W_m_s[i] : g.position_rate_W_m_s[i];
      speed.push_back(v.head<2>().norm());
      climb.push_back(v.z());
    }
    if (g.has_accel) {
      thrust.push_back(g.accel_B_m_s2[i].z());
    } else if (g.has_attitude) {
      const Eigen::Vector3d gravity = kGravity_m_s2 * Eigen::Vector3d::UnitZ();
      thrust.push_back((g.q_WB[i].conjugate() * (g.position_acc_W_m_s2[i] + gravity)).z());
    }
  }
  if (!speed.empty()) {
    c.speed_rms_m_s = rms_of(speed);
    c.speed_most_m_s = quantile(speed, 0.99);
    c.climb_rms_m_s = rms_of(climb);
    c.climb_m_s = most_of(climb);
  }
  if (!thrust.empty()) c.thrust_m_s2 = most_of(thrust);
}

}  // namespace

FlightContent flight_content(const FlightRecord& flight, const std::vector<TimeRange>& segments) {
  const host::VehicleModel no_vehicle;  // a pose sensor at the centre of mass; nothing else of it is asked
  const CheckLimits limits;
  const CheckState s{.record = flight, .vehicle = no_vehicle, .limits = limits, .result = {}};
  FlightContent out;
  const CheckState turning{.record = turning_streams(flight), .vehicle = no_vehicle, .limits = limits, .result = {}};
  if (const FlightGrid fast = make_grid(turning, kTurningHigh_hz); fast.has_gyro || fast.has_attitude) {
    const std::vector<char> in = judged(fast, segments, 0.5 / kTurningLow_hz);
    if (std::count(in.begin(), in.end(), char{1}) > 0) out.turning_rad_s = turning_rms(fast, in);
  }
  const FlightGrid slow = make_grid(s, kMotionContent_hz);
  if (slow.grid.count < 3) return out;
  const std::vector<char> in = judged(slow, segments, 0.0);
  for (const TimeRange& r : segments) out.seconds += r.span_s();
  if (segments.empty()) out.seconds = s.span().span_s();
  if (std::count(in.begin(), in.end(), char{1}) > 0) add_motion(out, slow, in);
  return out;
}

namespace {

// Above `enough` a parameter of this kind stands out of noise and of what the model lacks; below `little` it is lost in them.
// A rotor loses some 5 % of its thrust per m/s of climb, and drag is some 0.2 m/s^2 per m/s, while models and sensors are good to 1 %
// and 0.1 m/s^2: a few tenths of a metre per second are the least. 0.1 rad/s is what the check of the rotors' order asks for.
struct Need {
  double little, enough;
  const char* unit;
};
constexpr Need kTurningNeed{0.03, 0.1, "rad/s"}, kClimbNeed{0.1, 0.3, "m/s"}, kSpeedNeed{0.3, 1.0, "m/s"};

ParameterOutlook outlook_by(const char* parameter, const std::optional<double>& shown, const Need& need, const char* quantity) {
  if (!shown) return {parameter, Outlook::none, fmt::format("no stream shows the {}", quantity)};
  const Outlook o = *shown >= need.enough ? Outlook::enough : *shown >= need.little ? Outlook::little : Outlook::none;
  return {parameter, o, fmt::format("{} {:.2g} {} rms (wanted {:.2g})", quantity, *shown, need.unit, need.enough)};
}

}  // namespace

std::vector<ParameterOutlook> parameter_outlook(const FlightRecord& flight, const FlightContent& content) {
  const bool force = content.thrust_m_s2.has_value();
  const char* input = !flight.rotor_omega_rad_s.empty() ? ""
                      : !flight.motor_command.empty()   ? "motor commands instead of rotor speeds; "
                                                        : nullptr;
  std::vector<ParameterOutlook> out;
  out.push_back({"k_1", input && force ? Outlook::enough : Outlook::none, "the weight is carried in every flight"});
  out.push_back(outlook_by("k_2", content.climb_rms_m_s, kClimbNeed, "climb speed"));
  const auto turning = [&](Eigen::Index axis) {
    return content.turning_rad_s ? std::optional((*content.turning_rad_s)[axis]) : std::nullopt;
  };
  out.push_back(outlook_by("I_xx, centre of mass y", turning(0), kTurningNeed, "roll rate in 2 to 15 Hz"));
  out.push_back(outlook_by("I_yy, centre of mass x", turning(1), kTurningNeed, "pitch rate in 2 to 15 Hz"));
  out.push_back(outlook_by("I_zz, c_q, J_r", turning(2), kTurningNeed, "yaw rate in 2 to 15 Hz"));
  out.push_back(outlook_by("c_dh, c_dxy", content.speed_rms_m_s, kSpeedNeed, "horizontal speed"));
  out.push_back(outlook_by("c_dz", content.climb_rms_m_s, kSpeedNeed, "climb speed"));
  for (ParameterOutlook& p : out) {
    if (!input)
      p = {p.parameter, Outlook::none, "no rotor speeds and no motor commands: nothing says what the rotors did"};
    else
      p.because = input + p.because;
    if (input && !force && p.outlook != Outlook::none)
      p = {p.parameter, Outlook::none, "no accelerometer and no pose: nothing shows the force"};
  }
  return out;
}

std::vector<ParameterOutlook> best_of(const std::vector<std::vector<ParameterOutlook>>& flights) {
  std::vector<ParameterOutlook> out;
  for (const auto& f : flights)
    for (std::size_t i = 0; i < f.size(); ++i) {
      if (i == out.size())
        out.push_back(f[i]);
      else if (f[i].outlook > out[i].outlook)
        out[i] = f[i];
    }
  return out;
}

}  // namespace rotorloop::log
