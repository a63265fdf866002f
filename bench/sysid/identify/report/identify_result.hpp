// result.json of `identify`: figures that another program, or a later report, reads without parsing tables.
#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/render/outcome.hpp"
#include "bench/sysid/identify/derived.hpp"
#include "bench/sysid/identify/file_comparison.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/identify/homogeneity.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/identify/observability.hpp"
#include "bench/sysid/identify/solver_check.hpp"
#include "bench/sysid/identify/whiteness.hpp"
#include "bench/sysid/log/check/checks.hpp"

namespace rotorloop::identify {

// All that is made of a fit, for text, JSON and the page.
struct IdentifyAnalysis {
  std::vector<DerivedQuantity> derived;
  std::vector<FlightWhiteness> whiteness;  // of flights with poses
  Homogeneity homogeneity;
  double inflation = 1.0;  // median ratio of robust to classical variance, at least 1: what correlated residuals add
  Observability observability;
  std::optional<SolverCheck> solver_check;       // when it was asked for
  std::optional<HeldOutScores> held_out;         // when flights were held out; analyse() has none
  std::vector<std::string> written_differences;  // of the vehicle file from the estimates (written_vehicle()); analyse() has none
};
IdentifyAnalysis analyse(const Identification& result, const host::VehicleModel& base, double drag_speed_m_s);

struct InputHash {
  std::string path, sha256;
  bool held_out = false;  // had no part in what came of the others
};
nlohmann::ordered_json input_json(const InputHash& input);

// How the fit was asked for, as on the command line; what it held and added is in the result itself.
struct IdentifyConditions {
  std::string vehicle_file;  // that the fit started from
  std::string noise = "em", solver = "own";
  double rate_Hz = 0.0;  // 0: as many states as poses
  double from_s = -1e300, to_s = 1e300;
  double drag_speed_m_s = 0.0, robust_scale = 0.0, block_s = 1.0;
  std::vector<std::string> use = {}, free = {}, hold = {}, per_flight = {};
};
struct IdentifyProvenance {
  std::string version, git, started_utc;
  double wall_s = 0.0;
  std::vector<InputHash> inputs;
  IdentifyConditions conditions = {};
  std::optional<render::Outcome> ended = {};  // where the command knows more than the figures say; see identify_outcome()
};

// Marks beside an estimate: "at its bound" when it stopped at the end of its range, "not identified" when its prior holds more than half of
// what is known ("weighed" for the mass, which no flight can determine; "contradicted" when the flights move it by two of the prior's
// standard deviations all the same), "model error" when the uncertainty that holds for correlated residuals is 5 times the classical one or
// more.
std::string mark_of(const estimate::Estimate& e);

// That the robust uncertainties rest on too few blocks of residuals to hold; empty when they do not.
std::string blocks_note(const estimate::Fit& fit);

// What a reader of the figures must know first.
struct IdentifyWarning {
  std::string where, what;
};
std::vector<IdentifyWarning> warnings_of(const Identification& result, const IdentifyAnalysis& analysis);

// Whether the result may be used, why not, and what to do next: provenance.ended where that is set (interrupted, a vehicle that is not
// credible), else by the fit and its check by another solver.
render::Outcome identify_outcome(const Identification& result, const IdentifyAnalysis& analysis, const IdentifyProvenance& provenance);

// The value tree that text and page are rendered from, and that result.json is.
nlohmann::ordered_json identify_tree(const Identification& result, const IdentifyAnalysis& analysis, const FileComparison& comparison,
                                     const std::vector<log::CheckedFlight>& checked, const IdentifyProvenance& provenance);
// Figures are named "I_xx", "k_1", "static_c_t", …; u is the reported one. Ends with a newline.
std::string identify_result_json(const Identification& result, const IdentifyAnalysis& analysis, const FileComparison& comparison,
                                 const std::vector<log::CheckedFlight>& checked, const IdentifyProvenance& provenance);

}  // namespace rotorloop::identify
