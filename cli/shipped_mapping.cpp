#include "cli/shipped_mapping.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/sysid/log/read_flight.hpp"
#include "cli/shipped_files.hpp"

namespace rotorloop::cli {

std::filesystem::path mapping_or_shipped(const std::filesystem::path& given, const std::vector<std::filesystem::path>& logs) {
  if (!given.empty() || logs.empty()) return given;
  const std::string_view name = log::shipped_mapping_of(logs.front());
  const auto same = [&](const std::filesystem::path& log) { return log::shipped_mapping_of(log) == name; };
  if (name.empty() || !std::all_of(logs.begin() + 1, logs.end(), same)) return given;
  const std::filesystem::path mapping = shipped_or_given(name);
  fmt::print(stderr, "note: {} is read by the shipped mapping {}; --mapping takes another\n",
             logs.size() == 1 ? logs.front().generic_string() : fmt::format("each of {} logs", logs.size()), mapping.generic_string());
  return mapping;
}

void take_shipped_mapping(log::FlightPaths& paths) {
  std::vector<std::filesystem::path> all;
  for (const auto* some : {&paths.vertical, &paths.horizontal, &paths.rotation, &paths.flights, &paths.held_out})
    all.insert(all.end(), some->begin(), some->end());
  paths.mapping = mapping_or_shipped(paths.mapping, all);
}

}  // namespace rotorloop::cli
