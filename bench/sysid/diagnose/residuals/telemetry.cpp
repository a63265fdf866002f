#include "bench/sysid/diagnose/residuals/telemetry.hpp"

#include <algorithm>
#include <cmath>

#include "bench/sysid/diagnose/residuals/samples.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"

namespace rotorloop::diagnose {
namespace {

using Eigen::Vector3d;

void close(TelemetryResidual& t) {
  const auto n = static_cast<double>(t.t_s.size());
  for (std::size_t a = 0; a < 3; ++a) {
    double sum = 0.0;
    for (const double v : t.value[a]) sum += v;
    t.mean[static_cast<Eigen::Index>(a)] = n > 0.0 ? sum / n : 0.0;
    t.rms[static_cast<Eigen::Index>(a)] = std::sqrt(mean_square(t.value[a]));
  }
}

}  // namespace

void add_telemetry(const estimate::GridFlight& g, const estimate::ModelValues& values, const estimate::NoiseModel& noise,
                   const std::vector<estimate::BodyState>& states, const log::FlightRecord* log, std::vector<TelemetryResidual>& out) {
  const estimate::Model model(values);
  estimate::RotorInput input = g.input;
  input.prepare(values);
  const Vector3d gyro_bias(values[estimate::kGyroBiasX], values[estimate::kGyroBiasY], values[estimate::kGyroBiasZ]);
  const Vector3d accel_bias(values[estimate::kAccelBiasX], values[estimate::kAccelBiasY], values[estimate::kAccelBiasZ]);
  const Vector3d place(values[estimate::kImuX], values[estimate::kImuY], values[estimate::kImuZ]);
  std::size_t hint = 0;
  const auto rates = [&](std::size_t k) -> Vector3d { return states[k].w_B_rad_s + gyro_bias; };
  const auto specific_force = [&](std::size_t k) -> Vector3d {
    const double t = g.time_s(k);
    const estimate::Instant now = model.instant(states[k], input.at(t, hint, false), t);
    const Vector3d& w = states[k].w_B_rad_s;
    return now.specific_force_B_m_s2 + now.angular_acceleration_B_rad_s2.cross(place) + w.cross(w.cross(place)) + accel_bias;
  };
  const auto add = [&](TelemetryResidual& t, double at_s, const Vector3d& difference) {
    t.t_s.push_back(at_s);
    for (std::size_t a = 0; a < 3; ++a) t.value[a].push_back(difference[static_cast<Eigen::Index>(a)]);
  };
  const auto compare = [&](const char* stream, const char* unit, const std::vector<estimate::VectorFix>& fitted,
                           const log::Stream<Vector3d>* logged, const Vector3d& assumed, auto&& expected) {
    TelemetryResidual t{.flight = g.name, .stream = stream, .unit = unit, .fitted = !fitted.empty(), .t_s = {}, .value = {}};
    if (t.fitted) {
      t.assumed = assumed;
      for (const estimate::VectorFix& f : fitted) {
        const std::size_t other = estimate::neighbour(g, f);
        const Vector3d at_node = expected(f.node);
        const Vector3d there = other == f.node ? at_node : Vector3d(at_node + std::fabs(f.late_s) / g.step_s * (expected(other) - at_node));
        add(t, g.time_s(f.node) + f.late_s, f.value - there);
      }
    } else if (logged) {
      std::size_t known = g.nodes;  // expected() at this node and the next
      Vector3d from = Vector3d::Zero(), to = Vector3d::Zero();
      for (std::size_t i = 0; i < logged->size(); ++i) {
        const double at = (logged->t_s[i] - g.start_s) / g.step_s;
        if (at < 0.0 || at >= static_cast<double>(g.nodes - 1)) continue;
        const auto k = static_cast<std::size_t>(at);
        if (!g.linked[k]) continue;
        if (k != known) {
          from = expected(k);
          to = expected(k + 1);
          known = k;
        }
        add(t, logged->t_s[i], logged->value[i] - from - (at - static_cast<double>(k)) * (to - from));
      }
    }
    if (t.t_s.empty()) return;
    close(t);
    out.push_back(std::move(t));
  };
  compare("gyro", "rad/s", g.gyro, log ? &log->gyro_B_rad_s : nullptr, noise.gyro_rad_s, rates);
  compare("accelerometer", "m/s2", g.accel, log ? &log->accel_B_m_s2 : nullptr, noise.accel_m_s2, specific_force);
}

}  // namespace rotorloop::diagnose
