// result.json and report.html of a command that was refused or stopped before it had a result: the folder then says so itself, instead of
// holding nothing, or the result of an earlier run.
#pragma once
#include <filesystem>
#include <string>

#include "bench/hil/flight/run_folder.hpp"
#include "bench/render/outcome.hpp"

namespace rotorloop::hil {

struct UnfinishedResult {
  std::string command, version, git, started_utc;
  double wall_s = 0.0;
  std::vector<InputFile> inputs;
  std::string title;  // of the page
  render::Outcome outcome;
};

std::string unfinished_json(const UnfinishedResult& r);  // ends with a newline
// Writes both files into `folder`, which exists.
void write_unfinished(const std::filesystem::path& folder, const UnfinishedResult& r);

}  // namespace rotorloop::hil
