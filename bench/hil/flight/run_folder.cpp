#include "bench/hil/flight/run_folder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <set>

#include "host/base/error.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::hil {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void device_error(const fs::path& path, const std::string& what, const std::string& why) {
  throw Error({path.generic_string(), what, why, "free space, correct the permissions, or choose another folder with --out"},
              ExitCode::device);
}

std::string toml_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      out += std::string("\\") + c;
    else if (u < 0x20 || u == 0x7F)
      out += fmt::format("\\u{:04X}", u);
    else
      out += c;
  }
  return out + "\"";
}

template <class Items, class Text>
std::string toml_list(const Items& items, Text text) {
  std::string out = "[";
  for (const auto& item : items) out += (out.size() > 1 ? ", " : "") + text(item);
  return out + "]";
}

}  // namespace

std::string hash_of_logs(const std::map<std::string, std::string>& logs) {
  Sha256 hash;
  for (const auto& [path, sha] : logs) hash.add(path + " " + sha + "\n");
  return hash.hex();
}

std::string folder_name(const std::string& name) {
  std::string out;
  for (const char raw : name) {
    const char c = raw >= 'A' && raw <= 'Z' ? static_cast<char>(raw - 'A' + 'a') : raw;
    const bool good = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    if (good)
      out += c;
    else if (!out.empty() && out.back() != '-')
      out += '-';
  }
  if (out.size() > 80) out.resize(80);
  while (!out.empty() && out.back() == '-') out.pop_back();
  return out.empty() ? "run" : out;
}

RunFolder RunFolder::create(const fs::path& runs_dir, const std::string& name, bool force) {
  if (name.empty() || name == "." || name == ".." || name.find_first_of("/\\") != std::string::npos)
    throw Error({"--name", fmt::format("\"{}\" cannot name a folder", name), "", "give a name without '/'"});
  const fs::path path = runs_dir / name;
  std::error_code ec;
  if (fs::exists(fs::symlink_status(path, ec))) {
    const bool folder = fs::is_directory(fs::symlink_status(path, ec));
    const bool empty = folder && fs::is_empty(path, ec);
    const bool run = folder && fs::is_regular_file(path / "run.toml", ec);
    if (!empty && !run)
      throw Error({path.generic_string(), "exists and is not a run folder",
                   "it holds no run.toml, so it is not touched, not even with --force",
                   "choose another place with --out or another name with --name"});
    if (!empty && !force)
      throw Error({path.generic_string(), "this run exists already", "the scenario was flown before",
                   "keep both with --name NAME, or replace it with --force"});
    fs::remove_all(path, ec);
    if (ec) device_error(path, "the old run cannot be removed", ec.message());
  }
  fs::create_directories(path, ec);
  if (ec) device_error(path, "cannot be made", ec.message());
  return RunFolder(path);
}

std::map<fs::path, std::string> copy_together(const std::vector<fs::path>& files, const fs::path& folder) {
  std::map<fs::path, fs::path> absolute;  // as given -> real place
  for (const auto& f : files) absolute[f] = fs::absolute(f).lexically_normal();
  fs::path base;
  bool first = true;
  for (const auto& [given, full] : absolute) {
    if (first) {
      base = full.parent_path();
      first = false;
      continue;
    }
    fs::path common;
    const auto parent = full.parent_path();
    for (auto a = base.begin(), b = parent.begin(); a != base.end() && b != parent.end() && *a == *b; ++a, ++b) common /= *a;
    base = common;
  }
  std::map<fs::path, std::string> out;
  for (const auto& [given, full] : absolute) {
    const fs::path relative = full.lexically_relative(base);
    const fs::path target = folder / relative;
    std::error_code ec;
    fs::create_directories(target.parent_path(), ec);
    if (!ec) fs::copy_file(full, target, fs::copy_options::overwrite_existing, ec);
    if (ec) device_error(given, fmt::format("cannot be copied to {}", target.generic_string()), ec.message());
    out[given] = relative.generic_string();
  }
  return out;
}

