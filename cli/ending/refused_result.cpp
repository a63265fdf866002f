#include "cli/ending/refused_result.hpp"

#include <fmt/format.h>

#include "bench/hil/flight/unfinished_result.hpp"
#include "cli/ending/junit.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {

render::Outcome refused_outcome(const Error& error) {
  const ErrorText& t = error.text();
  return {"refused",
          render::Standing::bad,
          t.likely.empty() ? "" : "Likely: " + t.likely + ".",
          {t.where.empty() ? t.what : t.where + ": " + t.what},
          t.remedy};
}

render::Outcome interrupted_outcome(const StopSignals& stop) {
  return {"incomplete",
          render::Standing::open,
          "What stands here was found before; it is no answer.",
          {"interrupted by " + stop.name()},
          "run the same command again with --force: nothing of it is taken over"};
}

void report_unfinished(const ResultPlaces& places, const render::Outcome& outcome, const RunClock& clock) {
  const hil::UnfinishedResult r{
      places.command, kVersion, kGit, clock.started_utc(), clock.elapsed_s(), {}, "No result of rotorloop " + places.command, outcome};
  if (places.json) fmt::print("{}", hil::unfinished_json(r));
  if (!places.report.empty()) hil::write_unfinished(places.report, r);
  if (places.junit.empty()) return;
  const std::string why = outcome.errors.empty() ? outcome.verdict : outcome.errors.front();
  write_text_file(places.junit, junit_xml("rotorloop " + places.command, {{places.command, "result", JunitEnd::error, why}}));
}

}  // namespace rotorloop::cli
