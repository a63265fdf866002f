// What drives the model, rotor speeds or motor commands where there are none: that the motors ran, and that the values come often enough.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::log {
namespace {

double middle_of(RotorValues v) {
  std::sort(v.begin(), v.end());
  return 0.5 * (v[1] + v[2]);
}

// In no flight do three of four motors stand still throughout.
void refuse_motors_off(CheckState& s) {
  constexpr double kOff_rad_s = 20.0, kOff = 0.02;  // a propeller that windmills on the ground; a command below every idle
  const bool speeds = !s.record.rotor_omega_rad_s.empty();
  const Stream<RotorValues>& stream = speeds ? s.record.rotor_omega_rad_s : s.record.motor_command;
  if (stream.size() < 10) return;
  std::vector<double> middle;
  for (const RotorValues& w : stream.value)  // speeds with the wrong sign turn too, and have a refusal of their own
    if (const double m = speeds ? std::abs(middle_of(w)) : middle_of(w); m == m) middle.push_back(m);
  const double most = middle.empty() ? 0.0 : quantile(std::move(middle), 0.99);
  if (most > (speeds ? kOff_rad_s : kOff)) return;
  s.refuse(speeds ? stream_name::rotors : stream_name::command,
           fmt::format("motors are off throughout: the middle of the four stays at or below {:.3g}{} (a flight has more than {}{})", most,
                       speeds ? " rad/s" : " of full scale", speeds ? kOff_rad_s : kOff, speeds ? " rad/s" : ""),
           {stream.t_s.front(), stream.t_s.back()}, "a log of a disarmed vehicle; or columns, zero or full_scale of another output",
           "give a log in which the vehicle flies, or correct the mapping");
}

// Between two samples of what drives the model nothing is known of it: too slow a stream says nothing of how the vehicle turns, though
// every other stream be fast. What counts is how often the values change, as some programs repeat the last one in every row.
void check_input_rate(CheckState& s, const std::string& name, const Stream<RotorValues>& stream) {
  constexpr std::size_t kEnough = 10;
  if (stream.size() < kEnough || s.refused()) return;
  std::vector<double> changes;
  for (std::size_t i = 0; i < stream.size(); ++i)
    if (i == 0 || stream.value[i] != stream.value[i - 1]) changes.push_back(stream.t_s[i]);
  const double step_s = period_s(stream), change_s = changes.size() < kEnough ? step_s : median_step(changes);
  if (std::max(step_s, change_s) <= 1.001 * kLongestInputGap_s) return;
  const bool held = change_s > 1.5 * step_s;
  s.refuse(name,
           fmt::format("{} {:.3g} times a second, every {:.3g} s (allowed {} s): too slow for what a fit needs, the motors' answer within "
                       "some 50 ms",
                       held ? fmt::format("stand in the log at {:.0f} Hz and change", 1.0 / step_s) : std::string("come"), 1.0 / change_s,
                       change_s, kLongestInputGap_s),
           {stream.t_s.front(), stream.t_s.back()},
           held ? "a slow telemetry whose last value is repeated in every row" : "a logging profile with slow motor outputs or ESC reports",
           "log rotor speeds, or else motor commands, at 100 Hz or more (20 Hz at the least)");
}

}  // namespace

void check_inputs(CheckState& s) {
  refuse_motors_off(s);
  if (s.refused()) return;
  if (!s.record.rotor_omega_rad_s.empty())
    check_input_rate(s, stream_name::rotors, s.record.rotor_omega_rad_s);
  else
    check_input_rate(s, stream_name::command, s.record.motor_command);
}

}  // namespace rotorloop::log
