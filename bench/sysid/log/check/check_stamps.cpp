// Order of stamps, values that are no numbers, gaps. Everything after this may rely on ascending stamps and finite values
// (a rotor without a reading, not-a-number, takes its whole sample with it: thrust needs all four).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"

namespace rotorloop::log {
namespace {

// The longest subsequence whose stamps ascend: keeps the most samples whatever went wrong (a repeated row, one wild stamp, a clock
// that restarted), where "later than all before" would let one stamp far ahead throw away the rest of the flight.
std::vector<char> longest_ascending(const std::vector<double>& t) {
  std::vector<std::size_t> tail;  // tail[k]: index of the smallest stamp that ends a run of k+1
  std::vector<std::ptrdiff_t> before(t.size(), -1);
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (!std::isfinite(t[i])) continue;
    const auto at = std::lower_bound(tail.begin(), tail.end(), t[i], [&](std::size_t j, double v) { return t[j] < v; });
    if (at != tail.begin()) before[i] = static_cast<std::ptrdiff_t>(*(at - 1));
    if (at == tail.end()) {
      tail.push_back(i);
    } else if (t[*at] != t[i]) {  // of equal stamps the first stays
      *at = i;
    }
  }
  std::vector<char> keep(t.size(), 0);
  for (std::ptrdiff_t i = tail.empty() ? -1 : static_cast<std::ptrdiff_t>(tail.back()); i >= 0; i = before[static_cast<std::size_t>(i)])
    keep[static_cast<std::size_t>(i)] = 1;
  return keep;
}

// A block of samples that does not ascend: a clock that was set back. Until it has caught up with itself nobody knows which of two
// stamps is meant, and no step may join the two sides.
void lose_set_back_clock(CheckState& s, const std::vector<double>& t, const std::vector<char>& keep) {
  constexpr std::size_t kLeastSamples = 3;
  const TimeRange whole = s.span();
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (keep[i]) continue;
    const std::size_t from = i;
    while (i < t.size() && !keep[i]) ++i;
    TimeRange twice{HUGE_VAL, -HUGE_VAL};
    for (std::size_t k = from > 0 ? from - 1 : 0; k < std::min(i + 1, t.size()); ++k)  // with the good neighbours: they may not be joined
      if (whole.contains(t[k])) twice = {std::min(twice.from_s, t[k]), std::max(twice.to_s, t[k])};
    if (i - from < kLeastSamples || !(twice.span_s() > 0.0)) continue;
    s.lose(twice);
    s.set_back.push_back(twice);
  }
}

// Where in the flight the samples stand that are not kept: from the good stamp before the first of them to the one after the last.
// Their own stamps may be anything.
TimeRange range_of_dropped(const std::vector<double>& t, const std::vector<char>& keep) {
  const auto first = static_cast<std::size_t>(std::find(keep.begin(), keep.end(), char{0}) - keep.begin());
  const auto end = static_cast<std::size_t>(std::find(keep.rbegin(), keep.rend(), char{0}).base() - keep.begin());
  std::size_t before = first, after = end;
  while (before > 0 && !keep[before - 1]) --before;
  while (after < keep.size() && !keep[after]) ++after;
  const bool has_before = before > 0, has_after = after < keep.size();
  if (!has_before && !has_after) return {};
  const double from = has_before ? t[before - 1] : t[after];
  const double to = has_after ? t[after] : t[before - 1];
  return {std::min(from, to), std::max(from, to)};
}

template <class Value>
void order_stamps(CheckState& s, const std::string& name, Stream<Value>& stream) {
  const std::vector<char> keep = longest_ascending(stream.t_s);
  std::size_t repeated = 0, out_of_order = 0, backward = 0;
  double worst_s = 0.0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    const double step = i > 0 ? stream.t_s[i] - stream.t_s[i - 1] : 0.0;
    backward += step < 0.0;
    if (keep[i]) continue;
    (i > 0 && step == 0.0 ? repeated : out_of_order)++;
    if (std::isfinite(step) && std::abs(step) > std::abs(worst_s)) worst_s = step;
  }
  if (repeated + out_of_order > 0) {
    const double share = static_cast<double>(out_of_order) / static_cast<double>(keep.size());
    const std::vector<double> t = stream.t_s;
    const TimeRange range = range_of_dropped(t, keep);
    stream = kept(stream, keep);
    if (repeated > 0) s.exclude(name, fmt::format("{} samples repeat the stamp of the one before", repeated), range);
    if (out_of_order > 0) s.exclude(name, fmt::format("{} samples out of order; largest step {:.4g} s", out_of_order, worst_s), range);
    if (2 * backward > keep.size()) {
      s.refuse(name, fmt::format("stamps fall from one sample to the next in {} of {} samples (allowed: none)", backward, keep.size()),
               range, "the rows stand in reverse order", "sort the rows by time");
    } else if (share > 0.1) {
      s.refuse(name, fmt::format("{:.0f} % of the stamps are out of order (allowed 10 %)", 100.0 * share), range,
               "a clock that restarts, two logs in one file, or columns of two clocks mixed",
               "split the log, or name the right time column");
    } else if (out_of_order > 0) {
      lose_set_back_clock(s, t, keep);
    }
  }
}

constexpr double kMostBlank = 0.05;  // of a stream's samples: telemetry may say now and then that it does not know

