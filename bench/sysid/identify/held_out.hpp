// How well the identified model predicts flights that had no part in the fit, beside the vehicle file's. Open loop, 0.01 to 2 s, from
// states that the measurements make (smoothed under large process noise) and against them: up to some 0.05 s most of an error is the noise
// of those states, so each stands beside the floor that noise alone would give. One step: each pose from the measurements before it,
// without any smoothing; here a model that is right is known by errors as large as it expects them.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/identify/wrench_score.hpp"
#include "bench/sysid/score/one_step.hpp"
#include "bench/sysid/score/prediction.hpp"

namespace rotorloop::identify {

struct HeldOutRow {
  double horizon_s = 0.0;
  score::PredictedQuantity quantity = score::kPredictedPosition;
  double before = 0.0, after = 0.0;  // mean error
  score::ErrorRatio ratio;           // after / before at this horizon, 95 % by blocks of 2 s
  double floor = 0.0;                // what noise alone would give the identified model, were it exactly right (noise_floor.hpp)
  score::ErrorRatio closed;          // share of the gap that is closed, (before - after) / (before - floor); not a number: no gap
};
struct HeldOutScores {
  std::vector<std::string> flights;
  std::size_t starts = 0;
  std::vector<HeldOutRow> rows;        // by quantity, then horizon
  score::OneStepComparison one_step;   // empty without poses
  std::vector<std::string> remarks;    // what could not be scored, and why
  score::HelpfulRange rotation_helps;  // where the identified model beats held rates in attitude
  WrenchComparison wrench;             // of two fits; empty without accelerometer and gyro
};

// 0.01 to 2 s as far as the flights and their grid reach, starts every 0.25 s; no prediction runs across a cut. The vehicle file's model
// reads through the sensors as identified, and its noise figures are looked for on the fitted flights as `options` says. Throws like
// identify() for flights that cannot be fitted, and when no flight has even the shortest horizon in one piece.
HeldOutScores score_held_out(const std::vector<FlightToFit>& flights, const Identification& result, const IdentifyOptions& options);

// A sentence where the floor stands above 1.5 times the error that was measured, with the quantities and horizons; empty where it does
// nowhere. The noise that such a floor is made of is larger than that of the flights: its share closed says nothing.
std::string floors_above_errors(const std::vector<HeldOutRow>& rows);

// The same for two fits, the first as `before`, each with the noise figures of its own; both start from the same states.
HeldOutScores score_models(const std::vector<FlightToFit>& flights, const Identification& before, const Identification& after,
                           const estimate::GridOptions& grid, const WrenchBand& band = {});

std::string held_out_table(const HeldOutScores& scores);
std::string held_out_html(const HeldOutScores& scores);  // a section for the report
// For result.json.
nlohmann::ordered_json held_out_json(const HeldOutScores& scores);

}  // namespace rotorloop::identify
