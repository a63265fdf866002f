#include "bench/sysid/identify/held_out.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/sysid/estimate/mean_noise.hpp"
#include "bench/sysid/identify/held_out_track.hpp"
#include "bench/sysid/score/noise_floor.hpp"
#include "host/base/error.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kHorizons_s[] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0};
constexpr double kBetweenStarts_s = 0.25;
constexpr double kSameHorizon = 0.3;  // of a horizon: a whole number of steps that is nearer stands for it
constexpr std::uint64_t kFloorSeed = 1;

struct NoisyModel {
  estimate::ModelValues values;
  estimate::NoiseModel noise;
};

// The steps that stand for each horizon; 0 where none does.
std::size_t steps_of(double horizon_s, double step_s) {
  const double steps = std::round(horizon_s / step_s);
  return std::fabs(steps * step_s - horizon_s) <= kSameHorizon * horizon_s ? static_cast<std::size_t>(steps) : 0;
}

// A held-out flight on the grid, with the states that predictions start from and are compared with.
struct Prepared {
  estimate::GridFlight grid;
  score::StateTrack track;

  // Every so often, where the model ties all steps of the horizon.
  std::vector<std::size_t> starts(std::size_t horizon) const {
    const auto stride = static_cast<std::size_t>(std::max(1L, std::lround(kBetweenStarts_s / track.step_s)));
    auto out = score::prediction_starts(track, horizon, stride);
    std::erase_if(out, [&](std::size_t at) {
      const auto from = grid.linked.begin() + static_cast<std::ptrdiff_t>(at);
      const auto to = from + static_cast<std::ptrdiff_t>(std::min(horizon, grid.linked.size() - at));
      return std::find(from, to, 0) != to;
    });
    return out;
  }
};

// Of the flights as they are, the longest horizon that one of them holds; what is out of reach is reported.
double longest_horizon(const std::vector<Prepared>& flights, std::vector<std::string>& remarks) {
  for (std::size_t h = std::size(kHorizons_s); h-- > 0;) {
    const auto holds = [&](const Prepared& f) {
      const std::size_t steps = steps_of(kHorizons_s[h], f.track.step_s);
      return steps > 0 && !f.starts(steps).empty();
    };
    if (std::none_of(flights.begin(), flights.end(), holds)) continue;
    if (h + 1 < std::size(kHorizons_s)) {
      remarks.push_back(fmt::format("beyond {:g} s there is no prediction: no held-out flight has {:g} s in one piece", kHorizons_s[h],
                                    kHorizons_s[h + 1]));
    }
    return kHorizons_s[h];
  }
  throw Error({flights.empty() ? "held-out flights" : flights.front().grid.name,
               fmt::format("no held-out flight has {:g} s in one piece", kHorizons_s[0]), "the flight is too short, or gaps cut it",
               "hold out a longer flight"},
              ExitCode::data_quality);
}

// Both models open loop from the same states, and what noise alone would do.
void score_horizons(const std::vector<Prepared>& flights, const estimate::ModelValues& old, const NoisyModel& now,
                    const estimate::NoiseModel& smoothed_with, HeldOutScores& out) {
  std::vector<score::PredictionErrors> before, after, held, floor;
  const double longest_s = longest_horizon(flights, out.remarks);
  for (const Prepared& f : flights) {
    const auto horizon = steps_of(longest_s, f.track.step_s);
    const auto starts = f.starts(horizon);
    if (starts.empty()) {
      out.remarks.push_back(fmt::format("{}: not predicted, it has no {:g} s in one piece", f.grid.name, longest_s));
      continue;
    }
    before.push_back(score::predict(f.track, score::whole_model(old, f.grid.substeps), starts, horizon));
    after.push_back(score::predict(f.track, score::whole_model(now.values, f.grid.substeps), starts, horizon));
    floor.push_back(score::noise_floor(f.grid, f.track, now.values, smoothed_with, now.noise, starts, horizon, kFloorSeed + floor.size()));
    held.push_back(score::predict(f.track, score::rates_held(now.values), starts, horizon));
    out.flights.push_back(f.grid.name);
  }
  const score::PredictionSummary a = score::summary(before), b = score::summary(after), least = score::summary(floor);
  out.starts = b.starts;
  out.rotation_helps = score::helpful_range(b, score::summary(held), score::kPredictedAttitude);
  for (std::size_t q = 0; q < score::kPredictedQuantities; ++q) {
    for (const double h : kHorizons_s) {
      const std::size_t steps = steps_of(h, b.step_s);
      if (steps == 0 || steps > b.horizon) continue;
      const auto quantity = static_cast<score::PredictedQuantity>(q);
      out.rows.push_back({static_cast<double>(steps) * b.step_s, quantity, a.mean[q][steps - 1], b.mean[q][steps - 1],
                          score::error_ratio(after, before, quantity, steps, steps), least.mean[q][steps - 1],
                          score::share_closed(before, after, floor, quantity, steps, steps)});
    }
  }
  std::vector<std::string> short_s;
  for (const double h : kHorizons_s) {
    if (h <= longest_s && steps_of(h, b.step_s) == 0) short_s.push_back(fmt::format("{:g}", h));
  }
  if (!short_s.empty()) {
    out.remarks.push_back(fmt::format("{} s: not predicted, a step of the states is {:g} s long; give more states per second (--rate)",
                                      fmt::join(short_s, ", "), b.step_s));
  }
}

