// Stamps as a clock: no sample stands hours from all others, and the steps and the span are those of a flight. Judged before anything
// is laid on a grid, for a unit of time that is wrong by a thousand asks for a thousand times the memory.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"

namespace rotorloop::log {
namespace {

constexpr double kShortestStep_s = 1e-4, kLongestStep_s = 0.2;
constexpr double kLongestSlowStep_s = 2.0;  // of positions and velocities: satellite receivers report once a second
const char* const kRemedy = "give the unit in the mapping ([time] unit, or [source.NAME.time] unit); a log of rotorloop has seconds";

// A damaged last row, a first one from before the clock was set: few samples that a long gap parts from all others.
template <class Value>
void drop_lone_ends(CheckState& s, const std::string& name, Stream<Value>& stream) {
  constexpr std::size_t kMostLone = 3;
  constexpr double kFarSteps = 50.0, kFar_s = 1.0;
  const std::size_t n = stream.size();
  if (n < 10 * kMostLone) return;
  const double far_s = std::max(kFar_s, kFarSteps * period_s(stream));
  std::size_t first = 0, last = n - 1;
  for (std::size_t i = 0; i < kMostLone; ++i) {
    if (stream.t_s[i + 1] - stream.t_s[i] > far_s) first = i + 1;
    if (stream.t_s[n - 1 - i] - stream.t_s[n - 2 - i] > far_s) last = n - 2 - i;
  }
  const auto report = [&](std::size_t count, double away_s, const char* where, double at_s) {
    s.exclude(name,
              fmt::format("{} sample{} stand{} {:.4g} s {} all others (likely: damaged rows, or a clock that was set)", count,
                          count == 1 ? "" : "s", count == 1 ? "s" : "", away_s, where),
              {at_s, at_s});
  };
  if (first > 0) report(first, stream.t_s[first] - stream.t_s[first - 1], "before", stream.t_s[first]);
  if (last + 1 < n) report(n - 1 - last, stream.t_s[last + 1] - stream.t_s[last], "after", stream.t_s[last]);
  std::vector<char> keep(n, 0);
  std::fill(keep.begin() + static_cast<std::ptrdiff_t>(first), keep.begin() + static_cast<std::ptrdiff_t>(last) + 1, char{1});
  if (first > 0 || last + 1 < n) stream = kept(stream, keep);
}

// What a wrong unit makes of 50 Hz to 1 kHz; nothing when no unit would bring the step there. The unit that was given is not known here:
// only the factor is, and each factor has its pairs.
std::string likely_unit(double step_s) {
  struct Unit {
    double factor;  // of the step read to the step meant
    const char* words;
  };
  constexpr Unit kUnits[] = {{1e3, "us where the mapping says ms, or ms where it says s"},
                             {1e6, "us where the mapping says s, or ns where it says ms"},
                             {1e9, "ns where the mapping says s"},
                             {1e-3, "s where the mapping says ms, or ms where it says us"},
                             {1e-6, "s where the mapping says us, or ms where it says ns"}};
  std::string out;
  for (const Unit& u : kUnits)
    if (const double meant = step_s / u.factor; meant > 0.8e-3 && meant < 0.03)
      out += fmt::format("{}the stamps are in {} (then {:.3g} ms)", out.empty() ? "" : ", or ", u.words, 1e3 * meant);
  return out;
}

template <class Value>
void check_period(CheckState& s, const std::string& name, const Stream<Value>& stream) {
  constexpr std::size_t kEnough = 10;
  if (stream.size() < kEnough || name == stream_name::battery || s.refused()) return;
  const bool slow = name == stream_name::position || name == stream_name::velocity;
  const double step_s = period_s(stream), longest_s = slow ? kLongestSlowStep_s : kLongestStep_s;
  if (step_s >= kShortestStep_s && step_s <= 1.001 * longest_s) return;
  const std::string unit = likely_unit(step_s);
  const bool input = name == stream_name::rotors || name == stream_name::command;
  if (input && unit.empty() && step_s > longest_s) return;  // slow, not misread: check_inputs() has the words for that
  s.refuse(name, fmt::format("steps from sample to sample are {:.4g} s (allowed {:.4g} to {:.4g} s)", step_s, kShortestStep_s, longest_s),
           {stream.t_s.front(), stream.t_s.back()},
           unit.empty() ? "stamps in another unit of time than the mapping says, or rounded to whole seconds" : unit, kRemedy);
}

template <class Value>
void check_span(CheckState& s, const std::string& name, const Stream<Value>& stream) {
  const TimeRange r{stream.t_s.front(), stream.t_s.back()};
  if (s.refused() || r.span_s() <= kLongestFlight_s) return;
  s.refuse(name, fmt::format("stamps span {:.4g} s (allowed {:.4g} s)", r.span_s(), kLongestFlight_s), r,
           "stamps in another unit of time than the mapping says, or stamps that jump",
           std::string(kRemedy) + "; cut the log to one flight");
}

// Streams on clocks that have nothing to do with each other.
void check_common_span(CheckState& s) {
  const TimeRange all = s.span();
  if (s.refused() || all.span_s() <= kLongestFlight_s) return;
  std::string each;
  for_each_stream(s.record, [&](const std::string& name, const auto& stream) {
    each += fmt::format("{}{} {:.6g} to {:.6g} s", each.empty() ? "" : ", ", name, stream.t_s.front(), stream.t_s.back());
  });
  s.refuse(stream_name::flight,
           fmt::format("stamps of all streams span {:.4g} s (allowed {:.4g} s): {}", all.span_s(), kLongestFlight_s, each), all,
           "streams in different units of time, or on two clocks: one since start-up, one of the day",
           std::string(kRemedy) + "; bring both to one clock");
}

}  // namespace

void check_clock(CheckState& s) {
  for_each_stream(s.record, [&](const std::string& name, auto& stream) { drop_lone_ends(s, name, stream); });
  for_each_stream(s.record, [&](const std::string& name, const auto& stream) { check_period(s, name, stream); });
  for_each_stream(s.record, [&](const std::string& name, const auto& stream) { check_span(s, name, stream); });
  check_common_span(s);
}

}  // namespace rotorloop::log
