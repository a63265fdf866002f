// `rotorloop hil SCENARIO…`: flies scenarios and says whether they passed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <thread>

#include "bench/hil/controllers/autopilot_bridge.hpp"
#include "bench/hil/flight/run_outcome.hpp"
#include "bench/hil/flight/scenario.hpp"
#include "cli/ending/junit.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/stop_signals.hpp"
#include "cli/hil_commands.hpp"
#include "cli/progress/progress_line.hpp"
#include "cli/shipped_files.hpp"
#include "host/base/error.hpp"
#include "host/base/nearest.hpp"
#include "host/base/text_file.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::cli {
namespace {

struct HilArguments {
  std::vector<std::string> scenarios, controllers;
  double controller_timeout_s = hil::ExternalController{}.timeout_s;
  std::string out = "runs", name, seeds, variants, flights, vehicle, pace;
  double catch_up_ms = 1e-6 * static_cast<double>(Deadlines::kCatchUp_ns);
  std::filesystem::path junit;
  int jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  bool json = false, quiet = false, force = false, dry_run = false, no_logs = false;
  PropsOff props;
};

void choose_flights(hil::Scenario& s, const std::string& list) {
  std::vector<hil::FlightPlan> chosen;
  for (std::size_t at = 0; at <= list.size();) {
    const auto comma = std::min(list.find(',', at), list.size());
    const auto name = list.substr(at, comma - at);
    const auto it = std::find_if(s.flights.begin(), s.flights.end(), [&](const auto& f) { return f.name == name; });
    if (it == s.flights.end()) {
      std::vector<std::string> names;
      for (const auto& f : s.flights) names.push_back(f.name);
      throw Error({"--flights", fmt::format("\"{}\" is not a flight of {}", name, s.path.generic_string()), "",
                   did_you_mean(name, names) + fmt::format("use one or more of: {}", fmt::join(names, ","))});
    }
    if (std::any_of(chosen.begin(), chosen.end(), [&](const auto& f) { return f.name == name; }))
      throw Error({"--flights", fmt::format("\"{}\" is given twice", name), "", "give each flight once"});
    chosen.push_back(*it);
    at = comma + 1;
  }
  s.flights = std::move(chosen);
}

// Those of the command line fly beside the variants of the scenario, or beside those of --variants.
void add_controllers(hil::Scenario& s, const HilArguments& o) {
  std::error_code ignored;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", ignored);
  for (const std::string& text : o.controllers) {
    auto c = hil::parse_controller(text);
    c.timeout_s = o.controller_timeout_s;
    if (std::any_of(s.external.begin(), s.external.end(), [&](const auto& other) { return other.name == c.name; }))
      throw Error(
          {"--controller", fmt::format("\"{}\" is the name of two controllers", c.name), "", "write NAME=CONTROLLER with another name"});
    s.external.push_back(std::move(c));
  }
  for (auto& c : s.external)
    if (!self.empty()) c.rotorloop = self;
  if (!o.variants.empty()) s.variants = hil::parse_variants(o.variants, s.external);
  for (const auto& c : s.external)
    if (const auto v = hil::Variant::external(c.name);
        !c.from_scenario && std::find(s.variants.begin(), s.variants.end(), v) == s.variants.end())
      s.variants.push_back(v);
  const auto flies = [&](const auto& c) {
    return std::find(s.variants.begin(), s.variants.end(), hil::Variant::external(c.name)) != s.variants.end();
  };
  for (const auto& c : s.external)
    if (const hil::Bridge* b = hil::bridge_of(c); b && flies(c))
      hil::autopilot_program(b->name, b->variable);  // missing: said before anything flies
}

// What scripts/firmware leaves.
constexpr const char* kBuiltProgram = "build/firmware/bin/b_g431b_esc1.elf";

void find_program(hil::EscChoice& esc) {
  if (!esc.emulated()) return;
  esc.board = shipped_or_given(esc.board);
  const auto built = shipped_or_given(kBuiltProgram);
  if (esc.elf.empty() && std::filesystem::exists(built)) esc.elf = built;
}

hil::Scenario narrowed(const std::string& path, const HilArguments& o) {
  auto s = hil::read_scenario(path);
  find_program(s.esc);
  if (!o.seeds.empty()) s.seeds = hil::parse_seeds(o.seeds);
  if (!o.pace.empty()) {
    const auto pace = hil::parse_pace(o.pace);
    if (!pace) throw Error({"--pace", fmt::format("\"{}\" is no pace", o.pace), "", fmt::format("give {}", hil::kPaceWords)});
    s.bus.pace = *pace;
  }
  add_controllers(s, o);
  if (!o.flights.empty()) choose_flights(s, o.flights);
  if (!o.vehicle.empty()) {
    if (!std::filesystem::is_regular_file(o.vehicle))
      throw Error({"--vehicle", fmt::format("\"{}\": no such file", o.vehicle), "",
                   "give a vehicle file, such as rotorloop identify or calibrate writes"});
    s.vehicle = s.vehicle_given = o.vehicle;
  }
  return s;
}

std::string plan_text(const hil::Scenario& s, const HilArguments& o, const std::string& about_vehicle) {
  std::string out = fmt::format("{}: {} flights x {} variants x {} seeds = {} runs\n", s.name, s.flights.size(), s.variants.size(),
                                s.seeds.size(), s.flights.size() * s.variants.size() * s.seeds.size());
  for (const auto& f : s.flights) out += fmt::format("  flight   {:<16} {}\n", f.name, f.trajectory.generic_string());
  for (const auto& v : s.variants) out += fmt::format("  variant  {}\n", hil::variant_name(v));
  for (const auto& c : s.external) out += fmt::format("  starts   {}: {}\n", c.name, hil::start_line(c));
  out += fmt::format("  seeds    {}\n", fmt::join(s.seeds, ", "));
  out += fmt::format("  plant    {}\n  vehicle  {}\n  gains    {}\n", s.plant.generic_string(), s.vehicle.generic_string(),
                     s.gains.generic_string());
  if (s.esc.emulated()) out += fmt::format("  program  {} (ESCs of kind \"emulated\")\n", s.esc.elf.generic_string());
  out += about_vehicle;
  for (const auto& f : s.faults) {
    const auto target = f.rotor ? fmt::format("rotor {}", f.rotor) : fmt::format("{} bus", hil::bus_name(f.bus));
    out +=
        fmt::format("  fault    {} of {} at {} s{}{}\n", hil::fault_kind_name(f.kind), target, f.at_s,
                    f.duration_s > 0 ? fmt::format(" for {} s", f.duration_s) : " to the end", f.flight.empty() ? "" : " in " + f.flight);
  }
  for (const auto& text : hil::ablation_texts(s.ablation)) out += fmt::format("  ablation {}\n", text);
  out += fmt::format("  limits   {}\n", s.limits.error.size() + s.limits.reduction.size() + s.limits.bus_load.size());
  const auto name = o.name.empty() ? hil::folder_name(s.name) : o.name;
  return out + fmt::format("  writes   {}\n", (std::filesystem::path(o.out) / name).generic_string());
}

void print_result(const hil::Scenario& s, const hil::HilResult& r) {
  fmt::print("{}\n{}\n", s.name, hil::tracking_table_text(s, r.assessment, r.flights));
  if (!r.result.escs.empty()) fmt::print("ESCs:    {}\n", r.result.escs);
  if (const auto controllers = hil::controllers_text(r.assessment); !controllers.empty()) fmt::print("{}\n", controllers);
  if (const auto limits = hil::limits_text(r.assessment); !limits.empty()) fmt::print("{}\n", limits);
  for (const hil::FlightResult& f : r.flights)
    if (f.pace) fmt::print("{}/{}/{}: {}\n", f.flight, hil::variant_name(f.variant), f.seed, hil::pace_text(*f.pace));
  fmt::print("{}run:     {}\nreport:  {}\n", render::outcome_text(hil::outcome_of(r.result, r.folder)), r.folder.generic_string(),
             (r.folder / "report.html").generic_string());
}

// A case for each flight and each limit.
void add_cases(const hil::Scenario& s, const hil::RunResult& r, std::vector<JunitCase>& cases) {
  for (const hil::FlightResult& f : r.flights) {
    const bool completed = f.end == hil::FlightEnd::completed;
    const std::string why = fmt::format("{}{}", hil::flight_end_name(f.end), f.end_detail.empty() ? "" : ": " + f.end_detail);
    cases.push_back({s.name + ".flight", fmt::format("{}/{}/{}", f.flight, hil::variant_name(f.variant), f.seed),
                     completed ? JunitEnd::passed
                     : f.end == hil::FlightEnd::interrupted || f.end == hil::FlightEnd::incomplete || f.end == hil::FlightEnd::late
                         ? JunitEnd::error
                         : JunitEnd::failed,
                     completed ? "" : why});
  }
  for (const hil::LimitResult& l : r.limits) {
    const bool measured = !std::isnan(l.value);
    cases.push_back({s.name + ".limit", l.name,
                     l.pass     ? JunitEnd::passed
                     : measured ? JunitEnd::failed
                                : JunitEnd::error,
                     measured ? fmt::format("{} {} against {} {}", l.value, l.unit, l.limit, l.unit) : "not measured"});
  }
  if (r.verdict == hil::Verdict::incomplete)
    cases.push_back({s.name, "complete", JunitEnd::error, fmt::format("{}", fmt::join(r.errors, "; "))});
}

// What has been flown is shown, whatever becomes of the next scenario.
class HilOutput {
 public:
  explicit HilOutput(const HilArguments& o) : o_(o) {}
  void add(const hil::Scenario& s, const hil::HilResult& r) {
    if (o_.json)
      documents_.push_back(hil::result_json_text(r.result));
    else
      print_result(s, r);
    add_cases(s, r.result, cases_);
    for (const hil::FlightResult& f : r.flights) late_ = late_ || f.end == hil::FlightEnd::late;
    failed_ = failed_ || r.result.verdict == hil::Verdict::fail;
    incomplete_ = incomplete_ || r.result.verdict == hil::Verdict::incomplete;
  }
  void finish() const {
    if (o_.json) fmt::print("{}", documents_.size() == 1 ? documents_.front() : fmt::format("[\n{}]\n", fmt::join(documents_, ",\n")));
    if (!o_.junit.empty()) write_text_file(o_.junit, junit_xml("rotorloop hil", cases_));
  }
  bool late() const { return late_; }
  int exit_code() const {
    return late_ ? to_int(ExitCode::safety) : failed_ ? to_int(ExitCode::verdict) : incomplete_ ? to_int(ExitCode::incomplete) : 0;
  }

