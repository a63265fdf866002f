// How a run ended, and what its steps say without an estimate.
#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "bench/stand/run/paired_steps.hpp"
#include "bench/stand/run/session.hpp"

namespace rotorloop::stand_run {

struct RunSummary {
  RunEnd end = RunEnd::running;
  std::optional<Trip> trip;
  std::size_t steps = 0, unsettled = 0;
  std::optional<PairedDifference> thrust, torque;  // what configuration B of abab takes of them
  // Most of its steps rested: with more than a fifth unsettled it says little of steady thrust.
  bool steady() const { return steps > 0 && 5 * unsettled <= steps; }
};

RunSummary summary_of(const Session& session);
nlohmann::ordered_json summary_json(const std::filesystem::path& folder, const RunSummary& summary);

}  // namespace rotorloop::stand_run
