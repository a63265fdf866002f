// result.json of `identify`: figures that another program, or a later report, reads without parsing tables.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/render/outcome.hpp"
#include "bench/sysid/identify/identification_run.hpp"

namespace rotorloop::identify {

nlohmann::ordered_json input_json(const log::InputHash& input);
// Every estimate of the fit with its uncertainties and mark, whether or not a vehicle file can be made of them.
nlohmann::ordered_json estimates_json(const Identification& result);

struct IdentifyProvenance {
  std::string version, git, started_utc;
  double wall_s = 0.0;
  std::vector<log::InputHash> inputs;
  IdentificationRequest conditions = {};
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
