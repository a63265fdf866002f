#include "bench/identify/held_out.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/identify/flight_motion.hpp"
#include "bench/identify/mean_noise.hpp"
#include "bench/identify/noise_floor.hpp"
#include "bench/report/svg_pieces.hpp"
#include "host/base/error.hpp"

namespace rotorloop::bench {
namespace {

constexpr double kHorizons_s[] = {0.1, 0.2, 0.5, 1.0, 2.0};
constexpr double kLongest_s = 2.0, kBetweenStarts_s = 0.25;
constexpr std::uint64_t kFloorSeed = 1;
constexpr const char* kQuantityNames[] = {"position", "velocity", "attitude", "body rates"};

// What the terms remember where the flight begins is found from the flight, as its states are; nothing else is.
ModelValues with_starts(const GridFlight& g, const ModelValues& values, const NoiseModel& noise) {
  const host::TermList& terms = values.terms;
  FitProblem p{.start = values, .free = {}, .flights = {&g}, .noise = noise, .flight_noise = {}, .flight_start = {}};
  for (std::size_t k = 0; k < terms.parameters(); ++k) {
    if (!terms.is_start(k) || terms.start_u(k) <= 0.0) continue;
    const int start = kCoreParameters + static_cast<int>(k);
    p.start[start] = 0.0;
    p.free.push_back({start, false, terms.start_u(k)});
  }
  return p.free.empty() ? values : fit(p).values.front();
}

// A ratio of errors that are both nil (one step without excitation) is none.
std::string ratio_text(double v) { return std::isfinite(v) ? fmt::format("{:.2f}", v) : "–"; }

// Of a gap that is there.
std::string closed_text(const ErrorRatio& r) {
  if (!std::isfinite(r.value)) return "– (no gap)";
  return fmt::format("{} ({} to {})", ratio_text(r.value), ratio_text(r.low), ratio_text(r.high));
}

std::string rotation_text(const HeldOutScores& s) {
  if (s.rotation_helps.to_s <= 0.0) return "the rotation model beats held rates nowhere";
  return fmt::format("the rotation model beats held rates from {:.2f} to {:.2f} s", s.rotation_helps.from_s, s.rotation_helps.to_s);
}

}  // namespace

StateTrack held_out_track(GridFlight& g, const Identification& r) {
  const std::vector<BodyState> states = states_by_readings(g, r.fit.values.front(), r.fit.noise.front());
  follow_states({&g, 1}, std::array{states});
  return fitted_track(g, states, with_starts(g, r.fit.values.front(), r.fit.noise.front()));
}

namespace {
HeldOutScores score(const std::vector<FlightToFit>& flights, const ModelValues& old, const Identification& r, const GridOptions& grid) {
  HeldOutScores out;
  std::vector<PredictionErrors> before, after, held, floor;
  const NoiseModel noise = mean_noise(r.fit.noise);
  const ModelValues& identified = r.fit.values.front();
  for (const FlightToFit& f : flights) {
    GridFlight g = make_grid(f.record, grid);
    cut_between_segments(g, f.segments);
    tie_poses(g, identified[kPoseDelay]);
    const StateTrack track = held_out_track(g, r);
    const auto horizon = static_cast<std::size_t>(std::lround(kLongest_s / track.step_s));
    const auto stride = static_cast<std::size_t>(std::max(1L, std::lround(kBetweenStarts_s / track.step_s)));
    auto starts = prediction_starts(track, horizon, stride);
    std::erase_if(starts, [&](std::size_t at) {
      const auto from = g.linked.begin() + static_cast<std::ptrdiff_t>(at);
      const auto to = from + static_cast<std::ptrdiff_t>(std::min(horizon, g.linked.size() - at));
      return std::find(from, to, 0) != to;
    });
    if (starts.empty()) continue;
    before.push_back(predict(track, whole_model(old, g.substeps), starts, horizon));
    after.push_back(predict(track, whole_model(identified, g.substeps), starts, horizon));
    floor.push_back(noise_floor(g, track, identified, r.fit.noise.front(), noise, starts, horizon, kFloorSeed + floor.size()));
    held.push_back(predict(track, rates_held(identified), starts, horizon));
    out.flights.push_back(f.record.name);
  }
  if (after.empty()) {
    throw Error({flights.empty() ? "held-out flights" : flights.front().record.name,
                 fmt::format("no held-out flight has {:.0f} s in one piece", kLongest_s), "the flight is too short, or gaps cut it",
                 "hold out a longer flight"},
                ExitCode::data_quality);
  }
  const PredictionSummary a = summary(before), b = summary(after), least = summary(floor);
  out.starts = b.starts;
  out.rotation_helps = helpful_range(b, summary(held), kPredictedAttitude);
  for (std::size_t q = 0; q < kPredictedQuantities; ++q) {
    for (const double h : kHorizons_s) {
      const auto steps = static_cast<std::size_t>(std::max(1L, std::lround(h / b.step_s)));
      const auto quantity = static_cast<PredictedQuantity>(q);
      out.rows.push_back({static_cast<double>(steps) * b.step_s, quantity, a.mean[q][steps - 1], b.mean[q][steps - 1],
                          error_ratio(after, before, quantity, steps, steps), least.mean[q][steps - 1],
                          share_closed(before, after, floor, quantity, steps, steps)});
    }
  }
  return out;
}

}  // namespace

HeldOutScores score_held_out(const std::vector<FlightToFit>& flights, const Identification& r, const GridOptions& grid) {
  ModelValues old = r.start.file;
  for (const int p : {kRotorDelay, kCommandGain, kCommandOffset, kVoltageExponent, kCommandLag}) old[p] = r.fit.values.front()[p];
  return score(flights, old, r, grid);
}

HeldOutScores score_models(const std::vector<FlightToFit>& flights, const Identification& before, const Identification& after,
                           const GridOptions& grid, const WrenchBand& band) {
  HeldOutScores out = score(flights, before.fit.values.front(), after, grid);
  out.wrench = score_wrenches(flights, before, after, grid, band);
  return out;
}

std::string held_out_table(const HeldOutScores& s) {
  std::string out = fmt::format(
      "Held out: {} ({} starts, open loop). Mean error before -> after, ratio with 95 % interval; floor: what noise alone would give a "
      "model that is right; share of the gap down to it that is closed:\n",
      fmt::join(s.flights, ", "), s.starts);
  for (const HeldOutRow& r : s.rows)
    out += fmt::format("  {:<10} {:5.3f} s  {:9.3g} -> {:9.3g} {:<5}  {:>5} ({} to {})  floor {:9.3g}  closed {}\n",
                       kQuantityNames[r.quantity], r.horizon_s, r.before, r.after, kPredictedUnits[r.quantity], ratio_text(r.ratio.value),
                       ratio_text(r.ratio.low), ratio_text(r.ratio.high), r.floor, closed_text(r.closed));
  return out + "  " + rotation_text(s) + "\n" + wrench_table(s.wrench);
}

std::string held_out_html(const HeldOutScores& s) {
  std::string out = fmt::format(
      "<h2 id=\"held-out\">Flights that had no part in the fit</h2>\n<p>{}; {} starts, open loop with the logged rotor speeds from the "
      "same "
      "smoothed states. Before: the vehicle file; after: identified. Floor: what the noise of readings and motion alone would give a model "
      "that is exactly right; closed: share of the gap between the error before and that floor. {}.</p>\n",
      xml_escaped(fmt::format("{}", fmt::join(s.flights, ", "))), s.starts, rotation_text(s));
  out +=
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">error of</th><th>after, s</th><th>before</th><th>identified</th><th "
      "class=\"l\">unit</th><th>ratio</th><th>95 %</th><th>floor</th><th>closed</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < s.rows.size(); ++i) {
    const HeldOutRow& r = s.rows[i];
    const bool first = i == 0 || s.rows[i - 1].quantity != r.quantity;
    out += fmt::format(
        "<tr{}><td class=\"l\">{}</td><td>{:.3f}</td><td>{:.3g}</td><td class=\"big\">{:.3g}</td><td class=\"l\">{}</td><td "
        "class=\"{}\">{}</td><td>{} … {}</td><td>{:.3g}</td><td>{}</td></tr>\n",
        first ? " class=\"first\"" : "", first ? kQuantityNames[r.quantity] : "", r.horizon_s, r.before, r.after,
        kPredictedUnits[r.quantity],
        r.ratio.high < 1.0  ? "pass"
        : r.ratio.low > 1.0 ? "fail"
                            : "",
        ratio_text(r.ratio.value), ratio_text(r.ratio.low), ratio_text(r.ratio.high), r.floor, closed_text(r.closed));
  }
  return out + "</tbody></table></div>\n" + wrench_html(s.wrench);
}

}  // namespace rotorloop::bench