 private:
  const HilArguments& o_;
  std::vector<std::string> documents_;
  std::vector<JunitCase> cases_;
  bool failed_ = false, incomplete_ = false, late_ = false;
};

// Everything is read before the first flight: a slip in the last file is not found after an hour.
// `about`: what the check says of each scenario's vehicle.
std::vector<hil::Scenario> read_all(const HilArguments& o, const CheckInputs& check, std::vector<std::string>& about) {
  if (o.scenarios.empty())
    throw Error({"rotorloop hil", "no scenario given", "",
                 "name one or more scenario files, such as scenarios/paper.toml; see rotorloop hil --help"});
  if (!o.name.empty() && o.scenarios.size() > 1)
    throw Error({"--name", fmt::format("names one run, but {} scenarios are given", o.scenarios.size()), "",
                 "leave --name out, or fly one scenario at a time"});
  if (o.dry_run && (o.json || !o.junit.empty()))
    throw Error({o.json ? "--json" : "--junit", "does nothing with --dry-run: there is no result", "", "leave one of them out"});
  std::vector<hil::Scenario> scenarios;
  for (const auto& path : o.scenarios) scenarios.push_back(narrowed(path, o));
  std::map<std::string, std::string> folders;
  for (const auto& s : scenarios) {
    const auto [it, added] = folders.emplace(o.name.empty() ? hil::folder_name(s.name) : o.name, s.path.generic_string());
    if (!added)
      throw Error({s.path.generic_string(), fmt::format("would write the same run folder \"{}\" as {}", it->first, it->second),
                   "both scenarios have the same name", "give them different names"});
  }
  for (const auto& s : scenarios) about.push_back(check ? check(s) : std::string());
  return scenarios;
}

int hil(const HilArguments& o, const std::string& command_line, const RunHil& run, const CheckInputs& check) {
  std::vector<std::string> about;
  const std::vector<hil::Scenario> scenarios = read_all(o, check, about);
  if (o.dry_run) {
    for (std::size_t i = 0; i < scenarios.size(); ++i) fmt::print("{}", plan_text(scenarios[i], o, about[i]));
    return to_int(ExitCode::ok);
  }
  check_outputs({{"--junit", o.junit}}, o.force);
  const StopSignals stop;
  HilOutput output(o);
  for (const auto& s : scenarios) {
    ProgressLine progress(progress_style(o.quiet), stderr);
    hil::RunOptions options;
    options.runs_dir = o.out;
    options.name = o.name;
    options.force = o.force;
    options.logs = !o.no_logs;
    options.jobs = o.jobs;
    options.catch_up_ns = std::llround(1e6 * o.catch_up_ms);
    options.command_line = command_line;
    options.stop = stop.flag();
    try {
      output.add(s, run(s, options, progress));
    } catch (const Error&) {
      output.finish();
      throw;
    }
    if (stop.asked() || output.late()) break;
  }
  output.finish();
  return stop.asked() ? stop.exit_code() : output.exit_code();
}

// The command as typed, for run.toml; parts with blanks are quoted.
std::string typed(const std::vector<std::string>& words) {
  std::string out = "rotorloop hil";
  for (const auto& w : words) out += w.find_first_of(" \t'\"$*") == std::string::npos && !w.empty() ? " " + w : " '" + w + "'";
  return out;
}

std::vector<std::string> words_of(const HilArguments& o) {
  std::vector<std::string> w = o.scenarios;
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) w.insert(w.end(), {name, value});
  };
  add("--seeds", o.seeds);
  add("--variants", o.variants);
  add("--flights", o.flights);
  add("--name", o.name);
  add("--vehicle", o.vehicle);
  add("--pace", o.pace);
  for (const auto& c : o.controllers) add("--controller", c);
  if (o.no_logs) w.push_back("--no-logs");
  return w;
}

