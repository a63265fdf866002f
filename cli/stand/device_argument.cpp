#include "cli/stand/device_argument.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "cli/ending/refusal.hpp"
#include "cli/shipped_files.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {
namespace fs = std::filesystem;
}

std::vector<fs::path> shipped_profiles() {
  std::vector<fs::path> found;
  const fs::path folder = shipped_or_given("devices");
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".toml") found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

fs::path profile_path(const std::string& text) {
  std::error_code error;
  if (fs::is_regular_file(text, error)) return text;
  std::vector<std::string> names;
  for (const fs::path& p : shipped_profiles()) {
    if (p.stem() == text || p.filename() == text) return p;
    names.push_back(p.stem().string());
  }
  const fs::path below = shipped_or_given(text);
  if (fs::is_regular_file(below, error)) return below;
  const std::string looked = names.empty() ? "; " + places_looked_in(fs::path("devices") / (text + ".toml")) : "";
  throw Error({"", fmt::format("\"{}\" is neither a file nor an included profile{}", text, looked), "",
               names.empty() ? "give the path of a profile" : use_one_of(text, names)});
}

std::vector<DeviceArgument> device_arguments(const std::vector<std::string>& words) {
  std::vector<DeviceArgument> out;
  for (const std::string& word : words) {
    DeviceArgument d;
    const auto at = word.rfind('@');
    const fs::path path = profile_path(word.substr(0, at));
    d.profile = modbus::read_profile(path);
    d.slave = d.profile.slave;
    if (at != std::string::npos) {
      const std::string digits = word.substr(at + 1);
      const auto [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), d.slave);
      if (failed != std::errc() || end != digits.data() + digits.size() || d.slave < 1 || d.slave > 247)
        throw Error({"PROFILE", fmt::format("\"{}\" has the address \"{}\"", word, digits), "",
                     "give the slave address, 1 to 247, such as laumas_tlb@2"});
    }
    d.name = path.stem().string();
    for (DeviceArgument& other : out) {
      if (other.slave == d.slave)
        throw Error({"PROFILE", fmt::format("{} and {} have the same address {}", other.name, d.name, d.slave), "",
                     "give each an address of its own, such as laumas_tlb@2"});
      if (other.profile.path == d.profile.path) d.name = fmt::format("{}@{}", path.stem().string(), d.slave);
    }
    out.push_back(std::move(d));
  }
  return out;
}

}  // namespace rotorloop::cli
