// Absolute deadlines of what runs in real time, and how late each was met. Knows no clock: times are handed in, so that the rule is
// tested in virtual time. A step that begins late is followed at once by the next ones until they are in time again; when a step is
// further behind than may be caught up, the run is over, and whoever steps motors disarms them.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace rotorloop {

// How late steps began, in classes. No allocation.
struct Lateness {
  static constexpr std::array<std::int64_t, 12> kUpTo_us{10, 20, 50, 100, 200, 500, 1'000, 2'000, 5'000, 10'000, 20'000, 50'000};
  std::array<std::uint64_t, kUpTo_us.size() + 1> counts{};  // the last: later than all of them
  std::uint64_t steps = 0;
  std::uint64_t missed = 0;  // later than the period: the next step was due already
  std::int64_t worst_ns = 0;

  void add(std::int64_t late_ns, std::int64_t period_ns) {
    std::size_t i = 0;
    while (i < kUpTo_us.size() && late_ns > 1000 * kUpTo_us[i]) ++i;
    ++counts[i];
    ++steps;
    missed += late_ns > period_ns ? 1u : 0u;
    worst_ns = std::max(worst_ns, late_ns);
  }
  // This share of all steps (0 to 1) began at most so late: the upper end of a class, or the worst where that is less.
  double quantile_us(double share) const {
    const double worst_us = 1e-3 * static_cast<double>(worst_ns), wanted = share * static_cast<double>(steps);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < kUpTo_us.size(); ++i) {
      sum += counts[i];
      if (static_cast<double>(sum) >= wanted) return std::min(worst_us, static_cast<double>(kUpTo_us[i]));
    }
    return worst_us;
  }
};

class Deadlines {
 public:
  static constexpr std::int64_t kCatchUp_ns = 20'000'000;  // as long as a flight computer bears to be without IMU samples

  Deadlines(std::int64_t begun_ns, std::int64_t period_ns, std::int64_t catch_up_ns = kCatchUp_ns)
      : next_ns_(begun_ns), period_ns_(period_ns), catch_up_ns_(catch_up_ns) {}

  std::int64_t next_ns() const { return next_ns_; }
  // The step whose deadline is next begins. False: it is further behind than may be caught up.
  bool begin_step(std::int64_t now_ns) {
    const std::int64_t late_ns = std::max<std::int64_t>(now_ns - next_ns_, 0);
    lateness_.add(late_ns, period_ns_);
    next_ns_ += period_ns_;
    return late_ns <= catch_up_ns_;
  }
  const Lateness& lateness() const { return lateness_; }

 private:
  std::int64_t next_ns_, period_ns_, catch_up_ns_;
  Lateness lateness_;
};

}  // namespace rotorloop
