// A fitted blade as one JSON document for programs; its keys are in docs/files.md.
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bench/propeller/fit/blade_fit.hpp"

namespace rotorloop::propeller {

std::string blade_fit_json(const BladeFit& fit, const std::vector<std::pair<std::filesystem::path, std::string>>& written,
                           const std::string& version);

}  // namespace rotorloop::propeller
