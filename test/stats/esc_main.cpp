// The ESC study as a program: trials that the folder lacks are flown and kept, then the tables are printed and judged.
//   stats_esc FOLDER [--trials 300] [--from 1] [--only CLASS] [--experiment fly|step|catch] [--ideal-board] [--no-verdict]
// Seeds 1 to 5000 are for development; the judged ones begin at 5001. Exit 0: all limits met; 2: wrong arguments; 6: one missed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <set>

#include "bench/hil/esc_lab/trial.hpp"
#include "host/base/parallel.hpp"
#include "test/stats/esc_csv.hpp"

using namespace rotorloop;
using namespace rotorloop::esc_lab;
using namespace rotorloop::stats;

namespace {

struct Options {
  std::filesystem::path folder;
  std::uint64_t trials = 300, from = 1;
  unsigned jobs = 1;
  std::string only, experiment = "all";
  bool ideal_board = false, no_verdict = false;
};

std::vector<EscTrial> complete(const Options& o, const std::string& name, const EscTrialSettings& s) {
  const auto path = o.folder / fmt::format("esc-{}{}{}.csv", name, o.ideal_board ? "-ideal" : "", o.only.empty() ? "" : "-" + o.only);
  std::vector<EscTrial> done = read_esc_trials(path.string());
  {
    std::ofstream anew(path);  // a line cut short is gone
    anew << esc_csv_header() << '\n';
    for (const EscTrial& t : done) anew << esc_csv_line(t) << '\n';
  }
  const auto class_of = [&](std::uint64_t i) -> const MotorClass& {
    return o.only.empty() ? class_of_trial(i, o.trials) : *find_motor_class(o.only);
  };
  std::set<std::pair<std::uint64_t, std::string>> have;
  for (const EscTrial& t : done) have.insert({t.seed, t.motor_class});
  std::ofstream out(path, std::ios::app);
  std::mutex mutex;
  parallel_for(o.trials, static_cast<int>(o.jobs), [&](std::size_t i) {
    const MotorClass& c = class_of(i);
    if (have.contains({o.from + i, std::string(c.name)})) return;
    const EscTrial t = run_esc_trial(c, o.from + i, s);
    const std::lock_guard lock(mutex);
    out << esc_csv_line(t) << std::endl;
    done.push_back(t);
  });
  std::vector<EscTrial> mine;
  for (const EscTrial& t : done)
    if (t.seed >= o.from && t.seed < o.from + o.trials && t.motor_class == class_of(t.seed - o.from).name) mine.push_back(t);
  return mine;
}

using ByClass = std::vector<std::pair<std::string, std::vector<const EscTrial*>>>;

ByClass by_class(const std::vector<EscTrial>& trials) {
  ByClass groups;
  for (const MotorClass& c : motor_classes()) {
    std::vector<const EscTrial*> of;
    for (const EscTrial& t : trials)
      if (t.motor_class == c.name) of.push_back(&t);
    if (!of.empty()) groups.push_back({std::string(c.name), of});
  }
  return groups;
}

template <class Get>
double most(const std::vector<const EscTrial*>& of, const Get& get) {
  double m = 0.0;
  for (const EscTrial* t : of) m = std::max(m, static_cast<double>(get(*t)));
  return m;
}
template <class Test>
std::size_t number(const std::vector<const EscTrial*>& of, const Test& test) {
  return static_cast<std::size_t>(std::count_if(of.begin(), of.end(), [&](const EscTrial* t) { return test(*t); }));
}

std::string milliseconds(double ms) { return ms > 1e8 ? "never" : fmt::format("{:.0f} ms", ms); }

// Seeds of trials that fail, for whoever looks into them.
template <class Test>
void list(const char* what, const std::vector<EscTrial>& trials, const Test& test) {
  std::string line;
  for (const EscTrial& t : trials)
    if (test(t)) line += fmt::format(" {}:{}{}", t.motor_class, t.seed, t.causes.empty() ? "" : "(" + t.causes + ")");
  if (!line.empty()) fmt::print("{}:{}\n", what, line);
}

bool fly_table(const std::vector<EscTrial>& trials) {
  fmt::print(
      "| class | draws | started in time | slowest | peak at start | without a trip | trips | without speed, longest | latched |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  const auto in_time = started_in_time;
  std::size_t started = 0, clean = 0, held = 0, latched = 0;
  for (const auto& [name, of] : by_class(trials)) {
    int trips = 0;
    for (const EscTrial* t : of) trips += t->trips;
    const auto n_clean = number(of, [](const EscTrial& t) { return t.trips == 0; });
    fmt::print("| {} | {} | {}/{} | {} | {:.0f} A | {}/{} | {} | {:.0f} ms | {} |\n", name, of.size(), number(of, in_time), of.size(),
               milliseconds(most(of, [](const EscTrial& t) { return t.start_ms; })),
               most(of, [](const EscTrial& t) { return t.start_peak_A; }), n_clean, of.size(), trips,
               most(of, [](const EscTrial& t) { return t.longest_gap_ms; }), number(of, [](const EscTrial& t) { return t.latched; }));
    started += number(of, in_time);
    clean += n_clean;
    latched += number(of, [](const EscTrial& t) { return t.latched; });
    held += number(of, [](const EscTrial& t) { return t.longest_gap_ms <= kLongestGap_ms; });
  }
  fmt::print("all: {} draws, {} started in time, {} without a trip, {} never without speed for more than 100 ms, {} latched\n",
             trials.size(), started, clean, held, latched);
  list("late or never", trials, [&](const EscTrial& t) { return !in_time(t); });
  list("with a trip (faults)", trials, [](const EscTrial& t) { return t.trips > 0; });
  list("latched", trials, [](const EscTrial& t) { return t.latched; });
  return started == trials.size() && held == trials.size() && latched == 0 &&
         static_cast<double>(clean) >= kLeastCleanShare * static_cast<double>(trials.size());
}

bool step_table(const std::vector<EscTrial>& trials) {
  fmt::print(
      "\n| class | draws | rise / best, worst | settle / best, worst | overshoot | steady error | trips |\n| --- | --- | --- | --- | --- | "
      "--- | --- |\n");
  const auto good = step_within;
  for (const auto& [name, of] : by_class(trials))
    fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.1f} % | {:.3f} % | {} |\n", name, of.size(),
               most(of, [](const EscTrial& t) { return t.rise_ratio; }), most(of, [](const EscTrial& t) { return t.settle_ratio; }),
               most(of, [](const EscTrial& t) { return t.overshoot_percent; }),
               most(of, [](const EscTrial& t) { return std::abs(t.steady_percent); }), most(of, [](const EscTrial& t) { return t.trips; }));
  list("beyond a limit", trials, [&](const EscTrial& t) { return !good(t); });
  return std::all_of(trials.begin(), trials.end(), good);
}

