// How well the identified model foretells flights that had no part in the fit, beside the model it started from: open loop from
// states that neither made, so that the starts favour no model.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/identify/identify.hpp"
#include "bench/identify/prediction.hpp"

namespace rotorloop::bench {

struct HeldOutRow {
  double horizon_s = 0.0;
  PredictedQuantity quantity = kPredictedPosition;
  double before = 0.0, after = 0.0;  // mean error
  ErrorRatio ratio;                  // after / before at this horizon, 95 % by blocks of 2 s
};
struct HeldOutScores {
  std::vector<std::string> flights;
  std::size_t starts = 0;
  std::vector<HeldOutRow> rows;
  HelpfulRange rotation_helps;  // where the identified model beats held rates in attitude
};

// One step of the grid, then 0.02 to 2 s. Starts every 0.25 s from states smoothed under process noise so large that the poses make
// them. Throws like identify() for flights that cannot be fitted.
HeldOutScores score_held_out(const std::vector<FlightToFit>& flights, const Identification& result, const GridOptions& grid);

std::string held_out_table(const HeldOutScores& scores);
std::string held_out_html(const HeldOutScores& scores);  // a section for the report

}  // namespace rotorloop::bench
