// Errors on stderr in one style: WHERE: error: WHAT, then likely cause and remedy. WHERE is a file with its line, or the command with the
// option that was typed: what was typed is never blamed on a file.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "host/base/error.hpp"

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace rotorloop::cli {

// The commands that the words name, "rotorloop hil compare", and the deepest of them.
struct TypedCommand {
  std::string name;
  const CLI::App* app = nullptr;
};
TypedCommand typed_command(const CLI::App& app, int argc, const char* const* argv);

// The first command or option that does not exist, with the nearest that does; none when all are known.
std::optional<ErrorText> unknown_word(const CLI::App& app, int argc, const char* const* argv);

// What CLI11 found wrong, in the style of the house.
ErrorText refusal_of(const CLI::ParseError& error, const TypedCommand& command);

// Message of an error as it goes to stderr: `command` stands before what names an option of it.
std::string refusal_text(const ErrorText& text, const std::string& command);

// "did you mean "x"? use one of: a, b" for remedies.
std::string use_one_of(const std::string& word, const std::vector<std::string>& allowed);

}  // namespace rotorloop::cli
