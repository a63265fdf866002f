// The air above and below a disk has mass: the induced velocity follows a change of thrust only after tau, and until then the
// blades meet the old inflow. A step of rotor speed therefore overshoots in thrust. Apparent mass of the disk 0.849 pi rho R^3:
//   tau = factor * 0.849 R / (2 (U + v_i dU/dv_i)),  U = sqrt(v_xy^2 + (v_z + v_i)^2);  in hover 0.849 R / (4 v_i) = 1.6 ms here
// Thrust and torque come from the lagging inflow through the blades' own slopes at fixed rotor speed, which a second solve in a
// slightly faster climb gives: both change with the whole flow through the disk, climb and induced. Where the wake has rolled up
// (vortex ring) that flow hardly changes with climb; the last good slopes are kept there, in proportion to rotor speed.
// Source: Carpenter & Fridovich, NACA TN-3044, 1953.
#include <algorithm>
#include <array>
#include <cmath>

#include "host/base/elementary.hpp"
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/wake.hpp"
#include "sim/effects/rotor/what_if.hpp"

namespace rotorloop::sim {
namespace {

constexpr double kApparentMass = 0.849;     // over pi rho R^3
constexpr double kProbe_m_s = 0.5;          // climb of the second solve: far above the solver's error, small against v_i
constexpr double kLeastFlowShare = 0.2;     // of the probe that must reach the flow through the disk (half in hover)
constexpr double kLeastMassFlow_m_s = 1.0;  // keeps tau below 27 ms * factor when hardly any air moves

class DynamicInflow final : public Effect {
 public:
  explicit DynamicInflow(const EffectValues& v) : factor_(v[0]) {}

  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    if (factor_ == 0.0) return;
    Lag& lag = lag_[s.index];
    if (s.bare.status == InflowStatus::stopped || s.bare.status == InflowStatus::not_converged) {
      lag = {};
      return;
    }
    follow(lag, s);
    update_slopes(lag, s);
    const double omega = s.condition.omega_rad_s;
    loads.force_R_N.z() += lag.thrust_slope * omega * lag.excess_m_s;
    add_shaft_torque(loads, s.condition.spin, lag.torque_slope * omega * lag.excess_m_s);
    loads.induced_m_s += lag.excess_m_s;
  }

 private:
  struct Lag {
    bool started = false;
    double time_s = 0.0;
    double steady_m_s = 0.0;    // induced velocity of the solve at time_s
    double excess_m_s = 0.0;    // true induced velocity above that
    double thrust_slope = 0.0;  // N per (m/s of inflow) per (rad/s)
    double torque_slope = 0.0;  // N m per (m/s of inflow) per (rad/s)
  };

  // First-order lag, exact for a steady value that changes linearly between two evaluations.
  void follow(Lag& lag, const RotorSite& s) const {
    const double now_s = s.body->time_s, steady_m_s = s.bare.induced_m_s, dt_s = now_s - lag.time_s;
    if (lag.started && dt_s > 0.0) {
      const double tau_s = time_constant_s(s), decay = exp_exact(-dt_s / tau_s);
      lag.excess_m_s = decay * lag.excess_m_s - (steady_m_s - lag.steady_m_s) / dt_s * tau_s * (1.0 - decay);
    }
    lag.started = true;
    lag.time_s = now_s;
    lag.steady_m_s = steady_m_s;
  }

  double time_constant_s(const RotorSite& s) const {
    const double edge_m_s = edgewise_m_s(s.condition), through_m_s = s.condition.v_R_m_s.z() + s.bare.induced_m_s;
    const double flow_m_s = std::sqrt(edge_m_s * edge_m_s + through_m_s * through_m_s);
    const double stiffness_m_s = flow_m_s > 0.0 ? flow_m_s + s.bare.induced_m_s * through_m_s / flow_m_s : 0.0;
    return factor_ * kApparentMass * s.rotor->radius_m() / (2.0 * std::max(stiffness_m_s, kLeastMassFlow_m_s));
  }

  void update_slopes(Lag& lag, const RotorSite& s) {
    RotorCondition climbing = s.condition;
    climbing.v_R_m_s.z() += kProbe_m_s;
    const RotorLoads probe = what_if_(s, climbing);
    const double flow_m_s = kProbe_m_s + probe.induced_m_s - s.bare.induced_m_s;
    if (probe.status == InflowStatus::not_converged || flow_m_s < kLeastFlowShare * kProbe_m_s) return;
    const double per = 1.0 / (flow_m_s * s.condition.omega_rad_s);
    lag.thrust_slope = (probe.force_R_N.z() - s.bare.force_R_N.z()) * per;
    lag.torque_slope = (probe.shaft_torque_N_m - s.bare.shaft_torque_N_m) * per;
  }

  double factor_;
  WhatIf what_if_;
  std::array<Lag, kAirframeRotors> lag_{};
};

}  // namespace

const EffectInfo kDynamicInflow{
    .id = "dynamic_inflow", .parameter = {"tau_factor", "1", 0.0, 5.0, 0.0}, .options = {}, .make = make_effect<DynamicInflow>};

}  // namespace rotorloop::sim
