#include "bench/hil/closed_loop/run.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <map>

#include "bench/hil/closed_loop/isolation_record.hpp"
#include "bench/hil/closed_loop/loop_result.hpp"
#include "bench/hil/closed_loop/report.hpp"
#include "bench/hil/closed_loop/run_layout.hpp"
#include "bench/hil/closed_loop/stage.hpp"
#include "bench/hil/closed_loop/workspace.hpp"
#include "bench/hil/flight/run_folder.hpp"
#include "bench/hil/flight/unfinished_result.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "host/base/toml_file.hpp"
#include "host/effects/term.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "sim/plant/plant_file.hpp"
#include "sim/rotor/blade.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFlownPlant = "flown_plant.toml";
constexpr const char* kSandboxRemedy =
    "install the Debian package bubblewrap and allow user namespaces (sysctl user.max_user_namespaces, kernel.unprivileged_userns_clone; "
    "in a "
    "container its security options), or use a kernel with Landlock";

std::string file_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// The plan with what it names, copied into the run: the run repeats from its own folder.
struct CopiedInputs {
  std::map<fs::path, std::string> place;  // as given -> below inputs/
  fs::path plant;                         // with the injected effects, below inputs/
  StageInputs hashes;                     // of what decides how a flight goes
};

std::vector<fs::path> files_of(const LoopPlan& p) {
  std::vector<fs::path> files{p.path, p.plant, p.vehicle, p.gains};
  for (const auto& f : p.learn) files.push_back(f.trajectory);
  for (const auto& f : p.held_out) files.push_back(f.trajectory);
  for (const auto& f : p.judged) files.push_back(f.flight.trajectory);
  const auto plant = sim::read_plant(p.plant);
  for (const auto& r : plant.rotors) {
    files.insert(files.end(), {r.blade_path, r.motor_path});
    const auto polars = sim::read_blade(r.blade_path).polar_files;
    files.insert(files.end(), polars.begin(), polars.end());
  }
  return files;
}

class Loop {
 public:
  Loop(const LoopPlan& plan, const LoopOptions& options, fs::path run) : plan_(plan), o_(options), at_{std::move(run)} {}

  void go() {
    copy_inputs();
    fly();
    fly_judged("2-before", at_.before(), "inputs/" + inputs_.place.at(plan_.vehicle));
    analyse("3-identify", at_.identify(), "identify", plan_.identify_arguments);
    analyse("4-diagnose", at_.diagnose(), "diagnose", plan_.diagnose_arguments);
    fly_with_estimate("5-identified", at_.identified(), at_.identified_vehicle());
    fly_with_estimate("6-after", at_.after(), at_.diagnosed_vehicle());
  }

 private:
  void message(const std::string& stage, const std::string& text) const {
    if (o_.message) o_.message(stage, text);
  }

  void copy_inputs() {
    const auto files = files_of(plan_);
    std::error_code ec;
    fs::remove_all(at_.inputs(), ec);
    inputs_.place = hil::copy_together(files, at_.inputs());
    for (const auto& [given, place] : inputs_.place) {
      // The vehicle counts where it is flown or read, the plan by what it makes of the scenarios.
      if (given != plan_.vehicle && given != plan_.path) inputs_.hashes["inputs/" + place] = sha256_file(at_.inputs() / place);
    }
    const fs::path plant = inputs_.place.at(plan_.plant);
    inputs_.plant = plant.parent_path() / kFlownPlant;
    write_text_file(at_.inputs() / inputs_.plant, plant_with(file_text(at_.inputs() / plant), plan_.injected));
    inputs_.hashes["inputs/" + inputs_.plant.generic_string()] = sha256_file(at_.inputs() / inputs_.plant);
    (void)sim::read_plant(at_.inputs() / inputs_.plant);  // an effect that cannot be is found before the first flight
    std::vector<PlannedFlight> judged;
    for (const auto& j : plan_.judged) judged.push_back(j.flight);
    write_scenario("learn", plan_.learn, plan_.learn_seeds);
    write_scenario("held_out", plan_.held_out, plan_.held_out_seeds);
    write_scenario("judged", judged, plan_.judged_seeds);
    write_run_toml();
  }

  void write_scenario(const char* which, const std::vector<PlannedFlight>& flights, const std::vector<std::uint64_t>& seeds) const {
    ScenarioPaths paths{inputs_.plant.generic_string(), inputs_.place.at(plan_.vehicle), inputs_.place.at(plan_.gains), {}};
    std::vector<std::string> names;
    for (const auto& f : flights) {
      names.push_back(f.name);
      paths.trajectories.push_back(inputs_.place.at(f.trajectory));
    }
    write_text_file(at_.scenario(which), hil_scenario_text(paths, plan_.variant, names, seeds));
  }

