// Turns a good shipped file into a bad one by one edit, and keeps the message that the reader answers with.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::sim::test {

inline std::string shipped(const std::string& path) {
  std::ifstream in(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/" + path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// Replaces the first `from` in the shipped file by `to`, reads it with `read`, and returns the message without the folder.
// The message must name the line of the edit (or `line_of`, when the fault shows elsewhere).
template <class Read>
std::string message_after(const std::string& path, const std::string& from, const std::string& to, Read read, std::string line_of = "") {
  std::string text = shipped(path);
  const auto at = text.find(from);
  if (at == std::string::npos) return "the shipped file has no \"" + from + "\"";
  text.replace(at, from.size(), to);
  if (line_of.empty()) line_of = to;
  const auto mark = text.find(line_of);
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(mark), '\n');
  const std::string name = std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/" + path;
  try {
    const TomlFile file = TomlFile::parse(text, name);
    (void)read(file);
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    EXPECT_THAT(std::string(e.what()), ::testing::StartsWith(name + ":" + std::to_string(line) + ": error: "));
    return e.what();
  }
  return "(no error)";
}

}  // namespace rotorloop::sim::test
