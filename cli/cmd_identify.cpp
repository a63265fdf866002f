// `rotorloop identify`: flight logs in, a vehicle file with uncertainties out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/identify/identification_run.hpp"
#include "bench/sysid/identify/parameter_names.hpp"
#include "bench/sysid/identify/report/identify_report.hpp"
#include "bench/sysid/identify/report/identify_text.hpp"
#include "bench/sysid/identify/report/parameter_history.hpp"
#include "cli/commands.hpp"
#include "cli/ending/junit.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/refused_result.hpp"
#include "cli/fit_options.hpp"
#include "cli/progress/identify_progress.hpp"
#include "cli/renamed_option.hpp"
#include "cli/shipped_mapping.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

struct IdentifyArguments {
  identify::IdentificationRequest run;
  fs::path report, junit;
  std::vector<fs::path> history;
  std::vector<std::string> terms;
  std::string noise = "em", solver = "own";
  bool quiet = false, json = false, no_checks = false, no_priors = false, names = false, force = false;

  identify::IdentificationRequest request() const {
    identify::IdentificationRequest out = run;
    out.terms = term_list(terms);
    for (const auto n : {identify::NoiseSearch::shared, identify::NoiseSearch::per_flight, identify::NoiseSearch::fixed})
      if (noise == identify::name(n)) out.noise = n;
    out.check_by_ceres = solver == "ceres";
    out.flights.checks = !no_checks;
    out.priors = !no_priors;
    return out;
  }
};

std::vector<JunitCase> cases_of(const identify::IdentificationRun& f, const render::Outcome& outcome) {
  std::vector<JunitCase> out;
  const auto add = [&](const char* group, const std::string& name, bool good, const std::string& why) {
    out.push_back({group, name, good ? JunitEnd::passed : JunitEnd::failed, good ? "" : why});
  };
  for (const log::CheckedFlight& c : f.flights.checked) add("identify.log", c.flight.name, true, "");
  for (const log::CheckedFlight& c : f.flights.refused)
    add("identify.log", c.flight.name, false, "left out, refused by the checks: " + c.refusal->what);
  add("identify.fit", "converged", f.result.fit.converged, "did not converge");
  if (f.analysis.solver_check)
    add("identify.fit", "check by another solver", f.analysis.solver_check->good(),
        identify::solver_check_problem(*f.analysis.solver_check));
  add("identify", "result", outcome.verdict == "pass", outcome.errors.empty() ? outcome.verdict : outcome.errors.front());
  if (outcome.verdict == "incomplete") out.back().end = JunitEnd::error;
  return out;
}

// Text or JSON to stdout, the page and result.json into the folder, JUnit.
void publish(const IdentifyArguments& o, const identify::IdentificationRun& f, const std::optional<render::Outcome>& ended,
             const RunClock& clock) {
  const std::vector<log::CheckedFlight> checked = f.flights.all_checked();
  const identify::IdentifyProvenance provenance{kVersion, kGit, clock.started_utc(), clock.elapsed_s(), f.flights.inputs, f.request, ended};
  const render::Outcome outcome = identify::identify_outcome(f.result, f.analysis, provenance);
  const std::string json = identify::identify_result_json(f.result, f.analysis, f.comparison, checked, provenance);
  if (o.json)
    fmt::print("{}", json);
  else
    fmt::print("{}{}", identify::identify_text({f.result, f.analysis, f.comparison, checked, provenance, f.base.name}),
               render::outcome_text(outcome));
  if (!o.junit.empty()) write_text_file(o.junit, junit_xml("rotorloop identify", cases_of(f, outcome)));
  if (o.report.empty()) return;
  write_text_file(o.report / "result.json", json);
  std::vector<identify::HistoryPoint> history;
  if (!o.history.empty()) {
    std::vector<fs::path> trials = o.history;
    trials.push_back(o.report);
    history = identify::read_history(trials);
  }
  const identify::IdentifyPage page{
      f.result,   f.analysis,  f.comparison, checked,
      provenance, f.base.name, history,      identify::history_references(f.comparison, f.analysis.derived, f.result.problem.start.terms)};
  write_text_file(o.report / "report.html", identify::identify_report_html(page));
}

// Fits, prints (`printed`), and writes the vehicle file. What was found is printed even when no vehicle file can be made of it.
int identify_flights(const IdentifyArguments& o, const StopSignals& stop, const RunClock& clock, bool& printed) {
  std::optional<IdentifyProgressLine> line;
  const auto begins = [&](const estimate::FitOptions& fit) {
    if (line)
      line->goes_on_with(fit);
    else
      line.emplace(progress_style(o.quiet), stderr, fit);
  };
  const identify::IdentificationRun run = identify::run_identification(
      o.request(), {print_findings(o.quiet), begins, [&](const identify::IdentifyProgress& p) { (*line)(p); }, {stop.flag()}});
  line.reset();
  printed = true;
  if (run.stopped) {
    publish(o, run, interrupted_outcome(stop), clock);
    return stop.exit_code();
  }
  publish(o, run, run.problem ? std::optional(refused_outcome(*run.problem)) : std::nullopt, clock);
  if (run.problem) throw *run.problem;
  if (o.run.out.empty()) return 0;
  write_text_file(o.run.out, host::vehicle_text(run.vehicle));
  if (!o.json) fmt::print("written: {}\n", o.run.out.generic_string());
  return 0;
}