// ": rotor 1 has none", for rotors without any reading beside others that have some.
template <class Value>
std::string silent_rotors(const Stream<Value>& stream) {
  std::string out;
  if constexpr (std::is_same_v<Value, RotorValues>) {
    for (std::size_t k = 0; k < 4; ++k)
      if (std::none_of(stream.value.begin(), stream.value.end(), [&](const RotorValues& w) { return std::isfinite(w[k]); }))
        out += fmt::format("{}rotor {} has none", out.empty() ? ": " : ", ", k + 1);
  }
  return out;
}

// Before the first number and after the last a stream has not begun or has ended, and a blank now and then says that a reading is not
// known; a lasting hole between them is a fault.
template <class Value>
void drop_not_finite(CheckState& s, const std::string& name, Stream<Value>& stream) {
  std::vector<char> keep(stream.size(), 1), bad(stream.size(), 0);
  for (std::size_t i = 0; i < stream.size(); ++i) {
    const auto c = channels_of(stream.value[i]);
    const auto missing = std::count_if(c.begin(), c.end(), [](double v) { return !std::isfinite(v); });
    if (missing > 0) {
      bad[i] = 1;
      keep[i] = 0;
    }
  }
  const auto count = std::count(bad.begin(), bad.end(), char{1});
  if (count == 0) return;
  const auto first = static_cast<std::size_t>(std::find(keep.begin(), keep.end(), char{1}) - keep.begin());
  const auto end = static_cast<std::size_t>(std::find(keep.rbegin(), keep.rend(), char{1}).base() - keep.begin());
  const std::size_t all = stream.size();
  if (first == all) {
    const TimeRange whole{stream.t_s.front(), stream.t_s.back()};
    const std::string what = fmt::format("{} of {} samples are no numbers{}", count, all, silent_rotors(stream));
    if (name == stream_name::rotors && s.record.motor_command.empty()) {
      s.refuse(name, what, whole, "its column is in the log and empty: telemetry that never came",
               "repair the telemetry and fly again, or log motor commands: a fit needs the speeds of all four rotors or those");
    } else {
      s.exclude(name, what, whole);
    }
  } else {
    const auto blank = [&](std::size_t n, const char* where, TimeRange r) {
      if (n > 0) s.leave_out(name, fmt::format("{} of {} samples {} are no numbers", n, all, where), r);
    };
    blank(first, "before its first reading", {stream.t_s.front(), stream.t_s[first]});
    blank(all - end, "after its last reading", {stream.t_s[end - 1], stream.t_s.back()});
    std::fill(bad.begin(), bad.begin() + static_cast<std::ptrdiff_t>(first), char{0});
    std::fill(bad.begin() + static_cast<std::ptrdiff_t>(end), bad.end(), char{0});
    if (const auto holes = std::count(bad.begin(), bad.end(), char{1}); holes > 0) {
      double longest_s = 0.0;
      for (std::size_t i = first, good = first; i < end; ++i)
        if (keep[i]) {
          longest_s = std::max(longest_s, stream.t_s[i] - stream.t_s[good]);
          good = i;
        }
      const bool fault = static_cast<double>(holes) > kMostBlank * static_cast<double>(all) || longest_s > s.limits.longest_rotor_gap_s;
      const std::string what = fmt::format("{} of {} samples are no numbers, longest gap {:.3f} s", holes, all, longest_s);
      const TimeRange where = stretches(stream.t_s, bad, HUGE_VAL).front();
      fault ? s.exclude(name, what, where) : s.leave_out(name, what, where);
    }
  }
  stream = kept(stream, keep);
}

// Streams of one writer share their gaps: one line for all of them.
void note_gaps(CheckState& s, const std::string& name, const std::string& what, TimeRange range) {
  for (LogFinding& f : s.result.findings) {
    if (f.what != what || f.from_s != range.from_s || f.to_s != range.to_s) continue;
    f.stream += ", " + name;
    return;
  }
  s.note(name, what, range);
}

template <class Value>
void find_gaps(CheckState& s, const std::string& name, const Stream<Value>& stream) {
  const double usual = period_s(stream);
  std::size_t count = 0, longest = 0;
  double lost_s = 0.0;
  for (std::size_t i = 1; i < stream.size(); ++i) {
    const double d = stream.t_s[i] - stream.t_s[i - 1];
    if (d <= std::max(5.0 * usual, 0.02)) continue;
    ++count;
    lost_s += d;
    if (longest == 0 || d > stream.t_s[longest] - stream.t_s[longest - 1]) longest = i;
  }
  if (count == 0) return;
  const TimeRange range{stream.t_s[longest - 1], stream.t_s[longest]};
  note_gaps(s, name,
            fmt::format("{} gaps, {:.3f} s together, longest {:.3f} s (usual step {:.1f} ms)", count, lost_s, range.span_s(), 1e3 * usual),
            range);
}

}  // namespace

void check_stamps(CheckState& s) {
  for_each_stream(s.record, [&](const std::string& name, auto& stream) { order_stamps(s, name, stream); });
  if (!s.refused()) check_clock(s);
  if (s.refused()) return;
  for_each_stream(s.record, [&](const std::string& name, auto& stream) { drop_not_finite(s, name, stream); });
  for_each_stream(s.record, [&](const std::string& name, auto& stream) { find_gaps(s, name, stream); });
}

}  // namespace rotorloop::log
