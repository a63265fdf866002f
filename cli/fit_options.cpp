#include "cli/fit_options.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "cli/ending/refusal.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"

namespace rotorloop::cli {

void add_fit_options(CLI::App& app, identify::FitRequest& o, const std::string& rate_help, double least_rate_Hz) {
  app.add_option("--free", o.free,
                 "NAME or NAME=U: fit a parameter or group; U: standard uncertainty of its start value, in its unit (`rotorloop identify "
                 "--names` lists names and units)");
  app.add_option("--hold", o.hold, "NAME: keep a parameter or group at its start value");
  app.add_option("--per-flight", o.per_flight, "NAME: fit a separate value of a parameter or group for each flight");
  app.add_option(
         "--use", o.use,
         "measurements in addition to the poses: gyro, accel, velocity; load: position of a slung load (payload_x[m] …); none: poses "
         "only. Default: gyro and accel, if all logs have them")
      ->delimiter(',')
      ->check(CLI::IsMember({"gyro", "accel", "velocity", "load", "none"}));
  app.add_option("--rate", o.rate_Hz, rate_help)->check(CLI::Range(least_rate_Hz, 1000.0))->capture_default_str();
  app.add_option("--from", o.from_s, "use only samples from this time of the log on, s");
  app.add_option("--to", o.to_s, "use only samples up to this time of the log, s");
}

host::TermList term_list(const std::vector<std::string>& ids) {
  host::TermList list;
  for (const std::string& id : ids) {
    const host::Term* term = host::find_term(id);
    if (!term) {
      std::vector<std::string> known;
      for (const host::Term& t : host::all_terms()) known.emplace_back(t.info.id);
      throw Error({"--term " + id, "is no term that can be fitted", "", use_one_of(id, known)});
    }
    if (!list.add(*term)) throw Error({"--term " + id, "is given twice", "", "give it once"});
  }
  return list;
}

log::ReadingWatch print_findings(bool quiet) {
  log::ReadingWatch out;
  if (!quiet) out.checked = [](const log::CheckedFlight& c) { fmt::print(stderr, "{}", log::findings_table(c)); };
  out.read = [](const log::FlightSet& flights) {
    for (const log::CheckedFlight& r : flights.refused)
      fmt::print(stderr, "warning: {} is left out, refused by the checks: {}\n", r.flight.name, r.refusal->what);
  };
  return out;
}

void write_checked(const std::filesystem::path& path, const host::VehicleFile& v, const host::EffectCatalogue& catalogue) {
  if (const auto problem = identify::not_credible(path, v, catalogue)) throw *problem;
  write_text_file(path, host::vehicle_text(v));
}

}  // namespace rotorloop::cli