  void write_run_toml() const {
    std::string t = "# All that is needed to repeat this run; paths are relative to this folder.\nformat = 1\ncommand = \"close\"\n";
    const std::string plan = "inputs/" + inputs_.place.at(plan_.path), vehicle = "inputs/" + inputs_.place.at(plan_.vehicle);
    t += fmt::format("plan = \"{}\"\nvehicle = \"{}\"\nflown_plant = \"inputs/{}\"\n", plan, vehicle, inputs_.plant.generic_string());
    const auto seeds = [](const std::vector<std::uint64_t>& s) { return fmt::format("{}{}", fmt::join(s, ","), s.size() == 1 ? "," : ""); };
    t += fmt::format("command_line = '{}'\nversion = \"{}\"\n", o_.command_line, o_.version);
    t += fmt::format("repeat = \"rotorloop close {} --vehicle {} --learn-seeds {} --held-out-seeds {} --seeds {} --name repeat\"\n", plan,
                     vehicle, seeds(plan_.learn_seeds), seeds(plan_.held_out_seeds), seeds(plan_.judged_seeds));
    std::map<std::string, std::string> sorted;
    for (const auto& [given, place] : inputs_.place) sorted["inputs/" + place] = sha256_file(at_.inputs() / place);
    for (const auto& [path, sha] : sorted) t += fmt::format("\n[[input]]\npath = \"{}\"\nsha256 = \"{}\"\n", path, sha);
    write_text_file(at_.run_toml(), t);
  }

  // True when the stage has to be made.
  bool open(const Stage& stage, const std::string& name, const std::string& what) const {
    if (o_.stop && *o_.stop) throw Error({name, "interrupted", "", "the same command goes on from here"}, ExitCode::interrupted);
    if (stage.done()) {
      message(name, "done before");
      if (const auto by = stage.made_by(); by != o_.version)
        message(name, fmt::format("warning: made by {}, this is {}; --force makes all anew", by, o_.version));
      return false;
    }
    message(name, what);
    stage.begin();
    return true;
  }

  void hil(const std::string& stage, const char* scenario, const fs::path& into, const std::string& vehicle) const {
    ProgramCall call;
    call.program = o_.program;
    call.folder = at_.run;
    call.arguments = {"hil",    fs::path("inputs") / (std::string(scenario) + ".toml"),
                      "--out",  into.lexically_relative(at_.run).generic_string(),
                      "--name", scenario,
                      "--jobs", std::to_string(o_.jobs),
                      "--force"};
    if (!vehicle.empty()) call.arguments.insert(call.arguments.end(), {"--vehicle", vehicle});
    call.output = into / (std::string(scenario) + ".txt");
    call.errors = into / (std::string(scenario) + ".messages.txt");
    call.line = [&](const std::string& line) { message(stage, line); };
    call.stop = o_.stop;
    const int code = run_program(call);
    if (code == to_int(ExitCode::interrupted) || code == to_int(ExitCode::terminated))
      throw Error({stage, "interrupted", "", "the same command goes on from here"}, ExitCode::interrupted);
    // A flight that crashed is a result, not an error.
    if (code != 0 && code != to_int(ExitCode::verdict) && code != to_int(ExitCode::incomplete))
      throw Error({stage, fmt::format("`rotorloop hil` ended with {}", code), "", "see " + call.errors.generic_string()},
                  code == 2 || code == 3 ? ExitCode{code} : ExitCode::device);
  }

  void fly() const {
    StageInputs in = inputs_.hashes;
    in["vehicle"] = sha256_file(plan_.vehicle);
    in["learn.toml"] = file_text(at_.scenario("learn"));
    in["held_out.toml"] = file_text(at_.scenario("held_out"));
    const Stage stage(at_.fly(), in);
    if (!open(stage, "1-fly",
              fmt::format("{} flights to learn from, {} held out", plan_.learn.size() * plan_.learn_seeds.size(),
                          plan_.held_out.size() * plan_.held_out_seeds.size())))
      return;
    hil("1-fly", "learn", at_.fly(), "");
    hil("1-fly", "held_out", at_.fly(), "");
    stage.finish(o_.version);
  }

  void fly_judged(const std::string& name, const fs::path& folder, const std::string& vehicle) const {
    StageInputs in = inputs_.hashes;
    in["vehicle"] = sha256_file(at_.run / vehicle);
    in["judged.toml"] = file_text(at_.scenario("judged"));
    const Stage stage(folder, in);
    if (!open(stage, name, fmt::format("{} judged flights", plan_.judged.size() * plan_.judged_seeds.size()))) return;
    hil(name, "judged", folder, vehicle);
    stage.finish(o_.version);
  }

