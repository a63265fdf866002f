// An estimate for people and programs: one tree of sections for terminal and page, result.json, and the figures of the page.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/render/document.hpp"
#include "bench/render/outcome.hpp"
#include "bench/stand/evaluate/estimate/advance_torque.hpp"
#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "bench/stand/evaluate/estimate/variance_components.hpp"

namespace rotorloop::stand {

struct EstimatedFile {
  StandEstimate estimate;
  std::optional<AdvanceTorque> advance;
  std::string verdict = "clean";  // of the diagnosis; faulty: has no part in the components of variance
};

struct EstimateDocument {
  std::vector<EstimatedFile> files;
  std::optional<VarianceComponents> c_t_components, c_q_components;
  std::vector<std::string> remarks;  // of the files against each other
  std::string version, command;
  std::vector<std::pair<std::string, std::string>> inputs;  // path, sha256
  double reference_density_kg_m3 = 1.225;
};

render::Outcome estimate_outcome(const EstimateDocument& d);
render::Sections estimate_sections(const EstimateDocument& d, bool with_figures);
std::string estimate_text(const EstimateDocument& d);
std::string estimate_json(const EstimateDocument& d);
std::string estimate_page(const EstimateDocument& d);

// Static drawings of one run: coefficient against ω², residuals, hysteresis, budget.
std::string estimate_figures(const StandEstimate& e);
// Thrust (N, g), current, power, g/W, N/A and efficiency over rotor speed, and over the voltage of the motor where that is known; nothing
// without thrust.
std::string operating_figures(const StandEstimate& e);
// Speed, thrust and torque over the run's time, which zoom together; nothing where the file has steps only.
std::string sample_figures(const StandEstimate& e);

}  // namespace rotorloop::stand
