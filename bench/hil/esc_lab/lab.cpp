#include "bench/hil/esc_lab/lab.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/hil/esc_lab/best_step.hpp"
#include "bench/hil/esc_lab/commission_trial.hpp"
#include "bench/hil/esc_lab/esc_run.hpp"
#include "bench/hil/esc_lab/fault_schedule.hpp"
#include "bench/hil/esc_lab/trial.hpp"
#include "bench/render/document.hpp"

namespace rotorloop::esc_lab {
namespace {

constexpr std::uint64_t kChirpDraws = 3;  // fifteen frequencies each
constexpr std::uint64_t kFaultBoards = 5;
constexpr double kSine = 0.011;                 // of the speed: ±100 RPM at 9 000
constexpr double kChirpAt = 0.5, kSagAt = 0.6;  // of the highest speed that the draw holds

// The first eight of them.
std::string seeds_text(const std::vector<std::uint64_t>& seeds, std::string_view word = "seed") {
  std::string out = fmt::format("{}{}", word, seeds.size() == 1 ? "" : "s");
  for (std::size_t k = 0; k < std::min<std::size_t>(seeds.size(), 8); ++k) out += fmt::format(" {}", seeds[k]);
  return out + (seeds.size() > 8 ? " …" : "");
}

// "over-current 5 (seeds 3 7), stall 1 (seed 9)": all trips of a battery, by cause.
class Causes {
 public:
  void add(std::uint64_t seed, const std::string& faults) {
    for (const char c : faults) {
      Cause& cause = causes_[static_cast<firmware::Fault>(c - '0')];
      ++cause.trips;
      if (cause.seeds.empty() || cause.seeds.back() != seed) cause.seeds.push_back(seed);
    }
  }
  std::string text() const {
    std::string out;
    for (const auto& [fault, c] : causes_)
      out +=
          fmt::format("{}{} {} ({})", out.empty() ? "trips, with those of the start: " : ", ", name(fault), c.trips, seeds_text(c.seeds));
    return out;
  }

 private:
  static std::string_view name(firmware::Fault f) {
    constexpr std::array<std::string_view, 9> kNames = {"none",         "over-current", "under-voltage",    "over-voltage", "stall",
                                                        "start failed", "sensor",       "over-temperature", "self-test"};
    const auto k = static_cast<std::size_t>(f);
    return k < kNames.size() ? kNames[k] : "unknown";
  }
  struct Cause {
    int trips = 0;
    std::vector<std::uint64_t> seeds;
  };
  std::map<firmware::Fault, Cause> causes_;
};

class Laboratory {
 public:
  Laboratory(const Subject& subject, const LabSettings& settings, LabResult& result) : subject_(subject), s_(settings), r_(result) {}

  void step() {
    EscTrial worst;
    std::vector<std::uint64_t> tripped, never;
    Causes causes;
    for_each_draw(Battery::step, s_.draws, [&](std::uint64_t seed, EscTrace trace) {
      const EscDraw d = subject_.draw(seed, Knowledge::commissioned);
      const EscTrial t = run_esc_trial(d, {EscExperiment::step, Knowledge::commissioned}, &trace);
      causes.add(seed, t.causes);
      if (t.trips + t.start_trips > 0) tripped.push_back(seed);
      if (t.start_ms > 1e8 || t.rise_ms > 1e8) {
        never.push_back(seed);  // its step is none
        return keep(r_.figures.steps, {seed, 0.0, 1e9, std::move(trace), "never there"}, true);
      }
      take(worst.rise_ratio, t.rise_ratio, seed);
      take(worst.settle_ratio, t.settle_ratio, seed);
      take(worst.overshoot_percent, t.overshoot_percent, seed);
      take(worst.steady_percent, std::abs(t.steady_percent), seed);
      // From a twentieth of a second before the step: boot, three start times, 1.5 s at the lower speed.
      keep(r_.figures.steps, {seed, 0.02 + 3e-3 * d.start_within_ms + 1.5 - 0.05, 1e9, std::move(trace), ""}, !step_within(t));
    });
    const std::string of = "40 to 60 % of the highest speed held, commissioned parameters";
    add({Battery::step, "rise (10 to 90 %) over the best that the limits allow", "", worst.rise_ratio, kMostRise, false, of});
    add({Battery::step, "settling (2 %) over the best that the limits allow", "", worst.settle_ratio, kMostSettle});
    add({Battery::step, "overshoot", "%", worst.overshoot_percent, kMostOvershoot_percent});
    add({Battery::step, "steady error", "%", worst.steady_percent, kMostSteady_percent});
    add_count(Battery::step, "draws that never started, or never reached the upper speed: not judged above", never, s_.draws, 0.0);
    add_count(Battery::step, "draws with a trip", tripped, s_.draws, 0.0);
    append_note(causes.text());
  }

