// `rotorloop close`: the whole loop through flight, with a sandboxed diagnosis; `close truth` compares afterwards.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "bench/hil/closed_loop/isolation_probe.hpp"
#include "bench/hil/closed_loop/loop_result.hpp"
#include "bench/hil/closed_loop/program_call.hpp"
#include "bench/hil/closed_loop/report.hpp"
#include "bench/hil/closed_loop/run.hpp"
#include "bench/hil/closed_loop/run_layout.hpp"
#include "cli/commands.hpp"
#include "cli/ending/stop_signals.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

struct CloseArguments {
  fs::path plan, vehicle, analyst, out = "runs";
  std::string name, learn_seeds, held_out_seeds, judged_seeds;
  int jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  bool json = false, quiet = false, force = false, require_isolation = false;
};

std::string command_line(const CloseArguments& o) {
  std::string out = "rotorloop close " + o.plan.generic_string();
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) out += fmt::format(" {} {}", option, value);
  };
  add("--vehicle", o.vehicle.generic_string());
  add("--learn-seeds", o.learn_seeds);
  add("--held-out-seeds", o.held_out_seeds);
  add("--seeds", o.judged_seeds);
  add("--analyst", o.analyst.generic_string());
  return out;
}

closed_loop::LoopPlan planned(const CloseArguments& o) {
  closed_loop::LoopPlan p = closed_loop::read_loop_plan(o.plan);
  if (!o.vehicle.empty()) {
    if (!fs::is_regular_file(o.vehicle))
      throw Error(
          {"--vehicle", fmt::format("\"{}\": no such file", o.vehicle.generic_string()), "", "give the vehicle file to start from"});
    p.vehicle = o.vehicle;
  }
  const auto seeds = [](const std::string& text, std::vector<std::uint64_t>& list) {
    if (!text.empty()) list = hil::parse_seeds(text);
  };
  seeds(o.learn_seeds, p.learn_seeds);
  seeds(o.held_out_seeds, p.held_out_seeds);
  seeds(o.judged_seeds, p.judged_seeds);
  for (const auto s : p.learn_seeds)
    for (const auto* other : {&p.held_out_seeds, &p.judged_seeds})
      if (std::find(other->begin(), other->end(), s) != other->end())
        throw Error({"", fmt::format("seed {} is learnt from and also held out or judged", s), "", "give lists without a common seed"});
  return p;
}

int close(const CloseArguments& o) {
  closed_loop::LoopOptions options;
  options.runs_dir = o.out;
  options.name = o.name;
  options.force = o.force;
  options.program = closed_loop::own_program();
  if (!o.analyst.empty()) options.diagnosis_program = fs::canonical(o.analyst);
  options.jobs = o.jobs;
  options.require_isolation = o.require_isolation;
  options.command_line = command_line(o);
  options.version = std::string("rotorloop ") + kVersion + " " + kGit;
  // A signal from the terminal reaches the flights by themselves; the loop then ends before its next stage.
  const StopSignals stop;
  options.stop = stop.flag();
  if (!o.quiet) options.message = [](const std::string& stage, const std::string& text) { fmt::print(stderr, "{}: {}\n", stage, text); };
  fs::path run;
  try {
    run = closed_loop::close_loop(planned(o), options);
  } catch (const Error& e) {
    if (!stop.asked()) throw;
    std::fprintf(stderr, "%s\n", e.what());
    return stop.exit_code();
  }
  const closed_loop::LoopResult result = closed_loop::assemble_loop(run);
  fmt::print("{}", o.json ? closed_loop::loop_result_json(result) : closed_loop::loop_result_text(result));
  return to_int(result.pass ? ExitCode::ok : ExitCode::verdict);
}

int truth(const fs::path& given, bool json) {
  const fs::path run = fs::absolute(given);
  const closed_loop::TruthComparison c = closed_loop::compare_with_truth(run);
  const closed_loop::LoopResult result = closed_loop::assemble_loop(run);
  write_text_file(closed_loop::LoopLayout{run}.result(), closed_loop::loop_result_json(result));
  write_text_file(closed_loop::LoopLayout{run}.report(), closed_loop::loop_report_html(result));
  fmt::print("{}", json ? closed_loop::truth_json(c) : closed_loop::truth_text(c));
  return to_int(c.right() ? ExitCode::ok : ExitCode::verdict);
}

