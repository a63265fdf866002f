// Stand against flight for people and programs.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/render/document.hpp"
#include "bench/render/outcome.hpp"
#include "bench/stand/evaluate/compare/flight_thrust.hpp"
#include "bench/stand/evaluate/compare/thrust_comparison.hpp"

namespace rotorloop::stand {

struct ComparisonDocument {
  std::vector<Compared> values;    // stand, flight, hover: at one density
  std::vector<std::string> notes;  // one for each value: how it came about
  std::vector<PairComparison> pairs;
  std::vector<Attribution> causes;  // of the first pair
  std::vector<std::string> remarks;
  double air_density_kg_m3 = 0.0, omega_rad_s = 0.0, margin = 0.0;
  std::string version;
};

bool any_differs(const ComparisonDocument& d);
render::Outcome comparison_outcome(const ComparisonDocument& d);
std::string comparison_text(const ComparisonDocument& d);
std::string comparison_json(const ComparisonDocument& d);
std::string comparison_page(const ComparisonDocument& d);

}  // namespace rotorloop::stand