// A file with the key `scenario` names one, and who flies it on which bus.
bool is_bench(const HilArguments& o) {
  return std::any_of(o.scenarios.begin(), o.scenarios.end(), [](const auto& path) { return TomlFile::read(path).root().has("scenario"); });
}

int bench(const HilArguments& o, const HilBench& run) {
  if (o.scenarios.size() > 1)
    throw Error({"rotorloop hil", "a bench file beside other files", "its processes have the buses to themselves", "give it alone"});
  if (const auto words = words_of(o); o.json || o.dry_run || !o.junit.empty() || words.size() > (o.name.empty() ? 1u : 3u))
    throw Error({o.scenarios.front(), "is a bench file: of the options only --out, --name, --force, --props-off and --max-rpm apply to it",
                 "", "write flight, variant, seed and pace into the file"});
  return run({.path = o.scenarios.front(), .out = o.out, .name = o.name, .force = o.force, .props = o.props});
}

void add_pace_options(CLI::App& c, HilArguments& o) {
  c.add_option(
      "--pace", o.pace,
      "lockstep (as fast as it goes), realtime, or seconds of flight per second of real time; paced flights are flown one at a time");
  c.add_option("--catch-up", o.catch_up_ms,
               "of a paced flight: ms behind real time that are caught up; further behind, the motors are disarmed and the run ends with 4")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
}

}  // namespace

