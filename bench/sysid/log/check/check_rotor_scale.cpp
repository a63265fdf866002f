// A rotor whose reading is scaled for a part of the flight: from then on the speeds ask for a moment in roll, pitch and yaw that the
// vehicle does not show. What a sound log leaves in these three axes (inertia, gyroscopic moment, air, a centre of mass off the middle)
// is fitted and taken out first; what then steps along the direction of one rotor, in all three axes alike, is that rotor's scale.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "bench/sysid/log/check/check_moments.hpp"
#include "bench/sysid/log/check/stream_access.hpp"

namespace rotorloop::log {
namespace {

// Step of the mean imbalance, a share of the weight: (scale² - 1) / 4. 0.04 is a scale of 0.917 or 1.077. The largest step with all
// three axes in agreement that a clean measured flight shows is 0.024 (a race at 17 m/s).
constexpr double kLeastStep = 0.04, kMostSpread = 0.5;
constexpr double kShortest_s = 1.0, kLeastLeft_s = 2.0;
constexpr std::size_t kMostWindows = 400;  // all pairs of them are tried
struct Stretch {
  std::size_t from = 0, to = 0;  // samples, half open
  std::size_t rotor = 0;
  double step = 0.0;     // inside less outside, along the rotor's direction
  double outside = 0.0;  // along the same direction, the constant included
  double gain = 0.0;     // of the sum of squares
  double inside_s = 0.0, outside_s = 0.0;
};

class StepSearch {
 public:
  StepSearch(const std::vector<MomentSample>& samples, const Unexplained& left, const host::VehicleModel& vehicle, double dt_s)
      : left_(left), vehicle_(vehicle), dt_s_(dt_s), sum_(samples.size() + 1), count_(samples.size() + 1, 0.0) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      sum_[i + 1] = sum_[i];
      count_[i + 1] = count_[i] + (samples[i].valid ? 1.0 : 0.0);
      for (std::size_t a = 0; a < 3; ++a) sum_[i + 1][a] += samples[i].valid ? left.imbalance[i][a] : 0.0;
    }
  }

  // The stretch that explains most, on windows first and then to a sample.
  std::optional<Stretch> best() const {
    const std::size_t n = count_.size() - 1;
    const std::size_t window = std::max<std::size_t>(static_cast<std::size_t>(0.5 / dt_s_), n / kMostWindows + 1);
    Stretch best;
    for (std::size_t from = 0; from < n; from += window)
      for (std::size_t to = from + window; to < n + window; to += window) consider(from, std::min(to, n), best);
    if (best.gain <= 0.0) return std::nullopt;
    for (std::size_t step = window / 2; step > 0; step /= 2) {
      const Stretch about = best;
      for (int a = -2; a <= 2; ++a)
        for (int b = -2; b <= 2; ++b) {
          const auto from = static_cast<std::ptrdiff_t>(about.from) + a * static_cast<std::ptrdiff_t>(step);
          const auto to = static_cast<std::ptrdiff_t>(about.to) + b * static_cast<std::ptrdiff_t>(step);
          if (from >= 0 && to <= static_cast<std::ptrdiff_t>(n) && from < to)
            consider(static_cast<std::size_t>(from), static_cast<std::size_t>(to), best);
        }
    }
    return best;
  }

 private:
  void consider(std::size_t from, std::size_t to, Stretch& best) const {
    const double inside = count_[to] - count_[from], outside = count_.back() - inside;
    if (inside * dt_s_ < kShortest_s || outside * dt_s_ < kLeastLeft_s) return;
    for (std::size_t rotor = 0; rotor < 4; ++rotor) {
      const std::array<double, 3> sign = moment_signs(vehicle_, rotor);
      Imbalance step{};
      double elsewhere = 0.0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double in = sum_[to][a] - sum_[from][a], out = (sum_.back()[a] - in) / outside;
        step[a] = sign[a] * (in / inside - out);
        elsewhere += sign[a] * (out + left_.constant[a]) / 3.0;
      }
      const double mean = (step[0] + step[1] + step[2]) / 3.0;
      const double spread = *std::max_element(step.begin(), step.end()) - *std::min_element(step.begin(), step.end());
      if (std::abs(mean) < kLeastStep || spread > kMostSpread * std::abs(mean)) continue;
      const double gain = mean * mean * inside * outside / (inside + outside);
      if (gain > best.gain) best = {from, to, rotor, mean, elsewhere, gain, inside * dt_s_, outside * dt_s_};
    }
  }

  const Unexplained& left_;
  const host::VehicleModel& vehicle_;
  double dt_s_;
  std::vector<Imbalance> sum_;
  std::vector<double> count_;
};