void add_truth(CLI::App& close, int& exit_code) {
  auto* t = close.add_subcommand("truth", "compare a finished study with the plant: named effects, their sizes, mass properties");
  struct TruthOptions {
    fs::path run;
    bool json = false;
  };
  auto to = std::make_shared<TruthOptions>();
  t->add_option("RUN", to->run, "run folder of rotorloop close")->required();
  t->add_flag("--json", to->json, "truth.json on stdout instead of the table");
  t->footer(
      "Names and sizes are judged separately. A name is right alone, or in a class of effects that flight data cannot distinguish "
      "(`twins`\n"
      "in effects/catalogue.toml). A size is right within three standard errors or 1 % of the truth (0.1 mm for the centre of mass).\n"
      "Writes truth.json, and writes result.json and report.html of the run again.\n"
      "\nExample:\n"
      "  rotorloop close truth runs/close-aft-rotor-wake\n"
      "\nExit codes: 0 names and sizes right, 2 no finished run, 6 a name missed or wrong, or a size wrong.");
  t->callback([to, &exit_code] { exit_code = truth(to->run, to->json); });
}

// What the bench starts inside the sandbox before the diagnosis; not for users.
void add_probe(CLI::App& close, int& exit_code) {
  auto* p = close.add_subcommand("probe", "try every way out of the sandbox that this process is in")->group("");
  auto words = std::make_shared<std::vector<std::string>>();
  p->add_option("PID SECRET", *words, "the process that knows the truth, and files that must not open")->required();
  p->callback([words, &exit_code] { exit_code = closed_loop::probe_command(*words); });
}

}  // namespace

void add_close(CLI::App& app, int& exit_code) {
  auto* c = app.add_subcommand(
      "close", "closed-loop study: fly, identify, diagnose, fly again; the diagnosis runs in a sandbox and never sees the plant");
  auto o = std::make_shared<CloseArguments>();
  c->add_option("PLAN", o->plan, "loop file: vehicle, plant, unmodelled effects of the plant, flights (docs/files.md)");
  c->add_option("--vehicle", o->vehicle, "vehicle file to start from, in place of the loop file's");
  c->add_option("--learn-seeds", o->learn_seeds, "seeds of the flights for identification and diagnosis, such as 201 or 201,202");
  c->add_option("--held-out-seeds", o->held_out_seeds, "seeds of the held-out flights, which are only predicted");
  c->add_option("--seeds", o->judged_seeds, "seeds of the flights that are judged, such as 1..10");
  c->add_option("--out", o->out, "folder in which run folders are created")->capture_default_str();
  c->add_option("--name", o->name, "name of the run folder; default: \"close-\" and the loop file's name");
  c->add_option("-j,--jobs", o->jobs, "flights that run in parallel; the results do not depend on it")->check(CLI::Range(1, 256));
  c->add_option("--analyst", o->analyst, "another program to run in the sandbox; it gets the arguments of rotorloop identify and diagnose");
  c->add_flag("--require-isolation", o->require_isolation, "end with exit code 3 when no sandbox works on this machine");
  c->add_flag("--force", o->force, "start from the beginning; default: continue a run that was stopped");
  c->add_flag("--json", o->json, "result.json on stdout instead of the table");
  c->add_flag("-q,--quiet", o->quiet, "nothing on stderr");
  c->footer(
      "identify and diagnose run in a sandbox with copies of flight.csv and the vehicle file. They cannot open the plant, truth.csv or "
      "any\n"
      "other file of the run. The sandbox is bubblewrap (Debian package bubblewrap; needs user namespaces), otherwise Landlock (Linux "
      "5.13\n"
      "and later); root switches to an unused user id. Before each stage a test program in the same sandbox tries to open these files.\n"
      "If no sandbox works, the run is marked \"not isolated\" and continues, or ends with exit code 3 with --require-isolation.\n"
      "\nExamples:\n"
      "  rotorloop close scenarios/close/aft_rotor_wake.toml              the whole study; runs/close-…/report.html\n"
      "  rotorloop close scenarios/close/nothing.toml --seeds 1..10       control experiment: no effect is missing, none may be named\n"
      "  rotorloop close truth runs/close-aft-rotor-wake                  afterwards: was the diagnosis right?\n"
      "\nThe command continues a run that was stopped. Each stage lists its input files in done.toml; when a vehicle file, loop file or\n"
      "trajectory has changed, the stages that depend on it run again.\n"
      "\nExit codes: 0 every judged flight as expected (truth: right), 2 bad arguments or input file, 3 disk or device, 5 refused: the\n"
      "logs could not be used, 6 a judged flight missed its expectation (truth: missed or wrong), 130 and 143 interrupted.");
  add_truth(*c, exit_code);
  add_probe(*c, exit_code);
  c->require_subcommand(0, 1);
  c->callback([c, o, &exit_code] {
    if (!c->get_subcommands().empty()) {
      if (!o->plan.empty())
        throw Error(
            {"rotorloop close", fmt::format("\"{}\" before a subcommand", o->plan.generic_string()), "", "give a plan or a subcommand"});
      return;
    }
    if (o->plan.empty())
      throw Error({"rotorloop close", "no loop file given", "",
                   "name one, such as scenarios/close/aft_rotor_wake.toml; see rotorloop close --help"});
    exit_code = close(*o);
  });
}

}  // namespace rotorloop::cli
