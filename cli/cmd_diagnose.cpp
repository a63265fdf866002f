// `rotorloop diagnose`: which physical effect explains what the model leaves unexplained.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/diagnose/report/diagnosis_outcome.hpp"
#include "bench/sysid/diagnose/report/diagnosis_report.hpp"
#include "bench/sysid/diagnose/report/diagnosis_text.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"
#include "cli/commands.hpp"
#include "cli/diagnose_commands.hpp"
#include "cli/diagnose_stand.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/refused_result.hpp"
#include "cli/fit_options.hpp"
#include "cli/progress/progress_line.hpp"
#include "cli/renamed_option.hpp"
#include "host/base/error.hpp"
#include "host/base/nearest.hpp"
#include "host/base/run_clock.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "host/effects/term_size.hpp"
#include "host/effects/user_term.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

struct DiagnoseArguments {
  log::FlightPaths paths;
  fs::path vehicle, out, report, library;
  std::vector<fs::path> stand, reference;
  std::vector<std::string> without;
  identify::FitRequest fit;
  std::vector<double> wrench_band;
  int max_effects = 6;
  double refit_limit_s = 600.0;
  std::size_t placebos = 100;
  std::uint64_t seed = 1;
  bool json = false, no_checks = false, no_priors = false, force = false, quiet = false;
};

diagnose::DiagnoseOptions diagnose_options(const DiagnoseArguments& o, const std::vector<identify::FlightToFit>& flights,
                                           const host::VehicleFile& vehicle, const host::UserTerms* own, estimate::StopFit stop) {
  diagnose::DiagnoseOptions d;
  identify::IdentifyOptions& i = d.identify;
  identify::FitRequest fit = o.fit;
  fit.use_what_all_have(flights);
  fit.free_place_of_accelerometer(vehicle);
  fit.apply(i);
  i.grid.longest_substep_s = 1e-2;  // rotor speeds change over 30 ms, the rest is slower
  i.grid.slopes_by_middle = true;
  std::vector<std::string> terms;
  for (const host::VehicleEffect& e : vehicle.effects) {
    if (host::find_term(e.id)) terms.push_back(e.id);
  }
  i.terms = term_list(terms);
  for (std::size_t t = 0; own && t < own->size(); ++t) {
    d.library.push_back(&(*own)[t]);
    for (const host::VehicleEffect& e : vehicle.effects) {
      if (e.id == (*own)[t].info.id) i.terms.add((*own)[t]);
    }
  }
  i.fit.noise.rounds = 16;
  i.fit.noise.tolerance = 0.05;
  i.fit.max_iterations = 80;
  i.fit.tolerance = 0.02;  // of the log likelihood: far below what any decision turns on
  i.fit.noise.per_flight = true;
  i.fit.stop = stop;
  d.without = o.without;
  d.priors = !o.no_priors;
  d.max_effects = o.max_effects;
  d.refit_limit_s = o.refit_limit_s;
  d.placebos = o.placebos;
  d.seed = o.seed;
  if (!o.wrench_band.empty()) d.wrench_band = {o.wrench_band[0], o.wrench_band[1]};
  return d;
}

// Text or JSON to stdout, the page and result.json into the folder.
void publish(const DiagnoseArguments& o, const diagnose::DiagnosisRun& run, const std::string& vehicle,
             const identify::IdentifyProvenance& from) {
  const std::string json = diagnose::diagnosis_json(run, from);
  if (o.json) {
    fmt::print("{}", json);
  } else {
    fmt::print("{}", diagnose::diagnosis_text(run));
    if (run.held_out) fmt::print("\n{}", identify::held_out_table(*run.held_out));
    fmt::print("{}", render::outcome_text(diagnose::diagnosis_outcome(run.diagnosis, from)));
  }
  if (o.report.empty()) return;
  write_text_file(o.report / "result.json", json);
  write_text_file(o.report / "report.html", diagnose::diagnosis_report_html(run, vehicle, from));
}

// Flights that the checks refuse are a verdict, not an error: the fault is what was to be found. Nothing was fitted to them.
int faulty(const DiagnoseArguments& o, const Error& error, const std::string& vehicle, const RunClock& clock) {
  diagnose::DiagnosisRun run;
  run.diagnosis.verdict = diagnose::DiagnosisVerdict::faulty;
  const ErrorText& text = error.text();
  run.diagnosis.faults.push_back({text.where, "", text.what, 0.0, 0.0});
  publish(o, run, vehicle, {kVersion, kGit, clock.started_utc(), clock.elapsed_s(), {}});
  std::fprintf(stderr, "%s\n", error.what());
  return to_int(ExitCode::data_quality);
}

// The diagnosis stands, and its vehicle cannot be written.
render::Outcome with_problem(render::Outcome outcome, const Error& problem) {
  const render::Outcome refused = refused_outcome(problem);
  outcome.standing = refused.standing;
  outcome.errors = refused.errors;
  outcome.next = refused.next;
  return outcome;
}