  // A vehicle that cannot be flown is a result of the diagnosis, not the end of the run: the loop is judged without it.
  void fly_with_estimate(const std::string& name, const fs::path& folder, const fs::path& vehicle) const {
    if (const auto why = why_not_flyable(vehicle); !why.empty()) {
      message(name, "not flown: " + why);
      fs::remove_all(folder);
    } else {
      fly_judged(name, folder, vehicle.lexically_relative(at_.run).generic_string());
    }
  }

  struct Log {
    fs::path file;
    std::string in_workspace, option;
  };
  std::vector<Log> logs() const {
    std::vector<Log> out;
    const auto add = [&](const char* run, const std::vector<PlannedFlight>& flights, const std::vector<std::uint64_t>& seeds) {
      const hil::RunResult result = hil::read_result(at_.fly() / run);
      for (const auto& f : flights)
        for (const auto seed : seeds) {
          // What was flown until a crash is no flight to learn from.
          for (const auto& r : result.flights)
            if (r.flight == f.name && r.seed == seed && r.end != hil::FlightEnd::completed)
              throw Error(
                  {f.name, fmt::format("seed {} ended as {} {}", seed, hil::flight_end_name(r.end), r.end_detail),
                   "the vehicle file is too wrong for this flight, or the plant too hard", "fly gentler trajectories to learn from"},
                  ExitCode::data_quality);
          out.push_back({at_.fly() / run / f.name / hil::variant_name(plan_.variant) / std::to_string(seed) / "flight.csv",
                         fmt::format("flights/{}_{}_{}.csv", run, f.name, seed),
                         std::string(run) == "held_out"      ? "--held-out"
                         : f.role == "any" || f.role.empty() ? "--flight"
                                                             : "--" + f.role});
        }
    };
    add("learn", plan_.learn, plan_.learn_seeds);
    add("held_out", plan_.held_out, plan_.held_out_seeds);
    return out;
  }

  // Every file that holds the truth, where it lies now.
  std::vector<fs::path> secrets() const {
    std::vector<fs::path> out{fs::absolute(plan_.path), fs::absolute(plan_.plant), at_.run_toml(), at_.inputs() / inputs_.plant};
    for (const auto& f : plan_.learn)
      out.push_back(at_.fly() / "learn" / f.name / hil::variant_name(plan_.variant) / std::to_string(plan_.learn_seeds.front()) /
                    "truth.csv");
    for (auto& p : out) p = fs::weakly_canonical(p);
    return out;
  }

  // What a sandboxed command gets: its words, the files that it may know, and what decides whether it has to run again.
  struct Task {
    std::vector<std::string> arguments;
    std::vector<std::pair<fs::path, std::string>> files;
    StageInputs inputs;
  };
  Task task(const std::string& command, const fs::path& program, const std::vector<std::string>& extra) const {
    const fs::path vehicle = at_.inputs() / inputs_.place.at(plan_.vehicle);
    Task t{{command, "--vehicle", "vehicle.toml"}, {{vehicle, "vehicle.toml"}}, {}};
    t.inputs = {{"vehicle", sha256_file(vehicle)}, {"arguments", fmt::format("{}", fmt::join(extra, " "))}};
    if (!o_.diagnosis_program.empty()) t.inputs["analyst"] = sha256_file(program);
    for (const auto& log : logs()) {
      t.inputs[log.in_workspace] = sha256_file(log.file);
      t.files.emplace_back(log.file, log.in_workspace);
      // Roles are for the stages of `identify`; a diagnosis takes every flight alike.
      const bool role = log.option != "--held-out" && command != "identify";
      t.arguments.insert(t.arguments.end(), {role ? "--flight" : log.option, log.in_workspace});
    }
    // A diagnosis takes the effects of the vehicle file by itself, an identification those that are given to it.
    if (command == "identify")
      for (const auto& effect : host::read_vehicle(vehicle, host::builtin_effect_catalogue()).effects)
        if (host::find_term(effect.id)) t.arguments.insert(t.arguments.end(), {"--term", effect.id});
    t.arguments.insert(t.arguments.end(), {"-o", "out/vehicle.toml", "--report", "out/report"});
    t.arguments.insert(t.arguments.end(), extra.begin(), extra.end());
    return t;
  }

  // Chooses the sandbox, says so, and leaves the record of all attempts in the stage's folder.
  void make_sandbox(const std::string& name, const fs::path& folder, Workspace& workspace) const {
    write_text_file(folder / "isolation.json", isolation_record(workspace.isolate({o_.program, {"close", "probe"}}, secrets())));
    const IsolationSummary s = read_isolation_record(folder / "isolation.json");
    const std::string without = fmt::format("{}", fmt::join(s.gave_up, "; "));
    if (s.holds) {
      message(name, fmt::format("sandboxed by {} ({}): {} ways to the truth tried, none opened", s.layers, s.enforced_by, s.attempts));
      if (!without.empty()) message(name, "without " + without);
      return;
    }
    if (o_.require_isolation)
      throw Error({name, "no sandbox holds on this machine, so the diagnosis could read the truth", without, kSandboxRemedy},
                  ExitCode::device);
    message(name, "warning: not isolated: the diagnosis could read the truth, for no sandbox holds on this machine");
    message(name, "  likely: " + without);
    message(name, std::string("  do:     ") + kSandboxRemedy);
  }

