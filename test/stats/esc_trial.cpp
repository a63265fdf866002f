#include "test/stats/esc_trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "host/base/random.hpp"
#include "sim/esc/native_esc.hpp"
#include "test/stats/esc_limits.hpp"

namespace rotorloop::stats {
namespace {

constexpr double kRpm = std::numbers::pi / 30.0;
constexpr int kPeriodsPerMs = 24;
constexpr std::uint64_t kStepStream = 0x45535354;

firmware::Setpoint speed(double rad_s) { return {firmware::Mode::speed, static_cast<float>(rad_s)}; }

// One ESC with its counts of what went wrong.
template <class Esc>
class Bench {
 public:
  Bench(const EscDraw& d, bool ideal_board) : esc_(config(d, ideal_board)), load_N_m_s2_(d.load_N_m_s2), bus_V_(d.bus_V) {
    esc_.couple_quadratic(load_N_m_s2_, bus_V_);
    run_ms(20.0);  // boot: zeros of the current sensors
  }
  Esc& esc() { return esc_; }
  double omega() const { return esc_.omega_rad_s(); }

  template <class Each>
  void run_ms(double ms, const Each& each) {
    const int periods = static_cast<int>(ms * kPeriodsPerMs + 0.5);
    for (int k = 0; k < periods; ++k) {
      esc_.step_current_loop();
      ++periods_;
      const firmware::Telemetry t = esc_.telemetry();
      const bool fault = t.state == firmware::MotorState::fault;
      if (fault && !in_fault_) ++trips_, causes_ += static_cast<char>('0' + static_cast<int>(t.fault));
      in_fault_ = fault;
      const bool controlled = t.state == firmware::MotorState::running || t.state == firmware::MotorState::handover;
      gap_ = controlled ? 0 : gap_ + 1;
      longest_gap_ = std::max(longest_gap_, gap_);
      const auto& s = esc_.drive().motor().state();
      peak_A_ = std::max(peak_A_, std::hypot(s.i_d_A, s.i_q_A));
      each((k + 1) / static_cast<double>(kPeriodsPerMs));
    }
  }
  void run_ms(double ms) {
    run_ms(ms, [](double) {});
  }
  // Forgets what was counted.
  void count_anew() { trips_ = 0, peak_A_ = 0.0, gap_ = longest_gap_ = 0; }

  int trips() const { return trips_; }
  const std::string& causes() const { return causes_; }
  double peak_A() const { return peak_A_; }
  double longest_gap_ms() const { return longest_gap_ / static_cast<double>(kPeriodsPerMs); }

