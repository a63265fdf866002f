// Options that have a new name: the old one works on, is not in --help, and says on stderr what it is called now.
#pragma once
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace rotorloop::cli {

inline void say_renamed(const std::string& old_name, const std::string& name) {
  fmt::print(stderr, "warning: {} is called {} now\n", old_name, name);
}

inline void add_old_flag(CLI::App& c, const std::string& old_name, const std::string& name, bool* value) {
  c.add_flag_callback(old_name, [=] {
     say_renamed(old_name, name);
     *value = true;
   })->group("");
}

inline void add_old_option(CLI::App& c, const std::string& old_name, const std::string& name, std::vector<std::filesystem::path>* value) {
  c.add_option_function<std::vector<std::string>>(old_name, [=](const std::vector<std::string>& paths) {
     say_renamed(old_name, name);
     value->insert(value->end(), paths.begin(), paths.end());
   })->group("");
}

}  // namespace rotorloop::cli
