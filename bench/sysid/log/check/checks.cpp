// The order of the checks, and what is left of a flight after them.
#include "bench/sysid/log/check/checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"

namespace rotorloop::log {

void CheckState::note(std::string stream, std::string what, TimeRange r) {
  result.findings.push_back({std::move(stream), std::move(what), r.from_s, r.to_s, FindingAction::note});
}

void CheckState::exclude(std::string stream, std::string what, TimeRange r) {
  result.findings.push_back({std::move(stream), std::move(what), r.from_s, r.to_s, FindingAction::exclude, true});
}

void CheckState::leave_out(std::string stream, std::string what, TimeRange r) {
  result.findings.push_back({std::move(stream), std::move(what), r.from_s, r.to_s, FindingAction::exclude, false});
}

void CheckState::refuse(std::string stream, std::string what, TimeRange r, std::string likely, std::string remedy) {
  result.findings.push_back({stream, what, r.from_s, r.to_s, FindingAction::refuse, true});
  if (refused()) return;
  result.refusal =
      ErrorText{record.source.empty() ? record.name : record.source,
                fmt::format("{}, {:.2f} to {:.2f} s: {}", stream, r.from_s, r.to_s, what), std::move(likely), std::move(remedy)};
}

bool CheckState::clock_set_back(double from_s, double to_s) const {
  return std::any_of(set_back.begin(), set_back.end(), [&](const TimeRange& r) { return r.from_s <= to_s && from_s <= r.to_s; });
}

TimeRange CheckState::span() const {
  TimeRange r{HUGE_VAL, -HUGE_VAL};
  for_each_stream(record, [&](const std::string&, const auto& s) {
    r = {std::min(r.from_s, s.t_s.front()), std::max(r.to_s, s.t_s.back())};
  });
  return r.to_s < r.from_s ? TimeRange{} : r;
}

namespace {

// Holes in the inputs end a segment: a rotor's speed is not guessed across them.
void add_input_gaps(CheckState& s) {
  const auto& w = s.record.rotor_omega_rad_s.empty() ? s.record.motor_command : s.record.rotor_omega_rad_s;
  const double longest_s = s.limits.longest_rotor_gap_s;
  for (std::size_t i = 1; i < w.size(); ++i)
    if (w.t_s[i] - w.t_s[i - 1] > longest_s) s.split({w.t_s[i - 1], w.t_s[i]});
}

TimeRange flown(const FlightRecord& r, TimeRange span) {
  const auto within = [&](const std::vector<double>& t) {
    if (!t.empty()) span = {std::max(span.from_s, t.front()), std::min(span.to_s, t.back())};
  };
  within(r.rotor_omega_rad_s.t_s);
  if (r.rotor_omega_rad_s.empty()) within(r.motor_command.t_s);
  within(r.pose.t_s);
  return span;
}

// What a stream did while the vehicle stood or touched the ground is of no interest beside that.
void drop_findings_on_ground(CheckState& s) {
  std::vector<TimeRange> ground;
  for (const LogFinding& f : s.result.findings)
    if (f.stream == stream_name::flight && f.action == FindingAction::exclude) ground.push_back({f.from_s, f.to_s});
  std::erase_if(s.result.findings, [&](const LogFinding& f) {
    return f.stream != stream_name::flight && f.action == FindingAction::exclude &&
           std::any_of(ground.begin(), ground.end(), [&](const TimeRange& g) { return g.contains(f.from_s) && g.contains(f.to_s); });
  });
}

void cut(CheckState& s) {
  const TimeRange whole = s.span();
  add_input_gaps(s);
  drop_findings_on_ground(s);
  s.result.segments = remaining(flown(s.record, whole), s.unusable, s.limits.shortest_segment_s);
  const auto& segments = s.result.segments;
  for_each_stream(s.record, [&](const std::string&, auto& stream) {
    std::vector<char> keep(stream.size(), 0);
    for (std::size_t i = 0; i < keep.size(); ++i)
      keep[i] = std::any_of(segments.begin(), segments.end(), [&](const TimeRange& g) { return g.contains(stream.t_s[i]); });
    stream = kept(stream, keep);
  });
  if (segments.empty())
    s.refuse(stream_name::flight,
             fmt::format("no part of at least {:.1f} s is left after the exclusions above", s.limits.shortest_segment_s), s.span(),
             "too short a flight, or faults throughout", "fly longer, or repair what the findings name");
}

}  // namespace

CheckedFlight check_flight(const FlightRecord& record, const host::VehicleModel& vehicle, const CheckLimits& limits) {
  CheckState s{.record = record, .vehicle = vehicle, .limits = limits, .result = {}};
  for (const auto step : {check_stamps, check_inputs, check_bounds, check_values, check_inertial, check_motion, check_rotors, check_offsets,
                          check_calibration, cut})
    if (!s.refused()) step(s);
  s.result.flight = std::move(s.record);
  return std::move(s.result);
}

CheckedFlight check_flight(const FlightRecord& record, const CheckLimits& limits) {
  host::VehicleModel any;  // no mass and no radius; arms count by their directions alone
  any.rotors = {host::RotorMount{{1.0, -1.0, 0.0}, -1}, host::RotorMount{{-1.0, 1.0, 0.0}, -1}, host::RotorMount{{1.0, 1.0, 0.0}, 1},
                host::RotorMount{{-1.0, -1.0, 0.0}, 1}};
  return check_flight(record, any, limits);
}

}  // namespace rotorloop::log
