// One ESC of a draw, run and watched: counts of what went wrong, and a trace when one is wanted.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "bench/hil/esc_lab/closed_loop.hpp"
#include "bench/hil/esc_lab/esc_trace.hpp"
#include "bench/hil/esc_lab/motor_classes.hpp"

namespace rotorloop::esc_lab {

inline sim::NativeEscConfig native_config(const EscDraw& d, bool ideal_board = false) {
  sim::NativeEscConfig c;
  c.drive = d.drive;
  c.firmware = d.firmware;
  c.bus_V = d.bus_V;
  c.seed = d.seed;
  c.typical_board = !ideal_board;
  return c;
}

template <class Esc>
class EscRun {
 public:
  EscRun(const EscDraw& d, bool ideal_board, EscTrace* trace = nullptr) : esc_(native_config(d, ideal_board)), trace_(trace) {
    esc_.couple_quadratic(d.load_N_m_s2, d.bus_V);
    run_ms(60.0);  // boot: zeros of the current sensors, self-test
  }
  Esc& esc() { return esc_; }
  double omega() const { return esc_.omega_rad_s(); }
  void order(const firmware::Setpoint& s) {
    esc_.set_setpoint(s);
    order_rad_s_ = s.mode == firmware::Mode::speed ? static_cast<double>(s.value) : std::numeric_limits<double>::quiet_NaN();
  }

  template <class Each>
  void run_ms(double ms, const Each& each) {
    const int periods = static_cast<int>(ms * kPeriodsPerMs + 0.5);
    for (int k = 0; k < periods; ++k) {
      esc_.step_current_loop();
      watch();
      each((k + 1) / static_cast<double>(kPeriodsPerMs));
    }
  }
  void run_ms(double ms) {
    run_ms(ms, [](double) {});
  }
  // Forgets what was counted.
  void count_anew() {
    trips_ = 0;
    peak_A_ = 0.0;
    gap_ = longest_gap_ = 0;
  }

  int trips() const { return trips_; }
  const std::string& causes() const { return causes_; }
  double peak_A() const { return peak_A_; }
  double longest_gap_ms() const { return longest_gap_ / static_cast<double>(kPeriodsPerMs); }

 private:
  void watch() {
    const firmware::Telemetry t = esc_.telemetry();
    const bool fault = t.state == firmware::MotorState::fault;
    if (fault && !in_fault_) {
      ++trips_;
      causes_ += static_cast<char>('0' + static_cast<int>(t.fault));
    }
    in_fault_ = fault;
    const bool controlled = t.state == firmware::MotorState::running || t.state == firmware::MotorState::handover;
    gap_ = controlled ? 0 : gap_ + 1;
    longest_gap_ = std::max(longest_gap_, gap_);
    const auto& s = esc_.drive().motor().state();
    peak_A_ = std::max(peak_A_, std::hypot(s.i_d_A, s.i_q_A));
    ++periods_;
    if (trace_ != nullptr && periods_ % kPeriodsPerTracePoint == 0)
      trace_->add(esc_, esc_.board().bridge, periods_ / (1000.0 * kPeriodsPerMs), order_rad_s_);
  }

  Esc esc_;
  EscTrace* trace_ = nullptr;
  double order_rad_s_ = std::numeric_limits<double>::quiet_NaN(), peak_A_ = 0.0;
  int trips_ = 0, gap_ = 0, longest_gap_ = 0, periods_ = 0;
  std::string causes_;
  bool in_fault_ = false;
};

}  // namespace rotorloop::esc_lab
