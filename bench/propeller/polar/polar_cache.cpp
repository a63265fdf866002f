#include "bench/propeller/polar/polar_cache.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "host/base/error.hpp"
#include "host/base/sha256.hpp"

namespace rotorloop::propeller {
namespace fs = std::filesystem;
namespace {

std::string as_comments(const std::string& key) {
  std::string out, line;
  for (std::istringstream lines(key); std::getline(lines, line);) out += "# " + line + "\n";
  return out;
}
fs::path file_of(const fs::path& folder, const std::string& key) { return folder / (sha256_text(key).substr(0, 24) + ".toml"); }

}  // namespace

fs::path polar_cache_folder() {
  const auto variable = [](const char* name) {
    const char* v = std::getenv(name);
    return fs::path(v != nullptr ? v : "");
  };
  if (const fs::path cache = variable("XDG_CACHE_HOME"); cache.is_absolute()) return cache / "rotorloop" / "polars";
  if (const fs::path home = variable("HOME"); home.is_absolute()) return home / ".cache" / "rotorloop" / "polars";
  return {};
}

std::optional<sim::Polar> cached_polar(const fs::path& folder, const std::string& key) {
  if (folder.empty()) return std::nullopt;
  std::ifstream in(file_of(folder, key), std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!text.starts_with(as_comments(key))) return std::nullopt;
  try {
    return sim::parse_polar(text, file_of(folder, key));
  } catch (const Error&) {
    return std::nullopt;  // cut off or edited: it is made again
  }
}

fs::path keep_polar(const fs::path& folder, const std::string& key, const std::string& polar_text) {
  if (folder.empty()) return {};
  std::error_code ec;
  fs::create_directories(folder, ec);
  const fs::path file = file_of(folder, key), part = file.string() + fmt::format(".{}", ::getpid());
  std::ofstream out(part, std::ios::binary | std::ios::trunc);
  out << as_comments(key) << polar_text;
  out.close();
  const bool written = !out.fail();
  if (written) fs::rename(part, file, ec);
  if (written && !ec) return file;
  fs::remove(part, ec);
  return {};
}

}  // namespace rotorloop::propeller
