// `rotorloop stand profile list|show|check`: what instruments answer, by their profiles.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "bench/stand/instruments/profile_text.hpp"
#include "cli/stand/bus_commands.hpp"
#include "cli/stand/device_argument.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

int list_profiles(bool json) {
  const auto files = shipped_profiles();
  if (files.empty())
    throw Error({"devices", "no profiles are found", "the command runs from a build tree outside the repository",
                 "install rotorloop, or run it in the repository"});
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const auto& file : files) {
    const modbus::Profile p = modbus::read_profile(file);
    all.push_back({{"name", file.stem().string()},
                   {"vendor", p.vendor},
                   {"model", p.model},
                   {"evidence", p.evidence},
                   {"source", p.source},
                   {"channels", p.channels.size()}});
    if (!json) fmt::print("{:<18} {:<44} {:<9} {}\n", file.stem().string(), p.title(), p.evidence, p.source);
  }
  if (json) fmt::print("{}\n", all.dump(1));
  return 0;
}

int show_profiles(const std::vector<std::string>& names) {
  for (const std::string& name : names) fmt::print("{}\n", modbus::profile_text(modbus::read_profile(profile_path(name))));
  return 0;
}

// Every file has its entry, with what is wrong in it; the first mistake is told on stderr as without --json.
int check_profiles_as_json(const std::vector<std::string>& names) {
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  std::optional<Error> first;
  for (const std::string& name : names) {
    nlohmann::ordered_json one{{"file", name}};
    try {
      const auto path = profile_path(name);
      one["file"] = path.generic_string();
      const modbus::Profile p = modbus::read_profile(path);
      one.update({{"valid", true},
                  {"vendor", p.vendor},
                  {"model", p.model},
                  {"channels", p.channels.size()},
                  {"commands", p.commands.size()},
                  {"evidence", p.evidence},
                  {"source", p.source}});
    } catch (const Error& e) {
      one.update(
          {{"valid", false}, {"where", e.text().where}, {"what", e.text().what}, {"likely", e.text().likely}, {"do", e.text().remedy}});
      if (!first) first = e;
    }
    files.push_back(std::move(one));
  }
  fmt::print("{}\n",
             nlohmann::ordered_json{{"format", 1}, {"command", "stand profile check"}, {"valid", !first}, {"files", files}}.dump(1));
  if (first) throw *first;
  return 0;
}

int check_profiles(const std::vector<std::string>& names, bool json) {
  if (json) return check_profiles_as_json(names);
  for (const std::string& name : names) {
    const auto path = profile_path(name);
    const modbus::Profile p = modbus::read_profile(path);
    fmt::print("{}: {}: {} channels, {} commands; evidence {}\n", path.generic_string(), p.title(), p.channels.size(), p.commands.size(),
               modbus::evidence_text(p));
  }
  return 0;
}

}  // namespace

void add_stand_profile(CLI::App& stand, int& exit_code) {
  CLI::App* group =
      stand.add_subcommand("profile", "profiles of Modbus instruments: registers, types, scales, and the source of each number");
  group->require_subcommand(1);
  auto names = std::make_shared<std::vector<std::string>>();
  auto json = std::make_shared<bool>(false);
  CLI::App* list = group->add_subcommand("list", "list the included profiles");
  list->add_flag("--json", *json, "one JSON document on stdout");
  list->footer("Example:\n  rotorloop stand profile list");
  list->callback([json, &exit_code] { exit_code = list_profiles(*json); });
  CLI::App* show = group->add_subcommand("show", "print a profile with its sources and the sample rate that the serial line allows");
  show->add_option("PROFILE", *names, "name of an included profile, or a profile file")->required();
  show->footer("Example:\n  rotorloop stand profile show laumas_tlb");
  show->callback([names, &exit_code] { exit_code = show_profiles(*names); });
  CLI::App* check = group->add_subcommand("check", "check a profile; mistakes are named with line and column");
  check->add_option("PROFILE", *names, "name of an included profile, or a profile file")->required();
  check->add_flag("--json", *json, "one JSON document on stdout");
  check->footer("Example:\n  rotorloop stand profile check my_indicator.toml\nExit codes: 0 no mistake; 2 a mistake in a profile.");
  check->callback([names, json, &exit_code] { exit_code = check_profiles(*names, *json); });
  group->footer(
      "Examples:\n  rotorloop stand profile list\n  rotorloop stand profile show laumas_tlb\n  rotorloop stand profile check "
      "my_indicator.toml\n"
      "Exit codes: 0 done; 2 a mistake in a profile.");
}

}  // namespace rotorloop::cli
