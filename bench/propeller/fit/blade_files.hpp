// Blade file and the polar files beside it, as vehicles/blades and vehicles/polars hold them.
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bench/propeller/fit/blade_fit.hpp"

namespace rotorloop::propeller {

std::string polar_file_text(const sim::Polar& polar);

// Path and text of each file: the blade at `out`, its polars in ../polars beside the folder of `out`, named after the blade.
std::vector<std::pair<std::filesystem::path, std::string>> blade_files(const BladeFit& fit, const std::filesystem::path& out,
                                                                       const std::string& written_by);

}  // namespace rotorloop::propeller
