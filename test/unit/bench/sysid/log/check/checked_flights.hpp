// What tests of the checks ask of a checked flight, and how they put a fault into a stream.
#pragma once
#include <string>

#include "bench/sysid/log/check/checks.hpp"
#include "test/unit/bench/sysid/estimate/analytic_flight.hpp"

namespace rotorloop::log::testing {

inline constexpr double kAlways_s = 1e9;

inline const LogFinding* find(const CheckedFlight& c, const std::string& stream, FindingAction action, const std::string& words = "") {
  for (const LogFinding& f : c.findings)
    if (f.stream == stream && f.action == action && f.what.find(words) != std::string::npos) return &f;
  return nullptr;
}

template <class Value, class Change>
void change(Stream<Value>& s, double from_s, double to_s, Change&& to) {
  for (std::size_t i = 0; i < s.size(); ++i)
    if (s.t_s[i] >= from_s && s.t_s[i] <= to_s) to(s.value[i]);
}

}  // namespace rotorloop::log::testing
