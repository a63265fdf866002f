// What a run comes to, in words: why it did not pass, and what to do next. Text, result.json, page and JUnit say the same.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/hil/flight/run_folder.hpp"
#include "bench/render/outcome.hpp"

namespace rotorloop::hil {

// A line for each flight that did not complete and each limit that was missed or not measured; `planned` flights that were not flown
// count too. Empty for a run that passed.
std::vector<std::string> errors_of(const RunResult& r, std::size_t planned);

// `folder`: of the run; its name stands in the next step, and not where it lies.
render::Outcome outcome_of(const RunResult& r, const std::filesystem::path& folder);

}  // namespace rotorloop::hil
