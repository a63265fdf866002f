// The report of a run, from the files of its run folder alone: what the page shows can be checked against what was kept, and
// the page can be made again later (`rotorloop hil report RUN`).
#pragma once
#include <filesystem>

#include "bench/hil/flight/hil_report.hpp"

namespace rotorloop::hil {

// Reads run.toml, result.json, the copied scenario and, for each flight and variant, the logs of the first seed. Flights
// whose logs are missing are left out of the plots. Throws Error when the folder is no run folder or a log is damaged.
HilReport read_hil_report(const std::filesystem::path& run_folder);

// Writes <run>/report.html and returns its path.
std::filesystem::path write_hil_report(const std::filesystem::path& run_folder);

}  // namespace rotorloop::hil
