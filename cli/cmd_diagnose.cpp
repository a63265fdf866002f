// `rotorloop diagnose`: which physical effect explains what the model leaves unexplained.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>

#include "bench/sysid/diagnose/diagnosis_run.hpp"
#include "bench/sysid/diagnose/report/diagnosis_outcome.hpp"
#include "bench/sysid/diagnose/report/diagnosis_report.hpp"
#include "bench/sysid/diagnose/report/diagnosis_text.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "cli/commands.hpp"
#include "cli/diagnose_commands.hpp"
#include "cli/diagnose_stand.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/refused_result.hpp"
#include "cli/fit_options.hpp"
#include "cli/progress/progress_line.hpp"
#include "cli/renamed_option.hpp"
#include "cli/shipped_mapping.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

struct DiagnoseArguments {
  diagnose::DiagnosisRequest run;
  fs::path report;
  std::vector<fs::path> stand, reference;
  std::vector<double> wrench_band;
  bool json = false, no_checks = false, no_priors = false, force = false, quiet = false;

  diagnose::DiagnosisRequest request() const {
    diagnose::DiagnosisRequest out = run;
    out.flights.checks = !no_checks;
    out.priors = !no_priors;
    if (!wrench_band.empty()) out.wrench_band = {wrench_band[0], wrench_band[1]};
    return out;
  }
};

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
  refuse("--wrench-band", o.run.flights.held_out.empty(), "does nothing without --held-out",
         "name a flight to score (--held-out), or leave it out");
  refuse("--seed", o.run.placebos == 0, "does nothing without placebos", "leave out --placebos 0, or this");
}

int diagnose_flights(const DiagnoseArguments& o, const StopSignals& stop) {
  const RunClock clock;
  const auto show = [&](const diagnose::DiagnoseProgress& p) {
    // The shares are those of a search that finds as many effects as it may; most end earlier.
    constexpr double kBaseline = 0.3;  // the fit before the search: how long it takes says little of the rest
    const double spent_s = clock.elapsed_s();
    fmt::print(stderr, "{:3.0f} %  {}; {} so far{}\n", 100.0 * p.done, p.part, duration_text(spent_s),
               p.done > kBaseline ? fmt::format(", at most about {} left", duration_text(spent_s * (1.0 - p.done) / p.done)) : "");
  };
  const bool silent = progress_style(o.quiet) == ProgressStyle::silent;
  diagnose::DiagnosisWatch watch{print_findings(o.quiet), {}, {stop.flag()}};
  if (!silent) watch.progress = show;
  const diagnose::DiagnosedFlights found = diagnose::run_diagnosis(o.request(), watch);
  identify::IdentifyProvenance from{kVersion, kGit, clock.started_utc(), clock.elapsed_s(), found.flights.inputs};
  const bool written = !o.run.out.empty() && found.vehicle;
  if (written && found.problem) from.ended = with_problem(diagnose::diagnosis_outcome(found.run.diagnosis, from), *found.problem);
  publish(o, found.run, found.nominal.vehicle.name, from);
  if (found.fault) {
    fmt::print(stderr, "{}\n", found.fault->what());
    return static_cast<int>(found.fault->exit_code());
  }
  if (!found.vehicle) return stop.exit_code();
  // Last: what was found is printed even when no vehicle file can be made of it.
  if (written && found.problem) throw *found.problem;
  if (written) write_text_file(o.run.out, host::vehicle_text(*found.vehicle));
  return 0;
}

// `given`: the options that were typed, by their long names.
int diagnose(const DiagnoseArguments& o, const Names& given) {
  if (!o.stand.empty()) {
    diagnose_stand_files({o.stand, o.run.flights.mapping, o.json, o.run.seed, idle(given, kStandOptions)});
    return 0;
  }
  if (o.run.vehicle.empty() || o.run.flights.flights.empty())
    throw Error({"", fmt::format("{} is missing", o.run.vehicle.empty() ? "--vehicle" : "--flight"), "",
                 "give --vehicle and --flight; or --stand, for files of a thrust stand"});
  if (diagnose_command_logs({o.run.flights.flights, o.reference, o.run.flights.mapping, idle(given, kCommandLogOptions)},
                            host::to_model(diagnose::read_nominal_model(o.run).vehicle)))
    return 0;
  refuse_idle_options(o, given);
  std::vector<OutputFile> files = report_files("--report", o.report);
  files.push_back({"-o", o.run.out});
  check_outputs(files, o.force);
  const StopSignals stop;
  try {
    return diagnose_flights(o, stop);
  } catch (const Error& e) {
    if (!stop.asked()) throw;
    report_unfinished({.command = "diagnose", .report = o.report, .json = o.json}, interrupted_outcome(stop), RunClock());
    return stop.exit_code();
  }
}

}  // namespace

