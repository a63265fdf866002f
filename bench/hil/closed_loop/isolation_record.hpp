// isolation.json of a sandboxed stage: what enforced the sandbox, and every way to the truth that was tried from inside.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/hil/closed_loop/isolation_probe.hpp"

namespace rotorloop::closed_loop {

std::string isolation_record(const std::vector<IsolationProbeResult>& tried);

struct IsolationSummary {
  std::string layers = "not isolated";  // name() of what was used
  std::string enforced_by;              // with versions; empty in runs of older programs
  bool holds = false;
  std::size_t attempts = 0;
  std::vector<std::string> ways;     // without repetition
  std::vector<std::string> opened;   // "its path: plant.toml"
  std::vector<std::string> gave_up;  // layers tried before, and why not
};
IsolationSummary read_isolation_record(const std::filesystem::path& file);  // as not sandboxed when there is no such file

}  // namespace rotorloop::closed_loop
