// `rotorloop identify`: flight logs in, a vehicle file with uncertainties out.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/identify/file_comparison.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/identify/mass_check.hpp"
#include "bench/sysid/identify/parameter_names.hpp"
#include "bench/sysid/identify/report/identify_report.hpp"
#include "bench/sysid/identify/report/identify_text.hpp"
#include "bench/sysid/identify/report/parameter_history.hpp"
#include "bench/sysid/identify/solver_check.hpp"
#include "bench/sysid/identify/vehicle_priors.hpp"
#include "cli/commands.hpp"
#include "cli/ending/junit.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/refused_result.hpp"
#include "cli/fit_options.hpp"
#include "cli/flight_inputs.hpp"
#include "cli/progress/identify_progress.hpp"
#include "cli/renamed_option.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

struct IdentifyArguments {
  FlightPaths paths;
  fs::path vehicle, out, report, junit;
  std::vector<fs::path> history, compare;
  std::vector<std::string> terms;
  FitOptions fit{.rate_Hz = 100.0};
  double drag_speed_m_s = 8.5;
  double robust_scale = 0.0, block_s = 1.0;
  int iterations = 200;
  std::string noise = "em", solver = "own";
  bool json = false, no_checks = false, no_priors = false, names = false, force = false;
};

identify::IdentifyOptions identify_options(const IdentifyArguments& o, estimate::StopFit stop) {
  identify::IdentifyOptions i;
  o.fit.apply(i);
  i.terms = term_list(o.terms);
  i.fit.noise.rounds = o.noise == "fixed" ? 0 : 30;
  i.fit.noise.per_flight = o.noise == "em-per-flight";
  i.fit.innovations = true;
  i.fit.robust_scale = o.robust_scale;
  i.fit.block_s = o.block_s;
  i.fit.max_iterations = o.iterations;
  i.fit.stop = stop;
  if (!o.no_priors) i.priors = identify::priors_beside_flights;
  i.hold_priors_first = false;
  i.priors_against_scatter = true;
  i.keep_possible = !o.no_priors;
  return i;
}

// Files are named by their file name, and by the whole path where two have the same.
std::vector<identify::ComparedVehicle> read_compared(const std::vector<fs::path>& paths) {
  std::vector<identify::ComparedVehicle> out;
  for (const fs::path& path : paths) {
    const auto same = std::count_if(paths.begin(), paths.end(), [&](const fs::path& other) { return other.filename() == path.filename(); });
    out.push_back({(same > 1 ? path : path.filename()).generic_string(), host::read_vehicle(path, host::builtin_effect_catalogue())});
  }
  return out;
}

identify::IdentifyConditions conditions(const IdentifyArguments& o) {
  return {o.vehicle.filename().generic_string(),
          o.noise,
          o.solver,
          o.fit.rate_Hz,
          o.fit.from_s,
          o.fit.to_s,
          o.drag_speed_m_s,
          o.robust_scale,
          o.block_s,
          o.fit.use,
          o.fit.free,
          o.fit.hold,
          o.fit.per_flight};
}

// What a fit came to, for all that is shown of it.
struct Found {
  FlightInputs read;
  identify::Identification result;
  identify::IdentifyAnalysis analysis;
  identify::FileComparison comparison;
};

