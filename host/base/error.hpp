// Errors that a person can act on: where, what with value and unit, the likely cause, the remedy; and the exit code that
// the command ends with. Thrown while loading and setting up, never from a control loop.
#pragma once
#include <stdexcept>
#include <string>

namespace rotorloop {

// Exit codes of every command (docs/manual.md lists them for users). One tells a script what to do next: one meaning each.
enum class ExitCode : int {
  ok = 0,
  defect = 1,         // an error inside rotorloop
  usage = 2,          // bad arguments or bad input file
  device = 3,         // device or bus
  safety = 4,         // a safety trip ended the run
  data_quality = 5,   // the data lack what was asked of them, or what came of them is not credible
  verdict = 6,        // the run finished and failed its limits
  incomplete = 7,     // not all was flown or measured that the verdict needs
  differs = 8,        // a difference against a baseline
  interrupted = 130,  // SIGINT
  terminated = 143,   // SIGTERM
};
constexpr int to_int(ExitCode code) { return static_cast<int>(code); }

struct ErrorText {
  std::string where;   // "file:line" or the argument
  std::string what;    // what failed: key, value with unit, allowed range
  std::string likely;  // likely cause; may be empty
  std::string remedy;  // what to do; may be empty
};

// what() is the whole message:  WHERE: error: WHAT \n  likely: … \n  do:     …
class Error : public std::runtime_error {
 public:
  explicit Error(ErrorText text, ExitCode exit_code = ExitCode::usage)
      : std::runtime_error(compose(text)), text_(std::move(text)), exit_code_(exit_code) {}
  const ErrorText& text() const { return text_; }
  ExitCode exit_code() const { return exit_code_; }

 private:
  static std::string compose(const ErrorText& t) {
    std::string s = t.where.empty() ? "error: " + t.what : t.where + ": error: " + t.what;
    if (!t.likely.empty()) s += "\n  likely: " + t.likely;
    if (!t.remedy.empty()) s += "\n  do:     " + t.remedy;
    return s;
  }
  ErrorText text_;
  ExitCode exit_code_;
};

}  // namespace rotorloop
