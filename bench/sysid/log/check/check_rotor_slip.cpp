// Columns of rotor speeds that stand one, two or three places further on from one sample to the next: a telemetry that lost a part of a
// message and goes on with what it takes for the first rotor. Speeds are steady from one sample to the next; a slip shows as a jump in
// all columns at once that vanishes when those behind it are read further on. It needs no turning, and tells the sample.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "bench/sysid/log/check/check_moments.hpp"
#include "bench/sysid/log/check/stream_access.hpp"

namespace rotorloop::log {
namespace {

struct Jump {
  std::size_t at = 0, places = 0;                  // the first sample behind it
  double given = 0.0, shifted = 0.0, usual = 0.0;  // squares of the steps of all columns, rad²/s²
  double ratio = 0.0;
};

// What stands in column k was rotor k + places.
RotorValues further_on(const RotorValues& w, std::size_t places) {
  RotorValues out{};
  for (std::size_t k = 0; k < 4; ++k) out[k] = w[(k + places) % 4];
  return out;
}

double square_of_step(const RotorValues& a, const RotorValues& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < 4; ++k) sum += (b[k] - a[k]) * (b[k] - a[k]);
  return sum;
}

// Samples in flight that differ from the one before: a slower telemetry may be repeated.
std::vector<std::size_t> fresh_in_flight(const Stream<RotorValues>& w, const Grid& grid, const std::vector<char>& in_flight) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < w.size(); ++i)
    if (in_flight[grid.nearest(w.t_s[i])] && (out.empty() || w.value[i] != w.value[out.back()])) out.push_back(i);
  return out;
}

std::optional<Jump> plainest_jump(const Stream<RotorValues>& w, const std::vector<std::size_t>& fresh) {
  constexpr double kShareOfUsual = 0.25;  // below this a step is noise
  std::vector<double> steps;
  for (std::size_t i = 1; i < fresh.size(); ++i) steps.push_back(square_of_step(w.value[fresh[i - 1]], w.value[fresh[i]]));
  const double usual = median(steps);
  if (!(usual > 0.0)) return std::nullopt;
  Jump best;
  for (std::size_t i = 1; i < fresh.size(); ++i)
    for (std::size_t places = 1; places < 4; ++places) {
      const double shifted = square_of_step(w.value[fresh[i - 1]], further_on(w.value[fresh[i]], places));
      const double ratio = steps[i - 1] / (shifted + kShareOfUsual * usual);
      if (ratio > best.ratio) best = {i, places, steps[i - 1], shifted, usual, ratio};
    }
  return best;
}

// Whether the columns stay where they went: one wild sample is no slip.
bool stays(const Stream<RotorValues>& w, const std::vector<std::size_t>& fresh, const Jump& j) {
  constexpr std::size_t kSamples = 5;
  const std::size_t end = std::min(j.at + kSamples, fresh.size());
  double given = 0.0, shifted = 0.0;
  for (std::size_t i = j.at; i < end; ++i) {
    given += square_of_step(w.value[fresh[j.at - 1]], w.value[fresh[i]]);
    shifted += square_of_step(w.value[fresh[j.at - 1]], further_on(w.value[fresh[i]], j.places));
  }
  return end == j.at + kSamples && shifted < 0.5 * given;
}

}  // namespace

void check_rotor_slip(CheckState& s, const Grid& grid, const std::vector<char>& in_flight) {
  // 62 clean measured flights: ratios up to 26, of the nano-drone at 100 Hz; up to 12 in all others.
  constexpr double kRatio = 40.0, kUnusual = 30.0;
  constexpr std::size_t kLeastSamples = 100;
  const auto& w = s.record.rotor_omega_rad_s;
  const std::vector<std::size_t> fresh = fresh_in_flight(w, grid, in_flight);
  if (fresh.size() < kLeastSamples) return;
  const auto jump = plainest_jump(w, fresh);
  if (!jump || jump->ratio < kRatio || jump->given < kUnusual * jump->usual || !stays(w, fresh, *jump)) return;
  const double at_s = w.t_s[fresh[jump->at]];
  constexpr std::array<const char*, 4> kPlaces{"", "one place", "two places", "three places"};
  const auto rms = [](double square) { return std::sqrt(square / 4.0); };
  s.refuse(
      stream_name::rotors,
      fmt::format("all speeds jump at {:.2f} s, by {:.0f} rad/s rms (usual {:.1f}), and by {:.1f} when those from there on are read as "
                  "standing {} further on",
                  at_s, rms(jump->given), rms(jump->usual), rms(jump->shifted), kPlaces[jump->places]),
      {at_s, s.span().to_s}, "a telemetry that lost a part of a message and goes on with the wrong rotor",
      fmt::format("give the part of the log before {:.2f} s, or log again", at_s));
}

}  // namespace rotorloop::log
