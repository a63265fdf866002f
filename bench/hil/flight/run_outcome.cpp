#include "bench/hil/flight/run_outcome.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace rotorloop::hil {
namespace {

std::string place_of(const FlightResult& f) { return fmt::format("{}/{}/{}", f.flight, variant_name(f.variant), f.seed); }

std::string limit_text(const LimitResult& l) {
  if (std::isnan(l.value)) return fmt::format("limit not measured: {}", l.name);
  return fmt::format("limit missed: {}: {:.4g} {}, allowed {} {:.4g} {}", l.name, l.value, l.unit, l.upper ? "at most" : "at least",
                     l.limit, l.unit);
}

bool ended(const RunResult& r, FlightEnd end) {
  return std::any_of(r.flights.begin(), r.flights.end(), [&](const FlightResult& f) { return f.end == end; });
}

std::string next_step(const RunResult& r, const std::filesystem::path& folder) {
  const std::string run = (folder.filename().empty() ? folder.parent_path() : folder).filename().generic_string();
  const bool unmeasured = std::any_of(r.limits.begin(), r.limits.end(), [](const LimitResult& l) { return std::isnan(l.value); });
  switch (r.verdict) {
    case Verdict::pass:
      return fmt::format("keep it as a baseline: rotorloop hil compare {} OTHER_RUN shows what a change does", run);
    case Verdict::fail:
      if (ended(r, FlightEnd::crashed) || ended(r, FlightEnd::safe_state))
        return "look at errors over time and limiters of the flight that did not complete; the manual has a table of its reasons "
               "(Troubleshooting)";
      return "look at errors over time and limiters of the flights whose limit was missed, then change vehicle file or gains and fly again "
             "with --name";
    case Verdict::incomplete:
      break;
  }
  if (ended(r, FlightEnd::late))
    return "fly it at a lower --pace, on a machine with less to do, or with what the warnings say about real time";
  if (ended(r, FlightEnd::incomplete))
    return "look at controller.log in the folder of the flight that its controller did not finish, then fly it again with --force";
  if (ended(r, FlightEnd::interrupted) || !unmeasured) return "fly it again with --force; what was flown until then is in the folder";
  return "fly all flights, controllers and seeds that the limits name: leave out --flights, --variants and --seeds";
}

}  // namespace

std::vector<std::string> errors_of(const RunResult& r, std::size_t planned) {
  std::vector<std::string> out;
  if (r.flights.size() < planned) out.push_back(fmt::format("{} of {} flights were flown", r.flights.size(), planned));
  for (const FlightResult& f : r.flights)
    if (f.end != FlightEnd::completed)
      out.push_back(fmt::format("flight {} {}{}", place_of(f), flight_end_name(f.end), f.end_detail.empty() ? "" : ": " + f.end_detail));
  for (const LimitResult& l : r.limits)
    if (!l.pass) out.push_back(limit_text(l));
  return out;
}

render::Outcome outcome_of(const RunResult& r, const std::filesystem::path& folder) {
  const auto completed =
      std::count_if(r.flights.begin(), r.flights.end(), [](const FlightResult& f) { return f.end == FlightEnd::completed; });
  const auto met = std::count_if(r.limits.begin(), r.limits.end(), [](const LimitResult& l) { return l.pass; });
  render::Outcome out{.verdict = std::string(verdict_name(r.verdict))};
  out.standing = r.verdict == Verdict::pass   ? render::Standing::good
                 : r.verdict == Verdict::fail ? render::Standing::bad
                                              : render::Standing::open;
  out.sentence = fmt::format("{} of {} flights completed, ", completed, r.flights.size());
  out.sentence += r.limits.empty() ? "no limit was set." : fmt::format("{} of {} limits met.", met, r.limits.size());
  out.errors = r.errors.empty() ? errors_of(r, 0) : r.errors;  // of a run that an older version flew
  out.next = next_step(r, folder);
  return out;
}

}  // namespace rotorloop::hil