  void chirp() {
    const std::uint64_t draws = std::min(s_.draws, kChirpDraws);
    double least_Hz = 1e9;
    std::uint64_t at = s_.seed;
    for_each_draw(Battery::chirp, draws, [&](std::uint64_t seed, EscTrace) {
      const EscDraw d = subject_.draw(seed, Knowledge::commissioned);
      const double centre_rad_s = kChirpAt * highest_speed_rad_s(d);
      const Bandwidth b = with_esc_of(d.board, [&]<class Esc>() {
        EscRun<Esc> run = at_speed<Esc>(d, centre_rad_s);
        return closed_loop_bandwidth(run.esc(), centre_rad_s, kSine * centre_rad_s, true);
      });
      if (b.minus_3dB_Hz < least_Hz) {
        least_Hz = b.minus_3dB_Hz;
        at = seed;
        r_.figures.gains = b.points;
      }
    });
    add({Battery::chirp, "-3 dB of small sines, lowest", "Hz", least_Hz, kLeastBandwidth_Hz, true,
         fmt::format("± 1.1 % around half of the highest speed; seed {} of {} draws", at, draws)});
  }

  void start() {
    std::vector<std::uint64_t> late, never, gaps, latched, tripped;
    double slowest_ms = 0.0, peak_A = 0.0;
    Causes causes;
    for_each_draw(Battery::start, s_.draws, [&](std::uint64_t seed, EscTrace trace) {
      const EscTrial t = run_esc_trial(subject_.draw(seed, Knowledge::data_sheet), {EscExperiment::fly, Knowledge::data_sheet}, &trace);
      causes.add(seed, t.causes);
      if (t.start_ms > 1e8)
        never.push_back(seed);
      else if (!started_in_time(t))
        late.push_back(seed);
      if (t.longest_gap_ms > kLongestGap_ms) gaps.push_back(seed);
      if (t.latched) latched.push_back(seed);
      if (t.trips > 0) tripped.push_back(seed);
      slowest_ms = std::max(slowest_ms, t.start_ms > 1e8 ? 0.0 : t.start_ms);
      peak_A = std::max(peak_A, t.start_peak_A);
      keep(r_.figures.starts, {seed, 0.0, 1e9, std::move(trace), ""},
           !started_in_time(t) || t.trips > 0 || t.longest_gap_ms > kLongestGap_ms || t.latched);
    });
    const double limit_ms = subject_.draw(s_.seed, Knowledge::data_sheet).start_within_ms;
    add({Battery::start, "slowest start from rest, data-sheet parameters", "ms", slowest_ms, limit_ms, false,
         late.empty() ? fmt::format("peak {:.0f} A", peak_A) : "late: " + seeds_text(late)});
    add_count(Battery::start, "draws that never started", never, s_.draws, 0.0);
    add_count(Battery::start, "draws without speed for more than 100 ms in 4 s of random steps", gaps, s_.draws, 0.0);
    add_count(Battery::start, "draws with a trip in them", tripped, s_.draws, 1.0 - kLeastCleanShare);
    append_note(causes.text());
    add_count(Battery::start, "draws not turning at their end", latched, s_.draws, 0.0);
  }

  void catch_turning() {
    std::vector<std::uint64_t> late;
    Causes causes;
    double slowest_ms = 0.0;
    for_each_draw(Battery::catch_rotor, s_.draws, [&](std::uint64_t seed, EscTrace trace) {
      const EscTrial t =
          run_esc_trial(subject_.draw(seed, Knowledge::data_sheet), {EscExperiment::catch_rotor, Knowledge::data_sheet}, &trace);
      causes.add(seed, t.causes);
      if (!caught_in_time(t)) late.push_back(seed);
      slowest_ms = std::max(slowest_ms, t.caught_ms);
      keep(r_.figures.catches, {seed, 0.0, 1.2, std::move(trace), render::true_minus(fmt::format("{:+.0f} %", 100.0 * t.caught_from))},
           !caught_in_time(t));
    });
    add_count(Battery::catch_rotor, "rotors turning at -60 to +95 % not caught in time, or with a trip", late, s_.draws, 0.0);
    append_note(slowest_ms > 1e8 ? "slowest never" : fmt::format("slowest {:.0f} ms", slowest_ms));
    append_note(causes.text());
  }

