// What is measured of a closed RPM loop, on any native ESC: a step, the response to small sines, a supply that falls. Speeds are the
// plant's true ones.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "firmware/core/interface.hpp"
#include "sim/esc/native_esc.hpp"

namespace rotorloop::esc_lab {

inline constexpr double kRpm = 2.0 * std::numbers::pi / 60.0;  // rad/s
inline constexpr int kPeriodsPerMs = 24;

inline firmware::Setpoint speed(double rad_s) { return {firmware::Mode::speed, static_cast<float>(rad_s)}; }

// `each_period`: with the time since the call, ms.
template <class Esc>
void run_ms(Esc& esc, double ms, const std::function<void(double)>& each_period = {}) {
  const int n = static_cast<int>(ms * kPeriodsPerMs + 0.5);
  for (int k = 0; k < n; ++k) {
    esc.step_current_loop();
    if (each_period) each_period((k + 1) / static_cast<double>(kPeriodsPerMs));
  }
}

// 10 to 90 %, within 2 % for good, beyond the aim; `from` and `to` in the unit of the samples.
class StepMeter {
 public:
  StepMeter(double from, double to) : from_(from), to_(to) {}
  void add(double ms, double value) {
    const double x = (value - from_) / (to_ - from_);
    if (t10_ms_ < 0.0 && x >= 0.1) t10_ms_ = ms;
    if (t90_ms_ < 0.0 && x >= 0.9) t90_ms_ = ms;
    if (std::fabs(x - 1.0) > 0.02) settle_ms_ = ms;
    overshoot_percent_ = std::max(overshoot_percent_, 100.0 * (x - 1.0));
  }
  double rise_ms() const { return t90_ms_ < 0.0 ? 1e9 : t90_ms_ - t10_ms_; }  // 1e9: never there
  double settle_ms() const { return settle_ms_; }
  double overshoot_percent() const { return overshoot_percent_; }

 private:
  double from_, to_, t10_ms_ = -1.0, t90_ms_ = -1.0, settle_ms_ = 0.0, overshoot_percent_ = 0.0;
};

// Gain of the closed loop for a sine of ±amplitude around the speed that `esc` holds: a copy of it, so that every frequency begins alike.
template <class Esc>
double closed_loop_gain(Esc esc, double centre_rad_s, double amplitude_rad_s, double frequency_Hz) {
  const double w = 2.0 * std::numbers::pi * frequency_Hz;
  const double settle_ms = std::max(100.0, 2000.0 / frequency_Hz);
  const double measure_ms = std::ceil(300.0 * frequency_Hz / 1000.0) * 1000.0 / frequency_Hz;
  double sine = 0.0, cosine = 0.0;
  int n = 0;
  for (double t_ms = 0.0; t_ms < settle_ms + measure_ms;) {
    esc.set_setpoint(speed(centre_rad_s + amplitude_rad_s * std::sin(w * t_ms * 1e-3)));
    run_ms(esc, 0.25);
    t_ms += 0.25;
    if (t_ms > settle_ms) {
      const double d = esc.omega_rad_s() - centre_rad_s;
      sine += d * std::sin(w * t_ms * 1e-3);
      cosine += d * std::cos(w * t_ms * 1e-3);
      ++n;
    }
  }
  return 2.0 * std::hypot(sine, cosine) / (n * amplitude_rad_s);
}

inline constexpr double kMinus3dB = std::numbers::sqrt2 / 2.0;
struct GainPoint {
  double frequency_Hz, gain;
};
struct Bandwidth {
  double minus_3dB_Hz = 200.0;  // the highest frequency tried, when the gain is still above
  std::vector<GainPoint> points;
};

// First frequency at which the gain has fallen by 3 dB. `all`: the points beyond it too, for a plot.
template <class Esc>
Bandwidth closed_loop_bandwidth(const Esc& settled, double centre_rad_s, double amplitude_rad_s, bool all = false) {
  Bandwidth b;
  double last_Hz = 5.0, last_gain = 1.0;
  bool found = false;
  for (const double f : {5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0, 120.0, 150.0, 200.0}) {
    const double gain = closed_loop_gain(settled, centre_rad_s, amplitude_rad_s, f);
    b.points.push_back({f, gain});
    if (!found && gain < kMinus3dB) {
      b.minus_3dB_Hz = last_Hz + (f - last_Hz) * (last_gain - kMinus3dB) / (last_gain - gain + 1e-12);
      found = true;
      if (!all) break;
    }
    last_Hz = f;
    last_gain = gain;
  }
  return b;
}

// Bus from `high_V` to `low_V` in one second. Returns the largest deviation in percent of the speed before.
template <class Esc>
double sag_percent(Esc& esc, double load_N_m_s2, double high_V, double low_V, const std::function<void(double ms)>& each = {}) {
  const double before = esc.omega_rad_s();
  double worst = 0.0;
  for (int half_ms = 0; half_ms < 2400; ++half_ms) {
    esc.couple_quadratic(load_N_m_s2, high_V - (high_V - low_V) * std::min(1.0, half_ms / 2000.0));
    for (int k = 0; k < kPeriodsPerMs / 2; ++k) esc.step_current_loop();
    worst = std::max(worst, 100.0 * std::fabs(esc.omega_rad_s() / before - 1.0));
    if (each) each(0.5 * (half_ms + 1));
  }
  return worst;
}

}  // namespace rotorloop::esc_lab
