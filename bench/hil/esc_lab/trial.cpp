#include "bench/hil/esc_lab/trial.hpp"

#include <algorithm>
#include <cmath>

#include "bench/hil/esc_lab/best_step.hpp"
#include "bench/hil/esc_lab/esc_run.hpp"
#include "host/base/random.hpp"

namespace rotorloop::esc_lab {
namespace {

constexpr std::uint64_t kStepStream = 0x45535354;

template <class Esc>
void start(EscRun<Esc>& run, const EscDraw& d, EscTrial& t) {
  const double goal = std::min(2000.0 * kRpm, 0.2 * t.top_rad_s);
  const double target = std::max(goal, static_cast<double>(d.firmware.min_speed_rad_s));
  run.count_anew();
  run.order(speed(target));
  const double allowed_ms = 3.0 * d.start_within_ms;
  run.run_ms(allowed_ms, [&](double ms) {
    if (t.start_ms > 1e8 && run.omega() >= 0.98 * goal) {
      t.start_ms = ms;
      t.start_peak_A = run.peak_A();
    }
  });
  t.start_trips = run.trips();
  t.start_peak_A = t.start_ms > 1e8 ? run.peak_A() : t.start_peak_A;
}

// Random steps every 50 to 300 ms for 4 s.
template <class Esc>
void fly(EscRun<Esc>& run, const EscDraw& d, EscTrial& t) {
  start(run, d, t);
  const RandomStream random(d.seed, kStepStream);
  const double low = d.motor_class == "5in" ? 1500.0 * kRpm : 0.15 * t.top_rad_s, high = 0.95 * t.top_rad_s;
  run.count_anew();
  double ms = 0.0;
  for (std::uint64_t k = 0; ms < 4000.0; k += 2) {
    const double for_ms = std::min(50.0 + 250.0 * random.uniform(k), 4000.0 - ms);
    run.order(speed(low + (high - low) * random.uniform(k + 1)));
    run.run_ms(for_ms);
    ms += for_ms;
  }
  t.trips = run.trips();
  t.peak_A = run.peak_A();
  t.longest_gap_ms = run.longest_gap_ms();
  run.order(speed(low));
  run.run_ms(1000.0);  // time enough for a start: what does not turn now is latched
  t.latched = run.omega() < 0.5 * low;
}

template <class Esc>
void step(EscRun<Esc>& run, const EscDraw& d, EscTrial& t) {
  start(run, d, t);
  const double from = 0.4 * t.top_rad_s, to = 0.6 * t.top_rad_s;
  run.order(speed(from));
  run.run_ms(1500.0);
  run.count_anew();
  run.order(speed(to));
  StepMeter meter(from, to);
  double sum = 0.0;
  int count = 0;
  const BestStep best = best_step(d, from, to);
  const double for_ms = std::max(400.0, 8.0 * best.reach_ms);
  run.run_ms(for_ms, [&](double ms) {
    meter.add(ms, run.omega());
    if (ms > for_ms - 200.0) {
      sum += 100.0 * (run.omega() / to - 1.0);
      ++count;
    }
  });
  t.rise_ms = meter.rise_ms();
  t.settle_ms = meter.settle_ms();
  t.overshoot_percent = meter.overshoot_percent();
  t.rise_ratio = t.rise_ms / best.rise_ms;
  t.settle_ratio = t.settle_ms / best.reach_ms;
  t.steady_percent = sum / std::max(count, 1);
  t.trips = run.trips();
  t.peak_A = run.peak_A();
  t.longest_gap_ms = run.longest_gap_ms();
}

// A rotor that already turns when the set-point comes: from -60 to +95 % of the top.
template <class Esc>
void catch_rotor(EscRun<Esc>& run, const EscDraw& d, EscTrial& t) {
  t.caught_from = -0.60 + 1.55 * RandomStream(d.seed, kStepStream).uniform(0);
  const double goal = 0.6 * t.top_rad_s;
  run.esc().drive().motor().state().omega_rad_s = t.caught_from * t.top_rad_s;
  run.count_anew();
  run.order(speed(goal));
  double last_off_ms = 0.0;
  run.run_ms(3000.0, [&](double ms) {
    if (std::fabs(run.omega() / goal - 1.0) > 0.02) last_off_ms = ms;
  });
  t.caught_ms = last_off_ms > 2999.0 ? 1e9 : last_off_ms;
  t.trips = run.trips();
  t.peak_A = run.peak_A();
}

template <class Esc>
EscTrial run_on(const EscDraw& d, const EscTrialSettings& s, EscTrace* trace) {
  EscTrial t;
  t.seed = d.seed;
  t.motor_class = d.motor_class;
  t.bus_V = d.bus_V;
  t.start_within_ms = d.start_within_ms;
  t.top_rad_s = highest_speed_rad_s(d);
  EscRun<Esc> run(d, s.ideal_board, trace);
  switch (s.experiment) {
    case EscExperiment::fly:
      fly(run, d, t);
      break;
    case EscExperiment::step:
      step(run, d, t);
      break;
    case EscExperiment::catch_rotor:
      catch_rotor(run, d, t);
      break;
  }
  t.causes = run.causes();
  return t;
}

}  // namespace

EscTrial run_esc_trial(const EscDraw& d, const EscTrialSettings& s, EscTrace* trace) {
  return with_esc_of(d.board, [&]<class Esc>() { return run_on<Esc>(d, s, trace); });
}

EscTrial run_esc_trial(const MotorClass& c, std::uint64_t seed, const EscTrialSettings& s) {
  return run_esc_trial(draw_esc(c, seed, s.knowledge), s);
}

double catch_limit_ms(const EscTrial& t) {
  if (t.motor_class != "5in") return t.start_within_ms;
  return t.caught_from >= 0.2 ? 150.0 : t.caught_from >= -0.2 ? 450.0 : 700.0;
}

bool step_within(const EscTrial& t) {
  return t.rise_ratio <= kMostRise && t.settle_ratio <= kMostSettle && t.overshoot_percent <= kMostOvershoot_percent &&
         std::abs(t.steady_percent) <= kMostSteady_percent && t.trips == 0;
}

}  // namespace rotorloop::esc_lab
