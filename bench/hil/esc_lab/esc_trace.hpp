// What happened in one trial, four times a millisecond: for plots, never for a verdict.
#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "firmware/core/interface.hpp"

namespace rotorloop::esc_lab {

struct EscTrace {
  std::vector<double> t_s, omega_rad_s, order_rad_s, phase_A, torque_A, bus_V;  // true ones; order: not-a-number when there is none
  std::vector<firmware::MotorState> state;
  std::vector<firmware::Limiter> limiter;
  std::vector<firmware::Fault> fault;  // while it acts
  std::vector<bool> bridge;            // some gate may be on

  template <class Esc>
  void add(const Esc& esc, bool bridge_on, double time_s, double order) {
    const auto& s = esc.drive().motor().state();
    const firmware::Telemetry t = esc.telemetry();
    t_s.push_back(time_s);
    omega_rad_s.push_back(s.omega_rad_s);
    order_rad_s.push_back(order);
    phase_A.push_back(std::hypot(s.i_d_A, s.i_q_A));
    torque_A.push_back(s.i_q_A);
    bus_V.push_back(esc.drive().bus_V());
    state.push_back(t.state);
    limiter.push_back(t.limiter);
    fault.push_back(t.state == firmware::MotorState::fault || t.latched ? t.fault : firmware::Fault::none);
    bridge.push_back(bridge_on);
  }
};

inline constexpr int kPeriodsPerTracePoint = 6;

}  // namespace rotorloop::esc_lab