HeldOutScores score(const std::vector<FlightToFit>& flights, const NoisyModel& old, const Identification& r,
                    const estimate::GridOptions& grid) {
  HeldOutScores out;
  const NoisyModel now{r.fit.values.front(), estimate::mean_noise(r.fit.noise)};
  std::vector<Prepared> all;
  std::vector<score::OneStepErrors> before, after;
  for (const FlightToFit& f : flights) {
    estimate::GridFlight g = make_grid(f.record, grid);
    cut_between_segments(g, f.segments);
    estimate::associate_poses(g, now.values[estimate::kPoseDelay]);
    score::StateTrack track = held_out_track(g, r);
    all.push_back({std::move(g), std::move(track)});
    const estimate::GridFlight& kept = all.back().grid;
    before.push_back(score::one_step(kept, with_starts(kept, old.values, old.noise), old.noise, kFloorSeed + before.size()));
    after.push_back(score::one_step(kept, with_starts(kept, now.values, now.noise), now.noise, kFloorSeed + after.size()));
  }
  score_horizons(all, old.values, now, r.fit.noise.front(), out);
  out.one_step = score::compare(before, after);
  if (std::string high = floors_above_errors(out.rows); !high.empty()) out.remarks.push_back(std::move(high));
  if (out.one_step.poses == 0) out.remarks.push_back("one step: not scored, the flights have no poses");
  return out;
}

}  // namespace

std::string floors_above_errors(const std::vector<HeldOutRow>& rows) {
  constexpr double kAbove = 1.5;
  constexpr const char* kQuantity[] = {"position", "velocity", "attitude", "body rates"};
  std::vector<std::string> where;
  for (std::size_t q = 0; q < score::kPredictedQuantities; ++q) {
    std::vector<std::string> at_s;
    double highest = 0.0;
    for (const HeldOutRow& r : rows) {
      if (r.quantity != q || !(r.floor > kAbove * r.after)) continue;
      at_s.push_back(fmt::format("{:g}", r.horizon_s));
      highest = std::max(highest, r.floor / r.after);
    }
    if (!at_s.empty()) where.push_back(fmt::format("{} after {} s (up to {:.1f} times)", kQuantity[q], fmt::join(at_s, ", "), highest));
  }
  if (where.empty()) return "";
  return fmt::format(
      "the floor is more than {:g} times the error of {}: the noise that was fitted is larger than that of these flights, and "
      "neither floor nor share closed says anything there",
      kAbove, fmt::join(where, "; "));
}

HeldOutScores score_held_out(const std::vector<FlightToFit>& flights, const Identification& r, const IdentifyOptions& o) {
  // How the log was made is no part of the vehicle: both models get it as identified.
  estimate::ModelValues old = r.start.file;
  for (int p = estimate::kOffsetX; p < estimate::kCoreParameters; ++p) old[p] = r.fit.values.front()[p];
  return score(flights, {old, score::noise_under(old, r.flights, r.fit.noise, o.fit.noise, o.fit.threads)}, r, o.grid);
}

HeldOutScores score_models(const std::vector<FlightToFit>& flights, const Identification& before, const Identification& after,
                           const estimate::GridOptions& grid, const WrenchBand& band) {
  HeldOutScores out = score(flights, {before.fit.values.front(), estimate::mean_noise(before.fit.noise)}, after, grid);
  out.wrench = score_wrenches(flights, before, after, grid, band);
  return out;
}

}  // namespace rotorloop::identify