  void analyse(const std::string& name, const fs::path& folder, const std::string& command, const std::vector<std::string>& extra) const {
    const fs::path program = o_.diagnosis_program.empty() ? o_.program : o_.diagnosis_program;
    const Task t = task(command, program, extra);
    const Stage stage(folder, t.inputs);
    if (!open(stage, name, fmt::format("sandboxed {}", command))) return;

    Workspace workspace(t.files);
    fs::create_directories(workspace.path() / "out" / "report");
    make_sandbox(name, folder, workspace);
    const int code = workspace.run(
        program, t.arguments, folder / "output.txt", folder / "messages.txt", [&](const std::string& line) { message(name, line); },
        o_.stop);
    workspace.take_back("out", folder / "out");
    if (o_.stop && *o_.stop) throw Error({name, "interrupted", "", "the same command goes on from here"}, ExitCode::interrupted);
    if (code >= 128)
      throw Error({name, fmt::format("the sandboxed `{}` was ended by signal {}", command, code - 128),
                   "no memory left, or somebody ended it", "the same command goes on from here"},
                  ExitCode::device);
    // Without a vehicle file the identified vehicle is left out of the comparison; without a diagnosis there is no loop to close.
    if (code != 0) {
      message(name, fmt::format("`{}` ended with {}, see {}", command, code, (folder / "messages.txt").generic_string()));
      if (command == "diagnose")
        throw Error({name, fmt::format("the sandboxed `{}` ended with {}", command, code),
                     "the logs cannot be used, or the program is another", "see " + (folder / "messages.txt").generic_string()},
                    ExitCode::data_quality);
    }
    stage.finish(o_.version);
  }

  const LoopPlan& plan_;
  const LoopOptions& o_;
  LoopLayout at_;
  CopiedInputs inputs_;
};

// A run goes on only where the same plan began it: another command's run, or another plan's, is not what the name was meant for.
void refuse_other_run(const fs::path& run, const LoopPlan& plan) {
  const auto file = TomlFile::read(run / "run.toml");
  const auto root = file.root();
  const std::string command = root.text("command", "hil");
  std::string other;
  if (command != "close")
    other = fmt::format("is a run of `rotorloop {}`", command);
  else if (const fs::path begun = run / root.text("plan"); fs::is_regular_file(begun) && read_loop_plan(begun).name != plan.name)
    other = fmt::format("is a run of another plan, \"{}\"", read_loop_plan(begun).name);
  if (!other.empty()) throw Error({run.generic_string(), other, "", "keep both with --name NAME, or replace it with --force"});
}

// The folder says itself that the loop came to no end.
void write_unfinished(const fs::path& run, const LoopPlan& plan, const LoopOptions& options, const Error& e, const RunClock& clock) {
  const bool stopped = e.exit_code() == ExitCode::interrupted;
  const ErrorText& t = e.text();
  hil::write_unfinished(run, {"close",
                              options.version,
                              "",
                              clock.started_utc(),
                              clock.elapsed_s(),
                              {},
                              plan.name,
                              {stopped ? "incomplete" : "refused",
                               stopped ? render::Standing::open : render::Standing::bad,
                               "The loop came to no end.",
                               {t.where + ": " + t.what},
                               t.remedy}});
}

}  // namespace

fs::path close_loop(const LoopPlan& plan, const LoopOptions& options) {
  const std::string name = options.name.empty() ? "close-" + hil::folder_name(plan.name) : options.name;
  fs::path run = options.runs_dir / name;
  // A run that was stopped goes on; anything else in the way is refused by create().
  if (!options.force && fs::is_regular_file(run / "run.toml")) refuse_other_run(run, plan);
  if (options.force || !fs::is_regular_file(run / "run.toml")) run = hil::RunFolder::create(options.runs_dir, name, options.force).path();
  run = fs::canonical(run);
  fs::permissions(run, fs::perms::owner_all);
  const RunClock clock;
  try {
    Loop(plan, options, run).go();
  } catch (const Error& e) {
    write_unfinished(run, plan, options, e, clock);
    throw;
  }
  const LoopResult result = assemble_loop(run);
  write_text_file(LoopLayout{run}.result(), loop_result_json(result));
  write_text_file(LoopLayout{run}.report(), loop_report_html(result));
  return run;
}

}  // namespace rotorloop::closed_loop