using Names = std::vector<std::string>;
// What acts, by kind of input; -q has nothing to silence with the first two.
const Names kStandOptions{"--stand", "--mapping", "--json", "--seed", "--quiet"},
    kCommandLogOptions{"--vehicle", "--mapping", "--flight", "--reference", "--quiet"};

// Those of `given` that are not among `acting`.
Names idle(const Names& given, const Names& acting) {
  Names out;
  std::copy_if(given.begin(), given.end(), std::back_inserter(out),
               [&](const std::string& n) { return std::find(acting.begin(), acting.end(), n) == acting.end(); });
  return out;
}

// What these options would do, nothing else of the call does.
void refuse_idle_options(const DiagnoseArguments& o, const Names& given) {
  const auto refuse = [&](const char* option, bool idle, const char* why, const char* remedy) {
    if (idle && std::find(given.begin(), given.end(), option) != given.end()) throw Error({option, why, "", remedy});
  };
  refuse("--reference", true, "not offered for flights with rotor speeds: only logs of motor commands are compared with reference flights",
         "leave it out, or diagnose the flights one vehicle at a time");
  refuse("--wrench-band", o.paths.held_out.empty(), "does nothing without --held-out",
         "name a flight to score (--held-out), or leave it out");
  refuse("--seed", o.placebos == 0, "does nothing without placebos", "leave out --placebos 0, or this");
}

void refuse_unknown_effects(const Names& ids, const host::EffectCatalogue& catalogue) {
  Names known;
  for (const host::CatalogueEffect& e : catalogue.effects) known.push_back(e.id);
  for (const std::string& id : ids)
    if (!catalogue.find(id))
      throw Error({"--without", fmt::format("\"{}\" is no effect of the catalogue", id), "",
                   did_you_mean(id, known) + "effects/catalogue.toml lists them"});
}

int diagnose_flights(const DiagnoseArguments& o, const host::VehicleFile& base, const host::EffectCatalogue& catalogue,
                     const host::UserTerms* own, const StopSignals& stop) {
  const RunClock clock;
  log::FlightPaths paths = o.paths;
  paths.checks = !o.no_checks;
  log::FlightSet read;
  try {
    read = log::read_flight_set(paths, host::to_model(base), print_findings(o.quiet));
  } catch (const Error& e) {
    if (e.exit_code() != ExitCode::data_quality) throw;
    return faulty(o, e, base.name, clock);
  }
  read.inputs.insert(read.inputs.begin(), {o.vehicle.generic_string(), sha256_file(o.vehicle)});
  if (own) read.inputs.insert(read.inputs.begin() + 1, {o.library.generic_string(), sha256_file(o.library)});
  const ProgressStyle style = progress_style(o.quiet);
  diagnose::FlightsToDiagnose flights{.fitted = read.to_fit(), .held_out = read.held_out(), .findings = {}, .refused = read.refused};
  for (std::size_t f = 0; f < read.checked.size() && f < read.fitted; ++f) flights.findings.push_back(read.checked[f].findings);
  const diagnose::DiagnosisRun run = diagnose::diagnose(flights, base, diagnose_options(o, read.flights, base, own, {stop.flag()}),
                                                        [&](const diagnose::DiagnoseProgress& p) {
                                                          if (style != ProgressStyle::silent)
                                                            fmt::print(stderr, "{:3.0f} %  {}\n", 100.0 * p.done, p.part);
                                                        });
  identify::IdentifyProvenance from{kVersion, kGit, clock.started_utc(), clock.elapsed_s(), read.inputs};
  const bool stopped = run.diagnosis.verdict == diagnose::DiagnosisVerdict::incomplete;
  std::optional<host::VehicleFile> vehicle;
  std::optional<Error> problem;
  if (!o.out.empty() && !stopped) {
    vehicle = identify::identified_vehicle(run.after.fit, base, identify::flown_rpm(run.after.flights),
                                           std::string("rotorloop diagnose ") + kVersion, read.fitted_hashes());
    problem = identify::not_credible(o.out, *vehicle, catalogue);
  }
  if (problem) from.ended = with_problem(diagnose::diagnosis_outcome(run.diagnosis, from), *problem);
  publish(o, run, base.name, from);
  if (stopped) return stop.exit_code();
  // Last: what was found is printed even when no vehicle file can be made of it.
  if (problem) throw *problem;
  if (vehicle) write_text_file(o.out, host::vehicle_text(*vehicle));
  return 0;
}