int identify(const IdentifyArguments& o) {
  const RunClock clock;
  std::vector<OutputFile> files = report_files("--report", o.report);
  files.insert(files.end(), {{"-o", o.run.out}, {"--junit", o.junit}});
  check_outputs(files, o.force);
  const ResultPlaces places{"identify", o.report, o.junit, o.json};
  const StopSignals stop;
  bool printed = false;
  try {
    return identify_flights(o, stop, clock, printed);
  } catch (const Error& e) {
    if (printed || (!stop.asked() && e.exit_code() != ExitCode::data_quality)) throw;
    report_unfinished(places, stop.asked() ? interrupted_outcome(stop) : refused_outcome(e), clock);
    if (stop.asked()) return stop.exit_code();
    throw;
  }
}

}  // namespace

void add_identify(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<IdentifyArguments>();
  CLI::App* c = app.add_subcommand("identify",
                                   "estimate the parameters of a vehicle from its flight logs, with uncertainties; writes a vehicle file");
  c->add_option("--vehicle", o->run.vehicle, "vehicle file: known mass and geometry, and start values; required except with --names");
  c->add_option("-m,--mapping", o->run.flights.mapping, kMappingHelp);
  c->add_option("--vertical", o->run.flights.vertical, "stage 1: flight with fast climbs and descents (thrust)");
  c->add_option("--horizontal", o->run.flights.horizontal, "stage 2: fast horizontal flight (drag)");
  c->add_option("--rotation", o->run.flights.rotation, "stage 3: flight with quick turns about all axes (inertia, torque)");
  c->add_option("--flight", o->run.flights.flights, "any other flight, used in the joint fit");
  c->add_option("--held-out", o->run.flights.held_out,
                "flight that is not fitted: the identified model and the vehicle file's model predict it, and the errors are compared");
  c->add_option("-o,--out", o->run.out, "vehicle file to write");
  c->add_option("--report", o->report, "folder for report.html and result.json");
  c->add_option("--trail", o->history, "folders of earlier reports: report.html then plots each parameter over all trials")
      ->needs("--report");
  c->add_option("--compare", o->run.compare,
                "vehicle file to compare with (CAD, stand, another trial): difference of each parameter in percent and in standard "
                "uncertainties (z); may be repeated");
  add_old_option(*c, "--beside", "--compare", &o->run.compare);
  add_fit_options(*c, o->run.fit, "estimated states per second, 20 to 1000 Hz; 0: the rate of the poses, limited to 100 to 500 Hz", 0.0);
  c->add_option("--term", o->terms, "add an effect to the model, by its id in effects/catalogue.toml (--names lists them)");
  c->add_option("--noise", o->noise,
                "em: sensor noise estimated from all flights together; em-per-flight: estimated for each flight; fixed: built-in values")
      ->check(CLI::IsMember({"em", "em-per-flight", "fixed"}))
      ->capture_default_str();
  c->add_option(
       "--solver", o->solver,
       "own: the built-in solver; ceres: slower, also solves the joint fit with Ceres and prints the difference of the two results")
      ->check(CLI::IsMember({"own", "ceres"}))
      ->capture_default_str();
  c->add_option("--robust", o->run.robust_scale,
                "outlier limit in standard deviations, 1 to 100: poses beyond it get less weight (Cauchy loss); 0: least squares for all")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  c->add_option("--block", o->run.block_s,
                "length of the blocks that give the robust uncertainty, s: at least twice the correlation time of the residuals")
      ->check(CLI::Range(0.05, 60.0))
      ->capture_default_str();
  c->add_option("--iterations", o->run.iterations, "highest number of iterations of each fit")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  c->add_option("--drag-speed", o->run.drag_speed_m_s, "speed at which the total drag is printed, m/s")->capture_default_str();
  c->add_flag("--no-checks", o->no_checks, "use all logs, also those that the checks would refuse");
  c->add_flag(
      "--no-priors", o->no_priors,
      "use the values of the vehicle file only as start values. Default: values from CAD or a stand are priors with their uncertainty u, "
      "guesses are priors with an uncertainty of a factor of three");
  c->add_flag("--names", o->names, "list all parameters and terms with symbol, unit and meaning, then end");
  c->add_option("--junit", o->junit, "also write JUnit XML: a case for each log, the fit, its check, and the result");
  add_force(*c, o->force);
  c->add_flag("--json", o->json, "result.json on stdout instead of tables");
  c->add_flag("-q,--quiet", o->quiet, "no progress, no findings on stderr");
  c->footer(
      "Example: three identification flights, and a fourth that is only predicted\n"
      "  rotorloop identify --vehicle vehicles/reference_guess.toml --vertical run/vertical --horizontal run/horizontal\n"
      "    --rotation run/rotation --held-out run/general -o vehicles/identified.toml --report report\n"
      "A log of another tool needs a mapping file (docs/files.md). One flight is enough if it contains climbs, fast flight and turns:\n"
      "  rotorloop identify --vehicle my.toml --flight log.ulg -o out.toml\n"
      "List the names for --free, --hold, --per-flight and --term:\n"
      "  rotorloop identify --names\n"
      "Exit codes: 0 done; 2 bad arguments or input file; 5 refused: the logs lack data that the fit needs or do not determine a "
      "parameter,\n"
      "the fit did not converge, the identified vehicle is not credible, or --solver ceres gives a different result; 130 and 143 "
      "interrupted:\n"
      "the results until then are printed and marked incomplete. The message says what is wrong and what to do.");
  c->callback([o, c, &exit_code] {
    if (o->names) {
      for (const CLI::Option* option : c->get_options())
        if (option->count() > 0 && option->get_name() != "--names")
          throw Error({option->get_name(), "does nothing with --names: nothing is fitted", "", "leave one of them out"});
      fmt::print("{}", identify::names_table(host::builtin_effect_catalogue()));
      return;
    }
    // Here and not as `required()`, since --names does without.
    if (o->run.vehicle.empty()) throw CLI::RequiredError("--vehicle");
    take_shipped_mapping(o->run.flights);
    exit_code = identify(*o);
  });
}

}  // namespace rotorloop::cli