bool catch_table(const std::vector<EscTrial>& trials) {
  fmt::print(
      "\n| class | draws | at speed in time, no trip | slowest of +20…+95 % | of −20…+20 % | of −60…−20 % |\n| --- | --- | --- | --- | --- "
      "| --- |\n");
  const auto good = caught_in_time;
  for (const auto& [name, of] : by_class(trials)) {
    const auto slowest = [&](double low, double high) {
      return milliseconds(most(of, [&](const EscTrial& t) { return t.caught_from >= low && t.caught_from < high ? t.caught_ms : 0.0; }));
    };
    fmt::print("| {} | {} | {}/{} | {} | {} | {} |\n", name, of.size(), number(of, good), of.size(), slowest(0.2, 1.0), slowest(-0.2, 0.2),
               slowest(-1.0, -0.2));
  }
  list("late or with a trip", trials, [&](const EscTrial& t) { return !good(t); });
  return std::all_of(trials.begin(), trials.end(), good);
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app("Starts, flies, steps and catches drawn motors on drawn boards with the native firmware, and judges all of them.");
  app.add_option("folder", o.folder, "where trials are kept")->required()->check(CLI::ExistingDirectory);
  app.add_option("--trials", o.trials, "number of draws flown; a third of it for steps and catches")->check(CLI::Range(1, 100000));
  app.add_option("--from", o.from, "the first seed; judged seeds begin at 5001")->check(CLI::Range(1, 1000000));
  app.add_option("--jobs", o.jobs, "trials at a time")->check(CLI::Range(1, 64));
  app.add_option("--only", o.only, "one class: 3in 5in 7in 10in 12in 17in gimbal")->check([](const std::string& name) {
    return find_motor_class(name) ? std::string() : "no motor class \"" + name + "\"; use 3in 5in 7in 10in 12in 17in gimbal";
  });
  app.add_option("--experiment", o.experiment, "fly, step, catch or all")->check(CLI::IsMember({"all", "fly", "step", "catch"}));
  app.add_flag("--ideal-board", o.ideal_board, "boards of which only gains and offsets are drawn");
  app.add_flag("--no-verdict", o.no_verdict, "print the tables, judge nothing");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  bool met = true;
  const auto wanted = [&](const char* name) { return o.experiment == "all" || o.experiment == name; };
  if (wanted("fly")) met &= fly_table(complete(o, "fly", {EscExperiment::fly, Knowledge::data_sheet, o.ideal_board}));
  o.trials = o.experiment == "all" ? std::max<std::uint64_t>(o.trials / 3, 1) : o.trials;
  if (wanted("step")) met &= step_table(complete(o, "step", {EscExperiment::step, Knowledge::commissioned, o.ideal_board}));
  if (wanted("catch")) met &= catch_table(complete(o, "catch", {EscExperiment::catch_rotor, Knowledge::data_sheet, o.ideal_board}));
  fmt::print("\n{}\n", met ? "all limits met" : "a limit is missed");
  return met || o.no_verdict ? 0 : 6;
}