// `given`: the options that were typed, by their long names.
int diagnose(const DiagnoseArguments& o, const Names& given) {
  if (!o.stand.empty()) {
    diagnose_stand_files({o.stand, o.paths.mapping, o.json, o.seed, idle(given, kStandOptions)});
    return 0;
  }
  if (o.vehicle.empty() || o.paths.flights.empty())
    throw Error({"", fmt::format("{} is missing", o.vehicle.empty() ? "--vehicle" : "--flight"), "",
                 "give --vehicle and --flight; or --stand, for files of a thrust stand"});
  host::EffectCatalogue catalogue = host::builtin_effect_catalogue();
  std::optional<host::UserTerms> own;
  if (!o.library.empty()) {
    own = host::UserTerms::read(o.library, catalogue);
    own->join(catalogue);
  }
  refuse_unknown_effects(o.without, catalogue);
  const host::VehicleFile base = host::read_vehicle(o.vehicle, catalogue);
  if (diagnose_command_logs({o.paths.flights, o.reference, o.paths.mapping, idle(given, kCommandLogOptions)}, host::to_model(base)))
    return 0;
  refuse_idle_options(o, given);
  std::vector<OutputFile> files = report_files("--report", o.report);
  files.push_back({"-o", o.out});
  check_outputs(files, o.force);
  const StopSignals stop;
  try {
    return diagnose_flights(o, base, catalogue, own ? &*own : nullptr, stop);
  } catch (const Error& e) {
    if (!stop.asked()) throw;
    report_unfinished({.command = "diagnose", .report = o.report, .json = o.json}, interrupted_outcome(stop), RunClock());
    return stop.exit_code();
  }
}

}  // namespace

void add_diagnose(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<DiagnoseArguments>();
  CLI::App* c =
      app.add_subcommand("diagnose", "what a vehicle's model leaves unexplained in flight logs, and which physical effect explains it");
  c->add_option("--vehicle", o->vehicle, "vehicle file: nominal model and priors; its effects are part of the model");
  c->add_option("-m,--mapping", o->paths.mapping, "mapping file, for logs of other tools");
  c->add_option("--flight", o->paths.flights, "flights to diagnose");
  c->add_option("--reference", o->reference,
                "for logs with motor commands and no rotor speeds: flights of the same vehicle without the defect");
  c->add_option("--stand", o->stand, "files of a thrust stand instead of flights, read through -m");
  c->add_option("--held-out", o->paths.held_out, "flights for the error before and after; they have no part in the choice");
  c->add_option("-o,--out", o->out, "vehicle file to write, with the effects that were found");
  c->add_option("--report", o->report, "folder for report.html and result.json");
  c->add_option("--library", o->library, "file with effects of your own, considered too (docs/own_terms.md)");
  c->add_option("--without", o->without, "effect that is not considered, by its id in effects/catalogue.toml");
  add_fit_options(*c, o->fit, "states per second, 20 to 1000", 20.0);
  c->add_option("--wrench-band", o->wrench_band,
                "frequencies within which force and torque of held-out flights are scored, Hz; 0: no limit")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::NonNegativeNumber)
      ->default_str("0,10");
  c->add_option("--max-effects", o->max_effects, "effects that may be added")->check(CLI::Range(0, 20))->capture_default_str();
  c->add_option("--refit-limit", o->refit_limit_s,
                "wall time that one refit may take, s; an effect that takes longer is not judged, and a remark says so")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  c->add_option("--placebos", o->placebos, "columns without meaning that set the level of false alarms")
      ->check(CLI::Range(0, 300))
      ->capture_default_str();
  c->add_option("--seed", o->seed, "of the placebos")->capture_default_str();
  c->add_flag("--no-priors", o->no_priors, "no priors from the vehicle file: what it knows is start value only");
  add_old_flag(*c, "--forget", "--no-priors", &o->no_priors);
  c->add_flag("--no-checks", o->no_checks, "use whatever is in the logs, also what the checks would refuse");
  add_force(*c, o->force);
  c->add_flag("--json", o->json, "result.json on stdout instead of tables");
  c->add_flag("-q,--quiet", o->quiet, "no progress, no findings on stderr");
  c->footer(
      "Verdicts: clean, named, ambiguous (a class that these flights cannot distinguish, with the flight that would), unexplained, "
      "faulty.\n"
      "Example: is there anything that the identified vehicle lacks? One flight is kept for the error before and after.\n"
      "  rotorloop diagnose --vehicle identified.toml --flight run/vertical run/horizontal run/rotation --held-out run/general -o "
      "better.toml\n"
      "Example: files of a thrust stand; faults of its sensors first, then one effect at a time.\n"
      "  rotorloop diagnose --stand stand/*.csv -m vehicles/measured/stands/strawson_5inch.mapping.toml\n"
      "Exit codes: 0 done, verdict clean, named, ambiguous or unexplained; 2 usage or bad input file; 5 refused: the logs cannot be used\n"
      "(verdict faulty), or no credible vehicle file (-o) comes of them; 130 and 143 interrupted (verdict incomplete).");
  c->callback([o, c, &exit_code] {
    Names given;
    for (const CLI::Option* option : c->get_options()) {
      if (option->count() > 0) given.push_back(option->get_name());
    }
    exit_code = diagnose(*o, given);
  });
}

}  // namespace rotorloop::cli