  void sag() {
    double worst = 0.0;
    std::uint64_t at = s_.seed;
    for_each_draw(Battery::sag, s_.draws, [&](std::uint64_t seed, EscTrace trace) {
      EscDraw d = subject_.draw(seed, Knowledge::commissioned);
      d.bus_V = 3.5 * d.cells;
      const double aim_rad_s = kSagAt * highest_speed_rad_s(d);
      d.bus_V = 4.2 * d.cells;
      const double deviation = with_esc_of(d.board, [&]<class Esc>() {
        EscRun<Esc> run = at_speed<Esc>(d, aim_rad_s);
        return sag_percent(run.esc(), d.load_N_m_s2, d.bus_V, 3.5 * d.cells,
                           [&](double ms) { trace.add(run.esc(), run.esc().board().bridge, 1e-3 * ms, aim_rad_s); });
      });
      if (!(deviation <= worst)) {
        worst = deviation;
        at = seed;
      }
      if (seed == s_.seed) r_.figures.sags.push_back({seed, 0.0, 1e9, std::move(trace), ""});
    });
    add({Battery::sag, "speed while the supply falls from 4.2 to 3.5 V per cell in 1 s", "%", worst, kMostSag_percent, false,
         fmt::format("largest deviation; seed {}", at)});
  }

  void commission() {
    std::array<std::vector<std::uint64_t>, kQuantities> beyond;
    std::array<double, kQuantities> worst{};
    for (const QuantityLimit& q : kQuantityLimits)
      r_.figures.commissioned.push_back({std::string(q.name), std::string(q.unit), q.limit, {}});
    for_each_draw(Battery::commission, s_.draws, [&](std::uint64_t seed, EscTrace) {
      const CommissionTrial t = run_commission_trial(subject_.draw(seed, Knowledge::data_sheet));
      for (std::size_t q = 0; q < kQuantities; ++q) {
        if (std::fabs(t.error[q]) > kQuantityLimits[q].limit) beyond[q].push_back(seed);
        if (std::fabs(t.error[q]) > 1e8) continue;  // not measured
        r_.figures.commissioned[q].errors.push_back(t.error[q]);
        if (std::fabs(t.error[q]) > std::fabs(worst[q])) worst[q] = t.error[q];
      }
    });
    for (std::size_t q = 0; q < kQuantities; ++q) {
      const QuantityLimit& l = kQuantityLimits[q];
      const std::string unit = l.unit.empty() ? "" : " " + std::string(l.unit);
      add_count(Battery::commission, fmt::format("draws in which {} is wrong by more than {:.3g}{}", l.name, l.limit, unit), beyond[q],
                s_.draws, kMostBeyondShare);
      append_note(fmt::format("worst measured {:+.2f}{}", worst[q], unit));
    }
  }

  void fault() {
    std::vector<EscDraw> draws;
    for (std::uint64_t k = 0; k < std::min(s_.draws, kFaultBoards); ++k) draws.push_back(subject_.draw(s_.seed + k, Knowledge::data_sheet));
    std::uint64_t done = 0, shown = 0;
    double stale_ms = 0.0, blind_ms = 0.0;
    std::vector<std::uint64_t> dead, latched;
    std::map<std::string, LabFigures::FaultCount> counts;
    FaultSettings f{.from = 1 + (s_.seed - 1) * s_.schedules, .count = s_.schedules};
    f.each = [&](const FaultOutcome& o) {
      tell(Battery::fault, ++done, s_.schedules);
      stale_ms = std::max(stale_ms, o.driven_stale_ms);
      blind_ms = std::max(blind_ms, o.blind_running_ms);
      if (o.dead_without_reason) dead.push_back(o.number);
      if (o.latched_without_fault) latched.push_back(o.number);
      count(counts, o);
      if (shown == 0 && o.tripped && !o.latched && o.simulated_ms > 400.0) shown = o.number;
    };
    run_fault_schedules(draws, f);
    for (auto& [kind, c] : counts) r_.figures.fault_counts.push_back(c);
    if (shown > 0) {
      LabFigures::Traced t;
      t.seed = shown;
      t.what = trace_fault_schedule(draws, f, shown, t.trace).faults;
      r_.figures.faults.push_back(std::move(t));
    }
    add({Battery::fault, "driven without a fresh set-point, longest", "ms", stale_ms, 0.0, false, "of all schedules of faults"});
    add_count(Battery::fault, "schedules with a bridge that is off for no reason given", dead, s_.schedules, 0.0);
    add_count(Battery::fault, "schedules with a latch without a fault", latched, s_.schedules, 0.0);
    add({Battery::fault, "rotor at rest reported as running, longest", "ms", blind_ms, kBlindRunning_ms});
  }

