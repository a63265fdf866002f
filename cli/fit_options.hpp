// What every command that fits flights takes and shows alike: options of the fit, terms by their ids, and what the checks of the logs find.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/sysid/identify/identification_run.hpp"

namespace rotorloop::cli {

// --free, --hold, --per-flight, --use, --rate (`rate_help`, from `least_rate_Hz` to 1000), --from and --to.
void add_fit_options(CLI::App& app, identify::FitRequest& o, const std::string& rate_help, double least_rate_Hz);

// The terms of these ids. Throws Error (usage) for an unknown or repeated one.
host::TermList term_list(const std::vector<std::string>& ids);

// Findings on stderr as each flight is checked, unless `quiet`, and a warning for each flight that is left out.
log::ReadingWatch print_findings(bool quiet);

// Writes what a reader of vehicle files accepts, else throws not_credible() (data quality).
void write_checked(const std::filesystem::path& path, const host::VehicleFile& v, const host::EffectCatalogue& catalogue);

}  // namespace rotorloop::cli