std::vector<JunitCase> cases_of(const Found& f, const render::Outcome& outcome) {
  std::vector<JunitCase> out;
  const auto add = [&](const char* group, const std::string& name, bool good, const std::string& why) {
    out.push_back({group, name, good ? JunitEnd::passed : JunitEnd::failed, good ? "" : why});
  };
  for (const log::CheckedFlight& c : f.read.checked) add("identify.log", c.flight.name, true, "");
  for (const log::CheckedFlight& c : f.read.refused)
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
void publish(const IdentifyArguments& o, const Found& f, const host::VehicleFile& base, const std::optional<render::Outcome>& ended,
             const RunClock& clock) {
  std::vector<identify::InputHash> inputs = f.read.inputs;
  for (const fs::path& path : o.compare) inputs.push_back({path.generic_string(), sha256_file(path)});
  const std::vector<log::CheckedFlight> checked = f.read.all_checked();
  const identify::IdentifyProvenance provenance{kVersion, kGit, clock.started_utc(), clock.elapsed_s(), inputs, conditions(o), ended};
  const render::Outcome outcome = identify::identify_outcome(f.result, f.analysis, provenance);
  const std::string json = identify::identify_result_json(f.result, f.analysis, f.comparison, checked, provenance);
  if (o.json)
    fmt::print("{}", json);
  else
    fmt::print("{}{}", identify::identify_text({f.result, f.analysis, f.comparison, checked, provenance, base.name}),
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
      f.result,   f.analysis, f.comparison, checked,
      provenance, base.name,  history,      identify::history_references(f.comparison, f.analysis.derived, f.result.problem.start.terms)};
  write_text_file(o.report / "report.html", identify::identify_report_html(page));
}

// A fit without an end: what the flights disagree about says why, when they do.
Error not_converged(const IdentifyArguments& o, const identify::Identification& result, const identify::IdentifyAnalysis& analysis) {
  std::string moved;
  for (const identify::ParameterHomogeneity& p : analysis.homogeneity.parameters) {
    if (p.moved) moved += (moved.empty() ? "" : ", ") + estimate::parameter_info(p.parameter, result.problem.start.terms).symbol;
  }
  const std::string what = fmt::format("the fit did not converge in {} iterations{}", result.fit.iterations,
                                       o.out.empty() ? "" : "; no vehicle file was written") +
                           (o.solver == "ceres" ? "; nor is there anything that Ceres could check" : "");
  if (moved.empty()) {
    return Error(
        {"", what, "parameters that these flights do not determine",
         o.fit.use == std::vector<std::string>{"none"}
             ? "give the fit the gyro and accelerometer of the logs too (without --use none), hold what the observability table names, or "
               "look at the findings of the checks"
             : "hold what the observability table names (--hold), fit several flights together, or look at the findings of the checks"},
        ExitCode::data_quality);
  }
  return Error({"", what, "estimates differ significantly between flights: " + moved + "; the model lacks an effect that some of them show",
                "add it (--term; `rotorloop diagnose` names it), hold what cannot differ (--hold pose_delay for synchronised logs), or "
                "leave out the flight that disagrees"},
               ExitCode::data_quality);
}

// What keeps the fit from being an answer; none when it is one.
std::optional<Error> problem_of(const IdentifyArguments& o, const Found& f, const host::VehicleFile& base,
                                const host::VehicleFile& vehicle) {
  if (!f.result.fit.converged) return not_converged(o, f.result, f.analysis);
  if (const auto mass = identify::mass_contradicted(f.result, base)) return mass;
  if (f.analysis.solver_check && !f.analysis.solver_check->good())
    return Error(
        {"--solver ceres",
         identify::solver_check_problem(*f.analysis.solver_check) + (o.out.empty() ? "" : "; no vehicle file was written"),
         "one of them ended in a lesser optimum, or the flights leave a direction so nearly open that rounding decides",
         "hold what the weakest directions name (--hold), start from a vehicle file nearer to the vehicle, or report it with the logs"},
        ExitCode::data_quality);
  return not_credible(o.out, vehicle, host::builtin_effect_catalogue());
}

// The fit, and its check by Ceres where that is asked for.
void fit_flights(const IdentifyArguments& o, const host::VehicleFile& base, const identify::IdentifyOptions& options, Found& f) {
  const bool check = o.solver == "ceres";
  IdentifyProgressLine progress(progress_style(o.paths.quiet), stderr, options.fit);
  int parts = 0;
  f.result = identify::identify(f.read.to_fit(), base, options, [&](identify::IdentifyProgress p) {
    parts = p.parts += check ? 1 : 0;
    progress(p);
  });
  f.analysis = identify::analyse(f.result, host::to_model(base), o.drag_speed_m_s);
  if (!check || !f.result.fit.converged) return;
  progress.goes_on_with(identify::check_options(options.fit));
  f.analysis.solver_check = identify::check_by_ceres(f.result, options.fit, [&](const estimate::FitProgress& p) {
    progress({"check by Ceres", parts, parts, p});
  });
}

// Fits, prints (`printed`), and writes the vehicle file. What was found is printed even when no vehicle file can be made of it.
int identify_flights(IdentifyArguments o, const StopSignals& stop, const RunClock& clock, bool& printed) {
  const host::VehicleFile base = host::read_vehicle(o.vehicle, host::builtin_effect_catalogue());
  const std::vector<identify::ComparedVehicle> compared_files = read_compared(o.compare);
  FlightPaths paths = o.paths;
  paths.checks = !o.no_checks;
  Found f;
  f.read = read_flights(paths, host::to_model(base));
  o.fit.use_what_all_have(f.read.flights);
  o.fit.free_place_of_accelerometer(base);
  f.read.inputs.insert(f.read.inputs.begin(), {o.vehicle.generic_string(), sha256_file(o.vehicle)});
  const identify::IdentifyOptions options = identify_options(o, {stop.flag()});
  fit_flights(o, base, options, f);
  if (f.read.flights.size() > f.read.fitted && !stop.asked())
    f.analysis.held_out = identify::score_held_out(f.read.held_out(), f.result, options);
  f.comparison =
      identify::compared(f.result, f.analysis.derived, o.drag_speed_m_s, {o.vehicle.filename().generic_string(), base}, compared_files);
  if (stop.asked()) {
    publish(o, f, base, interrupted_outcome(stop), clock);
    printed = true;
    return stop.exit_code();
  }
  const identify::WrittenVehicle written = identify::written_vehicle(f.result.fit, base, identify::flown_rpm(f.result.flights),
                                                                     std::string("rotorloop identify ") + kVersion, f.read.fitted_hashes());
  const host::VehicleFile& vehicle = written.file;
  f.analysis.written_differences = written.differences;
  const std::optional<Error> problem = problem_of(o, f, base, vehicle);
  publish(o, f, base, problem ? std::optional(refused_outcome(*problem)) : std::nullopt, clock);
  printed = true;
  if (problem) throw *problem;
  if (o.out.empty()) return 0;
  write_text_file(o.out, host::vehicle_text(vehicle));
  if (!o.json) fmt::print("written: {}\n", o.out.generic_string());
  return 0;
}

int identify(const IdentifyArguments& o) {
  const RunClock clock;
  std::vector<OutputFile> files = report_files("--report", o.report);
  files.insert(files.end(), {{"-o", o.out}, {"--junit", o.junit}});
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
  CLI::App* c = app.add_subcommand("identify", "parameters of a vehicle from its flight logs, with uncertainties; writes a vehicle file");
  c->add_option("--vehicle", o->vehicle, "vehicle file: mass and geometry that are known, and start values; needed but for --names");
  c->add_option("-m,--mapping", o->paths.mapping, "mapping file, for logs of other tools");
  c->add_option("--vertical", o->paths.vertical, "stage 1: flight with fast climbs and descents (thrust)");
  c->add_option("--horizontal", o->paths.horizontal, "stage 2: fast horizontal flight (drag)");
  c->add_option("--rotation", o->paths.rotation, "stage 3: flight with quick turns about all axes (inertia, torque)");
  c->add_option("--flight", o->paths.flights, "any other flight, for the joint fit");
  c->add_option("--held-out", o->paths.held_out,
                "flight that has no part in the fit: the identified model predicts it, compared with the vehicle file's");
  c->add_option("-o,--out", o->out, "vehicle file to write");
  c->add_option("--report", o->report, "folder for report.html and result.json");
  c->add_option("--trail", o->history, "folders of earlier reports: each parameter over trials in report.html")->needs("--report");
  c->add_option("--compare", o->compare,
                "vehicle file to compare with (CAD, stand, another trial): difference in percent and z of each parameter; repeatable");
  add_old_option(*c, "--beside", "--compare", &o->compare);
  add_fit_options(*c, o->fit, "states per second, 20 to 1000; 0: as many as poses, between 100 and 500", 0.0);
  c->add_option("--term", o->terms, "add an effect to the model, by its id in effects/catalogue.toml (--names lists them)");
  c->add_option("--noise", o->noise,
                "em: noise figures from the flights, shared by all; em-per-flight: each its own; fixed: built-in figures")
      ->check(CLI::IsMember({"em", "em-per-flight", "fixed"}))
      ->capture_default_str();
  c->add_option("--solver", o->solver,
                "own: elimination of the states; ceres: that, then the joint fit by Ceres as well, slower, and how far the two lie apart")
      ->check(CLI::IsMember({"own", "ceres"}))
      ->capture_default_str();
  c->add_option("--robust", o->robust_scale,
                "a pose farther off than this many standard deviations counts less and less (Cauchy loss), 1 to 100; 0: squares for all")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  c->add_option("--block", o->block_s,
                "length of the blocks whose scatter gives robust u, s: twice what residuals stay correlated for, or more")
      ->check(CLI::Range(0.05, 60.0))
      ->capture_default_str();
  c->add_option("--iterations", o->iterations, "of each fit, at most")->check(CLI::Range(1, 1000))->capture_default_str();
  c->add_option("--drag-speed", o->drag_speed_m_s, "speed at which the total drag is printed, m/s")->capture_default_str();
  c->add_flag("--no-checks", o->no_checks, "fit whatever is in the logs, also what the checks would refuse");
  c->add_flag(
      "--no-priors", o->no_priors,
      "the vehicle file gives start values alone; else what it has from CAD or a stand counts with its u, and a guess as right to a "
      "factor of three");
  c->add_flag("--names", o->names, "list the parameters and terms that can be named, with symbol, unit and meaning, and end");
  c->add_option("--junit", o->junit, "also write JUnit XML: a case for each log, the fit, its check, and the result");
  add_force(*c, o->force);
  c->add_flag("--json", o->json, "result.json on stdout instead of tables");
  c->add_flag("-q,--quiet", o->paths.quiet, "no progress, no findings on stderr");
  c->footer(
      "Example: the paper's three flights, then a fourth that had no part in it\n"
      "  rotorloop identify --vehicle vehicles/reference_guess.toml --vertical run/vertical --horizontal run/horizontal\n"
      "    --rotation run/rotation --held-out run/general -o vehicles/identified.toml --report report\n"
      "A log of another tool needs a mapping file (docs/files.md); one flight without a role is enough when it excites everything:\n"
      "  rotorloop identify --vehicle my.toml -m vehicles/measured/px4_ulog.mapping.toml --flight log.ulg -o out.toml\n"
      "Which names --free, --hold, --per-flight and --term take:\n"
      "  rotorloop identify --names\n"
      "Exit codes: 0 done; 2 usage or bad input file; 5 refused: the logs lack what the fit needs or do not determine a parameter, the fit "
      "did\n"
      "not converge, the identified vehicle is not credible, or --solver ceres gives another answer; 130 and 143 interrupted, what was\n"
      "found is printed, marked incomplete. The message names what, and what to do.");
  c->callback([o, c, &exit_code] {
    if (o->names) {
      for (const CLI::Option* option : c->get_options())
        if (option->count() > 0 && option->get_name() != "--names")
          throw Error({option->get_name(), "does nothing with --names: nothing is fitted", "", "leave one of them out"});
      fmt::print("{}", identify::names_table(host::builtin_effect_catalogue()));
      return;
    }
    // Here and not as `required()`, since --names does without.
    if (o->vehicle.empty()) throw CLI::RequiredError("--vehicle");
    exit_code = identify(*o);
  });
}

}  // namespace rotorloop::cli
