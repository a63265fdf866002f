// How well the identified model foretells flights that had no part in the fit, beside the vehicle file's: open loop from states that
// the poses make (smoothed under large process noise). Below 0.1 s the smoother's own model shows in them: no such horizon is scored.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/identify/identify.hpp"
#include "bench/identify/prediction.hpp"
#include "bench/identify/wrench_score.hpp"

namespace rotorloop::bench {

struct HeldOutRow {
  double horizon_s = 0.0;
  PredictedQuantity quantity = kPredictedPosition;
  double before = 0.0, after = 0.0;  // mean error
  ErrorRatio ratio;                  // after / before at this horizon, 95 % by blocks of 2 s
  double floor = 0.0;                // what noise alone would give the identified model, were it exactly right (noise_floor.hpp)
  ErrorRatio closed;                 // share of the gap that is closed, (before - after) / (before - floor); not a number: no gap
};
struct HeldOutScores {
  std::vector<std::string> flights;
  std::size_t starts = 0;
  std::vector<HeldOutRow> rows;
  HelpfulRange rotation_helps;  // where the identified model beats held rates in attitude
  WrenchComparison wrench;      // of two fits; empty without accelerometer and gyro
};

// 0.1 to 2 s, starts every 0.25 s; no prediction runs across a cut. Throws like identify() for flights that cannot be fitted, and when
// no flight has 2 s in one piece.
HeldOutScores score_held_out(const std::vector<FlightToFit>& flights, const Identification& result, const GridOptions& grid);

// The same for two fits, the first as `before`; both start from the states that the poses make under the second's sensor.
HeldOutScores score_models(const std::vector<FlightToFit>& flights, const Identification& before, const Identification& after,
                           const GridOptions& grid, const WrenchBand& band = {});

// A held-out flight as predictions start from it: states that the readings make, terms remembering along them under the fit's values.
StateTrack held_out_track(GridFlight& flight, const Identification& result);

std::string held_out_table(const HeldOutScores& scores);
std::string held_out_html(const HeldOutScores& scores);  // a section for the report

}  // namespace rotorloop::bench