void add_diagnose(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<DiagnoseArguments>();
  CLI::App* c = app.add_subcommand("diagnose", "find the physical effect that a vehicle's model lacks, from the residuals of flight logs");
  c->add_option("--vehicle", o->run.vehicle, "vehicle file: nominal model and priors; its effects are part of the model");
  c->add_option("-m,--mapping", o->run.flights.mapping, kMappingHelp);
  c->add_option("--flight", o->run.flights.flights, "flights to diagnose");
  c->add_option("--reference", o->reference,
                "for logs with motor commands but without rotor speeds: flights of the same vehicle without the defect");
  c->add_option("--stand", o->stand, "files of a thrust stand in place of flights; they need -m");
  c->add_option("--held-out", o->run.flights.held_out,
                "flights that are only predicted, with the model before and after; they do not influence the choice of effects");
  c->add_option("-o,--out", o->run.out, "vehicle file to write, with the effects that were found");
  c->add_option("--report", o->report, "folder for report.html and result.json");
  c->add_option("--library", o->run.library, "file with your own effects, which are also considered (docs/own_terms.md)");
  c->add_option("--without", o->run.without, "id of an effect in effects/catalogue.toml that is not considered");
  add_fit_options(*c, o->run.fit, "estimated states per second, 20 to 1000 Hz", 20.0);
  c->add_option("--wrench-band", o->wrench_band,
                "LOW,HIGH: frequency band in which force and torque of held-out flights are scored, Hz; 0: no limit")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::NonNegativeNumber)
      ->default_str("0,10");
  c->add_option("--max-effects", o->run.max_effects, "highest number of effects that may be added")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  c->add_option("--refit-iterations", o->run.refit_iterations,
                "most iterations of one refit; an effect that needs more is not judged, and the result says so")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  c->add_option("--placebos", o->run.placebos,
                "number of placebos (columns with random phases), which set the threshold for false alarms; 0: none")
      ->check(CLI::Range(0, 300))
      ->capture_default_str();
  c->add_option("--seed", o->run.seed, "seed of the placebos")->capture_default_str();
  c->add_flag("--no-priors", o->no_priors, "use the values of the vehicle file only as start values, not as priors");
  add_old_flag(*c, "--forget", "--no-priors", &o->no_priors);
  c->add_flag("--no-checks", o->no_checks, "use all logs, also those that the checks would refuse");
  add_force(*c, o->force);
  c->add_flag("--json", o->json, "result.json on stdout instead of tables");
  c->add_flag("-q,--quiet", o->quiet, "no progress, no findings on stderr");
  c->footer(
      "Verdicts: clean (nothing is missing), named (an effect was found), ambiguous (several effects that these flights cannot "
      "distinguish;\n"
      "the output proposes a flight that can), unexplained (residuals that no effect explains), faulty (the logs cannot be used).\n"
      "Example: does the identified vehicle lack an effect? One flight is held out to compare the errors before and after.\n"
      "  rotorloop diagnose --vehicle identified.toml --flight run/vertical run/horizontal run/rotation --held-out run/general -o "
      "better.toml\n"
      "Example: files of a thrust stand. Sensor faults are tested first, then one effect at a time.\n"
      "  rotorloop diagnose --stand stand/*.csv -m vehicles/measured/stands/strawson_5inch.mapping.toml\n"
      "Exit codes: 0 done, verdict clean, named, ambiguous or unexplained; 2 bad arguments or input file; 5 refused: the logs cannot be "
      "used\n"
      "(verdict faulty), or the vehicle file for -o would not be credible; 130 and 143 interrupted (verdict incomplete).");
  c->callback([o, c, &exit_code] {
    Names given;
    for (const CLI::Option* option : c->get_options())
      if (option->count() > 0) given.push_back(option->get_name());
    take_shipped_mapping(o->run.flights);
    exit_code = diagnose(*o, given);
  });
}

}  // namespace rotorloop::cli