 private:
  static sim::NativeEscConfig config(const EscDraw& d, bool ideal_board) {
    sim::NativeEscConfig c;
    c.drive = d.drive;
    c.firmware = d.firmware;
    c.bus_V = d.bus_V;
    c.seed = d.seed;
    c.typical_board = !ideal_board;
    return c;
  }
  Esc esc_;
  double load_N_m_s2_, bus_V_, peak_A_ = 0.0;
  int trips_ = 0, gap_ = 0, longest_gap_ = 0;
  std::int64_t periods_ = 0;
  std::string causes_;
  bool in_fault_ = false;
};

template <class Esc>
void start(Bench<Esc>& bench, const EscDraw& d, EscTrial& t) {
  const double goal = std::min(2000.0 * kRpm, 0.2 * t.top_rad_s);
  const double target = std::max(goal, static_cast<double>(d.firmware.min_speed_rad_s));
  bench.count_anew();
  bench.esc().set_setpoint(speed(target));
  const double allowed_ms = 3.0 * d.motor_class->start_within_ms;
  bench.run_ms(allowed_ms, [&](double ms) {
    if (t.start_ms > 1e8 && bench.omega() >= 0.98 * goal) t.start_ms = ms, t.start_peak_A = bench.peak_A();
  });
  t.start_trips = bench.trips();
  t.start_peak_A = t.start_ms > 1e8 ? bench.peak_A() : t.start_peak_A;
}

// Random steps every 50 to 300 ms for 4 s.
template <class Esc>
void fly(Bench<Esc>& bench, const EscDraw& d, EscTrial& t) {
  start(bench, d, t);
  const RandomStream random(d.seed, kStepStream);
  const double low = d.motor_class->name == "5in" ? 1500.0 * kRpm : 0.15 * t.top_rad_s, high = 0.95 * t.top_rad_s;
  bench.count_anew();
  double ms = 0.0;
  for (std::uint64_t k = 0; ms < 4000.0; k += 2) {
    const double for_ms = std::min(50.0 + 250.0 * random.uniform(k), 4000.0 - ms);
    bench.esc().set_setpoint(speed(low + (high - low) * random.uniform(k + 1)));
    bench.run_ms(for_ms);
    ms += for_ms;
  }
  t.trips = bench.trips();
  t.peak_A = bench.peak_A();
  t.longest_gap_ms = bench.longest_gap_ms();
  bench.esc().set_setpoint(speed(low));
  bench.run_ms(1000.0);  // time enough for a start: what does not turn now is latched
  t.latched = bench.omega() < 0.5 * low;
}

template <class Esc>
void step(Bench<Esc>& bench, const EscDraw& d, EscTrial& t) {
  start(bench, d, t);
  const double from = 0.4 * t.top_rad_s, to = 0.6 * t.top_rad_s;
  bench.esc().set_setpoint(speed(from));
  bench.run_ms(1500.0);
  bench.count_anew();
  bench.esc().set_setpoint(speed(to));
  double t10 = -1.0, t90 = -1.0, sum = 0.0;
  int count = 0;
  const BestStep best = best_step(d, from, to);
  const double for_ms = std::max(400.0, 8.0 * best.reach_ms);
  bench.run_ms(for_ms, [&](double ms) {
    const double x = (bench.omega() - from) / (to - from);
    if (t10 < 0.0 && x >= 0.1) t10 = ms;
    if (t90 < 0.0 && x >= 0.9) t90 = ms;
    if (std::fabs(x - 1.0) > 0.02) t.settle_ms = ms;
    t.overshoot_percent = std::max(t.overshoot_percent, 100.0 * (x - 1.0));
    if (ms > for_ms - 200.0) sum += 100.0 * (bench.omega() / to - 1.0), ++count;
  });
  t.rise_ms = t90 < 0.0 ? 1e9 : t90 - t10;
  t.rise_ratio = t.rise_ms / best.rise_ms;
  t.settle_ratio = t.settle_ms / best.reach_ms;
  t.steady_percent = sum / std::max(count, 1);
  t.trips = bench.trips();
  t.peak_A = bench.peak_A();
  t.longest_gap_ms = bench.longest_gap_ms();
}

// A rotor that already turns when the set-point comes: from -60 to +95 % of the top.
template <class Esc>
void catch_rotor(Bench<Esc>& bench, const EscDraw& d, EscTrial& t) {
  t.caught_from = -0.60 + 1.55 * RandomStream(d.seed, kStepStream).uniform(0);
  const double goal = 0.6 * t.top_rad_s;
  bench.esc().drive().motor().state().omega_rad_s = t.caught_from * t.top_rad_s;
  bench.count_anew();
  bench.esc().set_setpoint(speed(goal));
  double last_off_ms = 0.0;
  bench.run_ms(3000.0, [&](double ms) {
    if (std::fabs(bench.omega() / goal - 1.0) > 0.02) last_off_ms = ms;
  });
  t.caught_ms = last_off_ms > 2999.0 ? 1e9 : last_off_ms;
  t.trips = bench.trips();
  t.peak_A = bench.peak_A();
}

template <class Esc>
EscTrial run_on(const EscDraw& d, const EscTrialSettings& s) {
  EscTrial t;
  t.seed = d.seed;
  t.motor_class = d.motor_class->name;
  t.bus_V = d.bus_V;
  t.top_rad_s = highest_speed_rad_s(d);
  Bench<Esc> bench(d, s.ideal_board);
  switch (s.experiment) {
    case EscExperiment::fly:
      fly(bench, d, t);
      break;
    case EscExperiment::step:
      step(bench, d, t);
      break;
    case EscExperiment::catch_rotor:
      catch_rotor(bench, d, t);
      break;
  }
  t.causes = bench.causes();
  return t;
}

}  // namespace

EscTrial run_esc_trial(const MotorClass& c, std::uint64_t seed, const EscTrialSettings& s) {
  const EscDraw d = draw_esc(c, seed, s.knowledge);
  return c.board == StudyBoard::high_voltage ? run_on<sim::HighVoltageNativeEsc>(d, s) : run_on<sim::NativeEsc>(d, s);
}

std::string esc_csv_header() {
  return "seed,class,bus_V,top_rad_s,start_ms,start_peak_A,peak_A,start_trips,trips,causes,longest_gap_ms,latched,rise_ratio,"
         "settle_ratio,rise_ms,settle_ms,overshoot_percent,steady_percent,caught_from,caught_ms";
}

std::string esc_csv_line(const EscTrial& t) {
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}", t.seed, t.motor_class, t.bus_V, t.top_rad_s, t.start_ms,
                     t.start_peak_A, t.peak_A, t.start_trips, t.trips, t.causes.empty() ? "-" : t.causes, t.longest_gap_ms,
                     t.latched ? 1 : 0, t.rise_ratio, t.settle_ratio, t.rise_ms, t.settle_ms, t.overshoot_percent, t.steady_percent,
                     t.caught_from, t.caught_ms);
}

std::vector<EscTrial> read_esc_trials(const std::string& path) {
  std::vector<EscTrial> trials;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream s(line);
    EscTrial t;
    int latched = 0;
    if (s >> t.seed >> t.motor_class >> t.bus_V >> t.top_rad_s >> t.start_ms >> t.start_peak_A >> t.peak_A >> t.start_trips >> t.trips >>
        t.causes >> t.longest_gap_ms >> latched >> t.rise_ratio >> t.settle_ratio >> t.rise_ms >> t.settle_ms >> t.overshoot_percent >>
        t.steady_percent >> t.caught_from >> t.caught_ms) {
      t.latched = latched != 0;
      if (t.causes == "-") t.causes.clear();
      trials.push_back(t);
    }
  }
  return trials;
}

}  // namespace rotorloop::stats
