// Polars that were made before: one file each below $XDG_CACHE_HOME/rotorloop/polars (or ~/.cache). A file begins with all that its numbers
// follow from, as comments, and is used only where every character of that agrees.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "sim/rotor/polar.hpp"

namespace rotorloop::propeller {

// Empty where neither XDG_CACHE_HOME nor HOME is set: nothing is kept then.
std::filesystem::path polar_cache_folder();

std::optional<sim::Polar> cached_polar(const std::filesystem::path& folder, const std::string& key);
// The file, or an empty path where it cannot be written: a full disk costs time, no result.
std::filesystem::path keep_polar(const std::filesystem::path& folder, const std::string& key, const std::string& polar_text);

}  // namespace rotorloop::propeller
