#include "cli/ending/exit_codes.hpp"

#include <fmt/format.h>

#include <array>

namespace rotorloop::cli {
namespace {

constexpr std::array<ExitCodeRow, 11> kTable{{
    {ExitCode::ok, "ok", "done; what is judged passed"},
    {ExitCode::defect, "defect", "an error inside rotorloop: please report it"},
    {ExitCode::usage, "usage", "bad arguments or a bad input file"},
    {ExitCode::device, "device", "device, bus, or a disk that cannot be written"},
    {ExitCode::safety, "safety", "a safety trip ended the run"},
    {ExitCode::data_quality, "refused", "data quality: the data lack what was asked of them, or what came of them is not credible"},
    {ExitCode::verdict, "failed", "judged and failed: a limit was missed, or a flight did not complete"},
    {ExitCode::incomplete, "incomplete", "not all was flown or measured that the verdict needs"},
    {ExitCode::differs, "differs", "a regression or difference against a baseline"},
    {ExitCode::interrupted, "interrupted", "SIGINT (Ctrl-C): what was found until then is kept, marked incomplete"},
    {ExitCode::terminated, "terminated", "SIGTERM: what was found until then is kept, marked incomplete"},
}};

}  // namespace

std::span<const ExitCodeRow> exit_codes() { return kTable; }

std::string exit_codes_text() {
  std::string out = "Exit codes, the same for every command:\n";
  for (const ExitCodeRow& r : kTable) out += fmt::format("  {:>3}  {:<12} {}\n", to_int(r.code), r.name, r.meaning);
  return out;
}

}  // namespace rotorloop::cli
