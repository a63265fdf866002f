#include "cli/ending/exit_codes.hpp"

#include <fmt/format.h>

#include <array>

namespace rotorloop::cli {
namespace {

constexpr std::array<ExitCodeRow, 11> kTable{{
    {ExitCode::ok, "ok", "done; if there is a verdict, it is pass"},
    {ExitCode::defect, "defect", "an error inside rotorloop: please report it"},
    {ExitCode::usage, "usage", "bad arguments or a bad input file"},
    {ExitCode::device, "device", "a device or bus failed, or a file cannot be written"},
    {ExitCode::safety, "safety", "a safety trip ended the run"},
    {ExitCode::data_quality, "refused", "data quality: the data are not sufficient, or the result is not credible"},
    {ExitCode::verdict, "failed", "a limit was missed, or a flight did not complete"},
    {ExitCode::incomplete, "incomplete", "the verdict needs flights or measurements that were not made"},
    {ExitCode::differs, "differs", "the result differs from a baseline"},
    {ExitCode::interrupted, "interrupted", "SIGINT (Ctrl-C): results until then are kept and marked incomplete"},
    {ExitCode::terminated, "terminated", "SIGTERM: results until then are kept and marked incomplete"},
}};

}  // namespace

std::span<const ExitCodeRow> exit_codes() { return kTable; }

std::string exit_codes_text() {
  std::string out = "Exit codes, the same for every command:\n";
  for (const ExitCodeRow& r : kTable) out += fmt::format("  {:>3}  {:<12} {}\n", to_int(r.code), r.name, r.meaning);
  return out;
}

}  // namespace rotorloop::cli
