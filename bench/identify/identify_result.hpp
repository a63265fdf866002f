// result.json of `identify`: figures that another program, or a later report, reads without parsing tables.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bench/identify/checks.hpp"
#include "bench/identify/derived.hpp"
#include "bench/identify/held_out.hpp"
#include "bench/identify/homogeneity.hpp"
#include "bench/identify/identify.hpp"
#include "bench/identify/observability.hpp"
#include "bench/identify/solver_check.hpp"
#include "bench/identify/whiteness.hpp"

namespace rotorloop::bench {

// All that is made of a fit, for text, JSON and the page.
struct IdentifyAnalysis {
  std::vector<DerivedQuantity> derived;
  std::vector<FlightWhiteness> whiteness;  // of flights with poses
  Homogeneity homogeneity;
  double inflation = 1.0;  // median ratio of robust to classical variance, at least 1: what correlated residuals add
  Observability observability;
  std::optional<SolverCheck> solver_check;  // when it was asked for
  std::optional<HeldOutScores> held_out;  // when flights were held out; analyse() has none
};
IdentifyAnalysis analyse(const Identification& result, const host::VehicleModel& base, double drag_speed_m_s);

struct InputHash {
  std::string path, sha256;
  bool held_out = false;  // had no part in what came of the others
};
nlohmann::ordered_json input_json(const InputHash& input);
struct IdentifyProvenance {
  std::string version, git, started_utc;
  double wall_s = 0.0;
  std::vector<InputHash> inputs;
};
// Figures are named "I_xx", "k_1", "static_c_t", …; u is the reported one. Ends with a newline.
std::string identify_result_json(const Identification& result, const IdentifyAnalysis& analysis, const std::vector<CheckedFlight>& checked,
                                 const IdentifyProvenance& provenance);

// What a trail over several results needs.
struct TrailPoint {
  std::string label;  // folder of the result
  std::vector<std::string> names, units;
  std::vector<double> value, u;
};
// Reads result.json, given itself or its folder. Throws Error for anything but a result of `identify`.
TrailPoint read_trail_point(const std::filesystem::path& path);

}  // namespace rotorloop::bench