std::vector<InputFile> RunFolder::copy_inputs(const std::vector<fs::path>& files) {
  inputs_ = copy_together(files, path_ / "inputs");
  std::map<std::string, InputFile> copied;
  for (const auto& [given, relative] : inputs_) copied[relative] = {relative, sha256_file(path_ / "inputs" / relative)};
  std::vector<InputFile> out;
  for (auto& [path, input] : copied) out.push_back(std::move(input));
  return out;
}

std::string RunFolder::input_path_of(const fs::path& file) const {
  const auto it = inputs_.find(file);
  if (it == inputs_.end())
    throw Error({file.generic_string(), "is not among the inputs of this run", "", "name every input file of the run to copy_inputs()"});
  return it->second;
}

void RunFolder::write_run_toml(const RunResult& r, const std::string& command_line, const Scenario& s) const {
  const std::string scenario = "inputs/" + input_path_of(s.path);
  std::string seeds;
  for (const auto seed : s.seeds) seeds += (seeds.empty() ? "" : ",") + std::to_string(seed);
  if (s.seeds.size() == 1) seeds += ',';
  std::string variants;
  for (const auto& v : s.variants) variants += (variants.empty() ? "" : ",") + std::string(variant_name(v));
  const auto number = [](std::uint64_t v) { return std::to_string(v); };
  std::string t = "# All that is needed to repeat this run; paths are relative to this folder.\nformat = 1\n";
  t += fmt::format("scenario = {}\nscenario_file = {}\n", toml_quoted(r.scenario), toml_quoted(scenario));
  t += fmt::format("seeds = {}\n", toml_list(s.seeds, number));
  t += fmt::format("variants = {}\n", toml_list(s.variants, [](const Variant& v) { return toml_quoted(variant_name(v)); }));
  t += fmt::format("flights = {}\n", toml_list(s.flights, [](const FlightPlan& f) { return toml_quoted(f.name); }));
  t += fmt::format("command_line = {}\n", toml_quoted(command_line));
  std::string flights;
  for (const auto& f : s.flights) flights += (flights.empty() ? "" : ",") + f.name;
  std::size_t libraries = 0;
  std::string controllers;
  for (const auto& c : s.external) {
    if (c.from_scenario) {
      libraries += c.library.empty() ? 0u : 1u;
      continue;
    }
    controllers += " --controller " + shell_quoted(argument_text(c, c.library.empty() ? "" : "inputs/" + input_path_of(c.library)));
  }
  const bool all_flown = s.files.size() <= 4 + s.flights.size() + libraries;  // scenario, plant, vehicle, gains and one file per flight
  const std::string vehicle = s.vehicle_given.empty() ? "" : " --vehicle inputs/" + input_path_of(s.vehicle_given);
  t +=
      fmt::format("repeat = {}\n", toml_quoted(fmt::format("rotorloop hil {} --seeds {} --variants {}{}{}{} --name repeat", scenario, seeds,
                                                           variants, all_flown ? "" : " --flights " + flights, vehicle, controllers)));
  t += fmt::format("\n[rotorloop]\nversion = {}\ngit = {}\n", toml_quoted(r.version), toml_quoted(r.git));
  for (const auto& in : r.inputs)
    t += fmt::format("\n[[input]]\npath = {}\nsha256 = {}\n", toml_quoted("inputs/" + in.path), toml_quoted(in.sha256));
  write_text_file(path_ / "run.toml", t);
}

fs::path RunFolder::flight_folder(const std::string& flight, const Variant& variant, std::uint64_t seed) {
  const fs::path path = path_ / flight / variant_name(variant) / std::to_string(seed);
  const std::lock_guard lock(mutex_);
  std::error_code ec;
  fs::create_directories(path, ec);
  if (ec) device_error(path, "cannot be made", ec.message());
  return path;
}

void RunFolder::note_log(const fs::path& log, std::string sha256) {
  if (sha256.empty()) sha256 = sha256_file(log);
  const std::lock_guard lock(mutex_);
  logs_[log.lexically_relative(path_).generic_string()] = std::move(sha256);
}

std::map<std::string, std::string> RunFolder::log_hashes() const {
  const std::lock_guard lock(mutex_);
  return logs_;
}

void RunFolder::write_result(const RunResult& r) const { write_text_file(path_ / "result.json", result_json_text(r)); }

}  // namespace rotorloop::hil