// Of a rotor that carries a quarter of the weight.
double scale_of(double step) { return std::sqrt(1.0 + 4.0 * step); }

// Of this rotor at this time, beside what the sound side of the flight says that moments should be: (1 - 1 / scale²) of the squared
// speed that it read.
double scale_in(const std::vector<MomentSample>& samples, const Stretch& b, bool inside, const host::VehicleModel& vehicle) {
  const auto wrong = [&](std::size_t i) { return (i >= b.from && i < b.to) == inside; };
  const Unexplained left = unexplained_moments(samples, [&](std::size_t i) { return !wrong(i); });
  const std::array<double, 3> sign = moment_signs(vehicle, b.rotor);
  double read = 0.0, too_much = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!samples[i].valid || !wrong(i)) continue;
    read += samples[i].square[b.rotor];
    for (std::size_t a = 0; a < 3; ++a) too_much += sign[a] * left.imbalance[i][a] / 3.0;
  }
  return 1.0 / std::sqrt(std::max(0.01, 1.0 - too_much / std::max(read, 1e-9)));
}

}  // namespace

void check_rotor_scale(CheckState& s, const FlightGrid& g, std::vector<char> in_flight) {
  constexpr int kMostStretches = 6;
  constexpr double kMargin_s = 0.2;  // of the filters: so far a fault reaches, and so far its ends may be off
  for (int found = 0; found < kMostStretches; ++found) {
    const std::vector<MomentSample> samples = moment_samples(g, shrunk(in_flight, g.grid.dt_s, kMargin_s), s.vehicle);
    if (samples.empty()) return;
    const double dt_s = g.grid.dt_s * static_cast<double>(kMomentStride);
    const Unexplained left = unexplained_moments(samples, [](std::size_t) { return true; });
    const std::optional<Stretch> b = StepSearch(samples, left, s.vehicle, dt_s).best();
    if (!b) return;
    const std::string name = fmt::format("rotor {} speed", b->rotor + 1);
    // Which side is wrong: the one that is further from balance.
    const bool inside_is_wrong = std::abs(b->outside + b->step) > std::abs(b->outside);
    const double wrong_s = inside_is_wrong ? b->inside_s : b->outside_s, all_s = b->inside_s + b->outside_s;
    const std::string what = fmt::format(
        "reads {:.3g} times its speed for {:.1f} s (allowed {:.3g} to {:.3g}): there the speeds ask for moments in roll, pitch and yaw "
        "that the vehicle does not show",
        scale_in(samples, *b, inside_is_wrong, s.vehicle), wrong_s, scale_of(-kLeastStep), scale_of(kLeastStep));
    std::vector<TimeRange> out;
    const auto wrong_between = [&](std::size_t from, std::size_t to) {
      if (std::any_of(samples.begin() + static_cast<std::ptrdiff_t>(from), samples.begin() + static_cast<std::ptrdiff_t>(to),
                      [](const MomentSample& m) { return m.valid; }))
        out.push_back({samples[from].t_s - kMargin_s, samples[to - 1].t_s + kMargin_s});
    };
    if (inside_is_wrong) {
      wrong_between(b->from, b->to);
    } else {
      wrong_between(0, b->from);
      wrong_between(b->to, samples.size());
    }
    if (wrong_s > 0.5 * all_s) {
      s.refuse(name, what + fmt::format("; {:.1f} of {:.1f} s of flight are lost (allowed half)", wrong_s, all_s),
               {out.front().from_s, out.back().to_s}, "a speed sensor or telemetry that changed its scale, or a propeller that lost a part",
               "repair the sensor; cut the log to the part before the fault");
      return;
    }
    for (const TimeRange& r : out) {
      s.exclude(name, what, r);
      s.lose(r);
      for (std::size_t i = g.grid.nearest(r.from_s); i <= g.grid.nearest(r.to_s); ++i) in_flight[i] = 0;
    }
  }
}

}  // namespace rotorloop::log
