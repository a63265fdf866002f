#include "bench/hil/calibrate/tunnel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/base/error.hpp"
#include "sim/plant/flight_dynamics.hpp"

namespace rotorloop::calibrate {

LoadPoint Tunnel::measure(const Eigen::Vector3d& v_B_m_s, const std::array<double, 4>& omega_rad_s) const {
  return balance(v_B_m_s, omega_rad_s, true);
}
LoadPoint Tunnel::measure_bare(const Eigen::Vector3d& v_B_m_s) const { return balance(v_B_m_s, {}, false); }

LoadPoint Tunnel::balance(const Eigen::Vector3d& v_B_m_s, const std::array<double, 4>& omega_rad_s, bool propellers) const {
  const sim::Rotors rotors = sim::pointers(rotors_);
  sim::PlantSetup setup = sim::plant_setup(plant_, rotors, 500'000, 1);
  sim::EffectSet effects = sim::effect_set(plant_);
  effects.prepare(setup);
  setup.body.wind_W_m_s = -v_B_m_s;  // the vehicle is held level, the air moves
  sim::AirframeState held;
  held.p_W_m.z() = 100.0;
  sim::FlightDynamics dynamics(setup, rotors, std::move(effects), held, 1'000'000'000);
  if (propellers) dynamics.evaluate_rotors(omega_rad_s);
  dynamics.step(std::array<double, 4>{});
  const sim::AirframeWrench& w = dynamics.airframe().wrench();
  return {.v_B_m_s = v_B_m_s,
          .omega_rad_s = omega_rad_s,
          .force_B_N = w.rotor_force_B_N + w.drag_force_B_N + w.further.force_B_N,
          .torque_B_N_m = w.rotor_moment_B_N_m + w.further.moment_B_N_m};
}

LoadPoint Tunnel::measure_at_force(const Eigen::Vector3d& v_B_m_s, double force_z_N, double max_omega_rad_s) const {
  double low = 1.0, high = max_omega_rad_s;
  LoadPoint p = measure(v_B_m_s, {high, high, high, high});
  if (!(p.force_B_N.z() >= force_z_N))
    throw Error({"tunnel",
                 fmt::format("{:.2f} N along z is not reached at {:.0f} rad/s, velocity ({:.1f}, {:.1f}, {:.1f}) m/s", force_z_N,
                             max_omega_rad_s, v_B_m_s.x(), v_B_m_s.y(), v_B_m_s.z()),
                 "the planned flight asks more than the rotors can give", "plan a slower flight or a lighter vehicle"},
                ExitCode::data_quality);
  for (int k = 0; k < 60 && high - low > 1e-6; ++k) {
    const double omega = 0.5 * (low + high);
    p = measure(v_B_m_s, {omega, omega, omega, omega});
    (p.force_B_N.z() < force_z_N ? low : high) = omega;
  }
  return p;
}

double Tunnel::highest_omega_rad_s() const {
  double radius_m = 0.0;
  for (const auto& rotor : rotors_) radius_m = std::max(radius_m, rotor->radius_m());
  return 158.75 / radius_m;
}

std::vector<LoadPoint> run_programme(const Tunnel& tunnel, const std::vector<FlightState>& planned, double weight_N) {
  std::vector<LoadPoint> points;
  for (const double v : {2.0, 4.0, 6.0, 8.0, 10.0})
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
        velocity[axis] = sign * v;
        points.push_back(tunnel.measure_bare(velocity));
      }
  const double hover = tunnel.measure_at_force(Eigen::Vector3d::Zero(), weight_N, tunnel.highest_omega_rad_s()).omega_rad_s[0];
  for (const double share : {0.6, 0.8, 0.9, 1.0, 1.1, 1.2, 1.4}) {
    const double w = share * hover;
    points.push_back(tunnel.measure(Eigen::Vector3d::Zero(), {w, w, w, w}));
  }
  for (const double difference : {-0.15, -0.1, -0.05, 0.05, 0.1, 0.15}) {
    const double up = hover * (1.0 + difference), down = hover * (1.0 - difference);
    points.push_back(tunnel.measure(Eigen::Vector3d::Zero(), {up, up, down, down}));
  }
  for (const FlightState& s : planned) points.push_back(tunnel.measure_at_force(s.v_B_m_s, s.force_z_N, tunnel.highest_omega_rad_s()));
  return points;
}

}  // namespace rotorloop::calibrate
