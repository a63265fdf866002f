// The study as a program: trials that the file lacks are run and appended, then the table is printed and judged.
//   stats_identify FILE.csv --trials 300 [--jobs 2]
//     [--rotor-log-ms 5] [--estimate-noise] [--pilot-sees-truth] [--nodes-at-stamps] [--quiet]   a changed condition
//     [--no-verdict] [--against USUAL.csv]                                   shift of the estimates against the usual condition
// Exit 0: all limits met; 2: wrong arguments; 6: a limit missed.
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <mutex>
#include <set>

#include "host/base/parallel.hpp"
#include "test/stats/identify_ensemble.hpp"

using namespace rotorloop;

int main(int argc, char** argv) {
  std::string file, against;
  std::uint64_t first = 1, trials = 300;
  unsigned jobs = 2;
  bool no_verdict = false;
  stats::TrialSettings settings;
  CLI::App app("Repeats the identification of model-true flights over seeds 1, 2, 3, … and judges estimates and standard errors.");
  app.add_option("file", file, "CSV file of trials: read, completed, judged")->required();
  app.add_option("--trials", trials, "the last seed")->check(CLI::Range(1, 100000));
  app.add_option("--from", first, "the first seed, to share the work between files: lines of one may be appended to another")
      ->check(CLI::Range(1, 100000));
  app.add_option("--jobs", jobs, "trials at a time")->check(CLI::Range(1, 64));
  app.add_option("--rotor-log-ms", settings.rotor_log_every_ms, "interval of logged rotor speeds, ms")->check(CLI::Range(1, 20));
  app.add_flag("--estimate-noise", settings.estimate_noise, "process and measurement noise by EM instead of given");
  app.add_flag("--pilot-sees-truth", settings.pilot_sees_truth, "the loop is closed on motion that the log does not show");
  app.add_flag("--nodes-at-stamps", settings.nodes_at_stamps, "the time offset as one of the poses");
  app.add_flag("--quiet", settings.quiet, "flights without noise: bias of the method alone");
  app.add_option("--against", against, "CSV file of the usual condition: print the shift, seed by seed")->check(CLI::ExistingFile);
  app.add_flag("--no-verdict", no_verdict, "print the table, judge nothing");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }

  const auto quantities = stats::quantities(stats::study_truth());
  auto done = stats::read_trials(file, quantities.size());
  {
    // Written anew, so that a line cut short is gone and the next one starts on its own.
    std::ofstream out(file);
    out << stats::csv_header(quantities) << '\n';
    for (const auto& t : done) out << stats::csv_line(t) << '\n';
    if (!out) {
      std::cerr << file << ": error: cannot be written\n  do:     name a file in an existing folder\n";
      return 2;
    }
  }
  std::set<std::uint64_t> have;
  for (const auto& t : done) have.insert(t.seed);
  std::mutex mutex;
  std::ofstream out(file, std::ios::app);
  parallel_for(first <= trials ? trials - first + 1 : 0, static_cast<int>(jobs), [&](std::size_t i) {
    stats::TrialSettings one = settings;
    one.seed = first + i;
    if (have.contains(one.seed)) return;
    const stats::Trial trial = stats::run_trial(one);
    const std::lock_guard lock(mutex);
    out << stats::csv_line(trial) << std::endl;
    done.push_back(trial);
    std::cerr << done.size() << " trials: seed " << one.seed << ", " << trial.iterations << " iterations\n";
  });

  std::erase_if(done, [&](const auto& t) { return t.seed < first || t.seed > trials; });
  const auto result = stats::summarise(quantities, done);
  stats::print_table(std::cout, quantities, result);
  if (!against.empty()) stats::print_shift(std::cout, quantities, done, stats::read_trials(against, quantities.size()));
  if (no_verdict) return 0;
  const auto lines = stats::missed(quantities, result);
  for (const auto& line : lines) std::cout << "missed: " << line << '\n';
  if (lines.empty()) std::cout << "all limits met\n";
  return lines.empty() ? 0 : 6;
}
