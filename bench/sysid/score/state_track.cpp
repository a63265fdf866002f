#include "bench/sysid/score/state_track.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "bench/sysid/log/check/signal.hpp"
#include "bench/sysid/score/preprocess.hpp"
#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

// `dimensions` numbers of each sample of a stream on the grid, filtered; row k is the grid's k.
template <class Value>
std::vector<std::vector<double>> gridded(const log::Stream<Value>& s, std::size_t dimensions, const log::Grid& g, double cutoff_Hz,
                                         const std::function<double(const Value&, std::size_t)>& number) {
  std::vector<std::vector<double>> out;
  for (std::size_t d = 0; d < dimensions; ++d) {
    std::vector<double> x;
    for (const Value& v : s.value) x.push_back(number(v, d));
    out.push_back(log::on_grid(s.t_s, x, g));
    if (cutoff_Hz > 0.0) out.back() = zero_phase_low_pass(out.back(), cutoff_Hz, 1.0 / g.dt_s);
  }
  return out;
}

template <class Value>
void want(const log::FlightRecord& r, const log::Stream<Value>& s, const char* what, std::size_t least = 2) {
  if (s.size() >= least) return;
  throw Error({.where = r.source.empty() ? r.name : r.source,
               .what = fmt::format("{} samples of {}; a track of states needs at least {}", s.size(), what, least),
               .likely = "the log does not hold it, or the mapping file does not name its columns",
               .remedy = "score predictions on a flight that has pose, rates and rotor speeds"},
              ExitCode::data_quality);
}

// Central differences, one-sided at the ends.
std::vector<std::vector<double>> slopes(const std::vector<std::vector<double>>& x, const log::Grid& g) {
  std::vector<std::vector<double>> out;
  for (const auto& row : x) out.push_back(log::derivative(row, g.dt_s));
  return out;
}

// Signs of neighbouring quaternions agree, so that they can be filtered as four numbers.
log::Stream<log::PoseReading> one_sign(const log::Stream<log::PoseReading>& pose) {
  log::Stream<log::PoseReading> s = pose;
  for (std::size_t k = 1; k < s.size(); ++k) {
    auto& q = s.value[k].q_WS;
    if (q.dot(s.value[k - 1].q_WS) < 0.0) q.coeffs() = -q.coeffs();
  }
  return s;
}

log::Stream<log::RotorValues> clean_rotors(const log::Stream<log::RotorValues>& s, const TrackFilter& f, const log::Grid& g) {
  log::Stream<log::RotorValues> out;
  for (std::size_t k = 0; k < g.count; ++k) out.add(g.t_s(k), {});
  for (std::size_t r = 0; r < 4; ++r) {
    std::vector<double> x;
    for (const log::RotorValues& v : s.value) x.push_back(v[r]);
    bridge_spikes(x, f.largest_rotor_rad_s, f.largest_rotor_jump_rad_s);
    x = log::on_grid(s.t_s, x, g);
    if (f.rotor_Hz > 0.0) x = zero_phase_low_pass(x, f.rotor_Hz, 1.0 / g.dt_s);
    for (std::size_t k = 0; k < g.count; ++k) out.value[k][r] = x[k];
  }
  return out;
}

}  // namespace

StateTrack filtered_track(const log::FlightRecord& r, const TrackFilter& f) {
  want(r, r.pose, "pose");
  want(r, r.gyro_B_rad_s, "angular rate");
  want(r, r.rotor_omega_rad_s, "rotor speed");
  const double from = std::max({r.pose.t_s.front(), r.gyro_B_rad_s.t_s.front(), r.rotor_omega_rad_s.t_s.front()});
  const double to = std::min({r.pose.t_s.back(), r.gyro_B_rad_s.t_s.back(), r.rotor_omega_rad_s.t_s.back()});
  const double span = std::max(0.0, to - from);
  const log::Grid g{from, 1.0 / f.rate_Hz, static_cast<std::size_t>(std::floor(span * f.rate_Hz + 1e-6)) + 1};

  const auto position = gridded<log::PoseReading>(
      r.pose, 3, g, f.position_Hz, [](const log::PoseReading& p, std::size_t d) { return p.p_W_m[static_cast<Eigen::Index>(d)]; });
  const auto attitude = gridded<log::PoseReading>(one_sign(r.pose), 4, g, f.attitude_Hz, [](const log::PoseReading& p, std::size_t d) {
    return p.q_WS.coeffs()[static_cast<Eigen::Index>(d)];
  });
  const auto component = [](const Eigen::Vector3d& v, std::size_t d) { return v[static_cast<Eigen::Index>(d)]; };
  const auto rates = gridded<Eigen::Vector3d>(r.gyro_B_rad_s, 3, g, f.rates_Hz, component);
  const auto velocity =
      r.velocity_W_m_s.empty() ? slopes(position, g) : gridded<Eigen::Vector3d>(r.velocity_W_m_s, 3, g, f.velocity_Hz, component);

  log::FlightRecord rotors;
  rotors.name = r.name;
  rotors.source = r.source;
  rotors.battery_V = r.battery_V;
  rotors.rotor_omega_rad_s = clean_rotors(r.rotor_omega_rad_s, f, g);
  StateTrack track{r.name, g.t0_s, g.dt_s, {}, estimate::RotorInput(rotors)};
  for (std::size_t k = 0; k < g.count; ++k) {
    estimate::BodyState x;
    x.p_W_m = {position[0][k], position[1][k], position[2][k]};
    x.v_W_m_s = {velocity[0][k], velocity[1][k], velocity[2][k]};
    x.q_WB.coeffs() = Eigen::Vector4d{attitude[0][k], attitude[1][k], attitude[2][k], attitude[3][k]}.normalized();
    x.w_B_rad_s = {rates[0][k], rates[1][k], rates[2][k]};
    track.state.push_back(x);
  }
  return track;
}

StateTrack fitted_track(const estimate::GridFlight& flight, const std::vector<estimate::BodyState>& states,
                        const estimate::ModelValues& values) {
  StateTrack track{flight.name, flight.start_s, flight.step_s, states, flight.input};
  track.input.prepare(values);
  return track;
}

}  // namespace rotorloop::score
