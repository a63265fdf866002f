#include "cli/ending/exit_codes.hpp"

#include <fmt/format.h>

#include <array>

#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

constexpr int code(ExitCode c) { return static_cast<int>(c); }

constexpr std::array<ExitCodeRow, 11> kTable{{
    {code(ExitCode::ok), "ok", "done; what is judged passed"},
    {kExitDefect, "defect", "an error inside rotorloop: please report it"},
    {code(ExitCode::usage), "usage", "bad arguments or a bad input file"},
    {code(ExitCode::device), "device", "device, bus, or a disk that cannot be written"},
    {code(ExitCode::safety), "safety", "a safety trip ended the run"},
    {code(ExitCode::data_quality), "refused", "data quality: the data lack what was asked of them, or what came of them is not credible"},
    {code(ExitCode::verdict), "failed", "judged and failed: a limit was missed, or a flight did not complete"},
    {kExitIncomplete, "incomplete", "not all was flown or measured that the verdict needs"},
    {kExitDiffers, "differs", "a regression or difference against a baseline"},
    {code(ExitCode::interrupted), "interrupted", "SIGINT (Ctrl-C): what was found until then is kept, marked incomplete"},
    {kExitTerminated, "terminated", "SIGTERM: what was found until then is kept, marked incomplete"},
}};

}  // namespace

std::span<const ExitCodeRow> exit_codes() { return kTable; }

std::string exit_codes_text() {
  std::string out = "Exit codes, the same for every command:\n";
  for (const ExitCodeRow& r : kTable) out += fmt::format("  {:>3}  {:<12} {}\n", r.code, r.name, r.meaning);
  return out;
}

}  // namespace rotorloop::cli
