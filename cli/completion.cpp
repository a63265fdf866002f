#include "cli/completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <vector>

#include "cli/ending/outputs.hpp"
#include "host/base/text_file.hpp"

namespace rotorloop::cli {
namespace {

// Known only by name, as `completion` itself: not offered.
bool offered(const CLI::App* command) { return !command->get_group().empty(); }

// A branch of `case` for each command: what may follow it. `at`: its words without the program's name.
void add_branches(const CLI::App& app, const std::string& at, std::string& branches) {
  std::vector<std::string> commands, options;
  for (const CLI::App* command : app.get_subcommands(offered)) commands.push_back(command->get_name());
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  }
  branches += fmt::format("    '{}') commands='{}' options='{}' ;;\n", at, fmt::join(commands, " "), fmt::join(options, " "));
  for (const CLI::App* command : app.get_subcommands(offered))
    add_branches(*command, at.empty() ? command->get_name() : at + " " + command->get_name(), branches);
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::string branches;
  add_branches(app, "", branches);
  return fmt::format(
      R"(# bash completion of {0}; written by `{0} completion bash`.
_{0}_words() {{
  case $1 in
{1}    *) return 1 ;;
  esac
}}
_{0}() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} at= next commands= options= i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    next="${{at:+$at }}${{COMP_WORDS[i]}}"
    _{0}_words "$next" && at=$next
  done
  _{0}_words "$at"
  COMPREPLY=()
  local words=$commands
  [[ $cur == -* ]] && words=$options
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$cur"; compgen -f -- "$cur")
}}
complete -o filenames -F _{0} {0}
)",
      app.get_name(), branches);
}

void add_completion(CLI::App& app) {
  auto out = std::make_shared<std::filesystem::path>();
  CLI::App* c = app.add_subcommand("completion", "code that completes commands and options in a shell");
  c->group("");
  CLI::App* bash = c->add_subcommand("bash", "for bash: eval \"$(rotorloop completion bash)\"");
  bash->add_option("--out", *out, "file to write; without it to standard output");
  c->require_subcommand(1);
  auto force = std::make_shared<bool>(false);
  add_force(*bash, *force);
  bash->callback([&app, out, force] {
    check_outputs({{"--out", *out}}, *force);
    if (out->empty())
      fmt::print("{}", bash_completion(app));
    else
      write_text_file(*out, bash_completion(app));
  });
}

}  // namespace rotorloop::cli