 private:
  template <class Each>
  void for_each_draw(Battery b, std::uint64_t draws, const Each& each) {
    for (std::uint64_t k = 0; k < draws; ++k) {
      each(s_.seed + k, EscTrace{});
      tell(b, k + 1, draws);
    }
  }
  static void keep(std::vector<LabFigures::Traced>& traced, LabFigures::Traced t, bool missed) {
    t.missed = missed;
    if (traced.empty() || (missed && std::none_of(traced.begin(), traced.end(), [](const auto& k) { return k.missed; })))
      traced.push_back(std::move(t));
  }
  void tell(Battery b, std::uint64_t done, std::uint64_t of) const {
    if (s_.progress) s_.progress(kBatteryNames[static_cast<std::size_t>(b)], done, of);
  }
  template <class Esc>
  static EscRun<Esc> at_speed(const EscDraw& d, double omega_rad_s) {
    EscRun<Esc> run(d, false);
    run.order(speed(omega_rad_s));
    run.run_ms(3.0 * d.start_within_ms);
    return run;
  }
  static void take(double& worst, double value, std::uint64_t) { worst = value > worst || std::isnan(value) ? value : worst; }
  void add(LabRow row) { r_.rows.push_back(std::move(row)); }
  void add_count(Battery b, std::string what, const std::vector<std::uint64_t>& failed, std::uint64_t of, double allowed_share) {
    const double allowed = std::floor(allowed_share * static_cast<double>(of) + 1e-9);
    add({b, std::move(what), fmt::format("of {}", of), static_cast<double>(failed.size()), allowed, false,
         failed.empty() ? "" : "failed: " + seeds_text(failed, b == Battery::fault ? "schedule" : "seed")});
  }
  void append_note(const std::string& text) {
    if (text.empty()) return;
    std::string& note = r_.rows.back().note;
    note += (note.empty() ? "" : "; ") + text;
  }
  static void count(std::map<std::string, LabFigures::FaultCount>& counts, const FaultOutcome& o) {
    std::string_view rest = o.faults;
    while (!rest.empty()) {
      const auto end = rest.find(" + ");
      LabFigures::FaultCount& c = counts[std::string(rest.substr(0, end))];
      c.kind = rest.substr(0, end);
      ++c.flown;
      c.tripped += o.tripped;
      c.latched += o.latched;
      c.failed += !fault_handled(o);
      rest = end == std::string_view::npos ? "" : rest.substr(end + 3);
    }
  }

  const Subject& subject_;
  const LabSettings& s_;
  LabResult& r_;
};

}  // namespace

bool LabResult::met() const {
  return std::all_of(rows.begin(), rows.end(), [](const LabRow& r) { return r.met(); });
}

LabResult run_lab(const Subject& subject, const LabSettings& settings) {
  LabResult r;
  r.name = subject.name;
  r.facts = subject.facts;
  r.seed = settings.seed;
  r.draws = settings.draws;
  r.schedules = settings.schedules;
  Laboratory lab(subject, settings, r);
  using Run = void (Laboratory::*)();
  constexpr std::array<Run, kBatteryNames.size()> kRuns = {&Laboratory::step,          &Laboratory::chirp, &Laboratory::start,
                                                           &Laboratory::catch_turning, &Laboratory::sag,   &Laboratory::commission,
                                                           &Laboratory::fault};
  for (std::size_t b = 0; b < kRuns.size(); ++b)
    if (settings.only.empty() || std::count(settings.only.begin(), settings.only.end(), static_cast<Battery>(b)) > 0) (lab.*kRuns[b])();
  return r;
}

}  // namespace rotorloop::esc_lab