void add_hil(CLI::App& app, int& exit_code, RunHil run, CheckInputs check, HilBench run_bench) {
  auto* c = app.add_subcommand("hil", "fly scenarios in simulation, with controller and ESC firmware in the loop, and judge the flights");
  auto o = std::make_shared<HilArguments>();
  c->add_option("SCENARIO", o->scenarios, "scenario files, or one bench file (docs/files.md)");
  c->add_option("--out", o->out, "folder in which run folders are created")->capture_default_str();
  c->add_option("--name", o->name, "name of the run folder; default: made from the scenario's name");
  c->add_option("--seeds", o->seeds, "seeds in place of the scenario's: a count N (seeds 1 to N) or a list (1,4,7..9)");
  c->add_option("--variants", o->variants,
                "only these controllers, separated by commas: pd_ff, pd_ff_drag, pd_ff_thrust_drag, pd_ff_no_effects");
  c->add_option("--flights", o->flights, "only these flights of the scenario, names separated by commas");
  c->add_option("--vehicle", o->vehicle, "vehicle file in place of the scenario's: the nominal model of the controller");
  c->add_option(
       "--controller", o->controllers,
       "also fly your own controller: a shared library (./my.so), a command line (\"python3 my.py\"), betaflight, ardupilot or px4 "
       "(the last two: tested with stand-in programs only). NAME=CONTROLLER gives it a name. May be repeated (docs/controller.md)")
      ->allow_extra_args(false);
  c->add_option("--controller-timeout", o->controller_timeout_s, "longest wait for an answer of a --controller, in seconds of real time")
      ->check(CLI::Range(hil::kLeastTimeout_s, hil::kMostTimeout_s))
      ->capture_default_str();
  add_pace_options(*c, *o);
  if (run_bench) add_props_off(*c, o->props);
  c->add_option("-j,--jobs", o->jobs, "flights that run in parallel; the results do not depend on it")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  c->add_option("--junit", o->junit, "also write JUnit XML: a case for each flight and each limit");
  c->add_flag("--no-logs", o->no_logs,
              "write no flight and bus logs: a smaller run folder, without plots over time, that can be compared by its figures only");
  c->add_flag("--json", o->json, "print result.json instead of tables (a list when several scenarios are given)");
  c->add_flag("-q,--quiet", o->quiet, "no progress and no warnings on stderr");
  c->add_flag("--force", o->force, "replace a run folder (and JUnit file) that exists");
  c->add_flag("--dry-run", o->dry_run, "check the scenario and every file that it names, print the plan, fly nothing");
  c->footer(
      "Examples:\n"
      "  rotorloop hil scenarios/paper.toml                     fly it; tables, verdict, runs/paper/report.html\n"
      "  rotorloop hil scenarios/paper.toml --seeds 3 -j 2      a quick look with seeds 1 to 3\n"
      "  rotorloop hil scenarios/paper.toml --dry-run           check the file, fly nothing\n"
      "  rotorloop hil scenarios/paper.toml --name after        give the run folder another name\n"
      "  rotorloop hil scenarios/paper.toml --vehicle identified.toml --name identified\n"
      "  rotorloop hil scenarios/paper.toml --flights horizontal --seeds 1, --controller ./my_controller.so\n"
      "  rotorloop hil compare runs/paper runs/after            which figures changed by more than their scatter\n"
      "  rotorloop hil scenarios/paper.toml --json | jq .verdict\n"
      "\nExit codes: 0 passed, 2 bad arguments or input file, 3 disk or device, 4 a paced flight could not keep up, 6 a limit was missed "
      "or a flight did not complete,\n"
      "7 a limit needs flights that were not flown, 130 and 143 interrupted by SIGINT and SIGTERM (the flights until then are kept).\n"
      "rotorloop --help lists the codes of all commands.");
  add_hil_compare(*c, exit_code);
  add_hil_report(*c, exit_code);
  c->require_subcommand(0, 1);
  c->callback([c, o, run = std::move(run), check = std::move(check), run_bench = std::move(run_bench), &exit_code] {
    if (!c->get_subcommands().empty()) {
      if (!o->scenarios.empty())
        throw Error({"rotorloop hil", fmt::format("\"{}\" before a subcommand", o->scenarios.front()), "",
                     "give scenarios or a subcommand, not both"});
      return;
    }
    exit_code = run_bench && is_bench(*o) ? bench(*o, run_bench) : hil(*o, typed(words_of(*o)), run, check);
  });
}

}  // namespace rotorloop::cli
