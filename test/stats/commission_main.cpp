// The commissioning over drawn boards and motors as a program: every class in turn, then the tables and the verdict.
//   stats_commission [--trials 60] [--from 1] [--only CLASS] [--verbose]
// Seeds 1 to 5000 are for development; the judged ones are 6001 to 6060. Exit 0: all limits met; 2: wrong arguments; 6: one missed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <vector>

#include "bench/hil/esc_lab/commission_trial.hpp"

using namespace rotorloop;
using namespace rotorloop::esc_lab;

namespace {

struct Options {
  std::uint64_t trials = 60, from = 1;
  std::string only;
  bool verbose = false;
};

bool within(const CommissionTrial& t, std::size_t q) { return std::fabs(t.error[q]) <= kQuantityLimits[q].limit; }
std::string error_text(double error, const QuantityLimit& of) {
  return error > 1e8 ? "not measured" : fmt::format("{:+.2f}{}{}", error, of.unit.empty() ? "" : " ", of.unit);
}

void print_trial(const CommissionTrial& t) {
  fmt::print("{} {}: end {}, {:.1f} s, peak {:.1f} A, {:.0f} rad/s, winding +{:.1f} K", t.motor_class, t.seed,
             static_cast<int>(t.result.end), t.took_s, t.peak_A, t.peak_rad_s, t.heated_K);
  for (std::size_t q = 0; q < kQuantities; ++q) fmt::print(", {} {}", kQuantityLimits[q].name, error_text(t.error[q], kQuantityLimits[q]));
  fmt::print(", load {:+.0f} %, friction {:+.0f} %\n", t.load_percent, t.friction_percent);
}

// 58 of 60 within the limit.
bool quantity_table(const std::vector<CommissionTrial>& trials) {
  fmt::print(
      "| quantity | limit | within | worst of those measured | of that by the board's scales | class, seed |\n| --- | --- | --- | --- | "
      "--- | --- |\n");
  bool met = true;
  for (std::size_t q = 0; q < kQuantities; ++q) {
    const auto good = std::count_if(trials.begin(), trials.end(), [&](const CommissionTrial& t) { return within(t, q); });
    // Of those measured; a draw without a result counts as not within.
    const auto size = [&](const CommissionTrial& t) { return t.error[q] > 1e8 ? -1.0 : std::fabs(t.error[q]); };
    const auto worst = std::max_element(trials.begin(), trials.end(),
                                        [&](const CommissionTrial& a, const CommissionTrial& b) { return size(a) < size(b); });
    const QuantityLimit& l = kQuantityLimits[q];
    const bool enough =
        static_cast<double>(trials.size() - static_cast<std::size_t>(good)) <= kMostBeyondShare * static_cast<double>(trials.size()) + 1e-9;
    fmt::print("| {} | {:.3g} {} | {}/{}{} | {} | {} | {} {} |\n", l.name, l.limit, l.unit, good, trials.size(),
               enough ? "" : " **missed**", error_text(worst->error[q], l), error_text(worst->scales[q], l), worst->motor_class,
               worst->seed);
    met &= enough;
  }
  return met;
}

void class_table(const std::vector<CommissionTrial>& trials) {
  fmt::print(
      "\n| class | draws | finished | all within | longest | peak current | winding warmer by |\n| --- | --- | --- | --- | --- | --- | --- "
      "|\n");
  for (const MotorClass& c : motor_classes()) {
    int draws = 0, finished = 0, all = 0;
    double took_s = 0.0, peak_A = 0.0, heated_K = 0.0;
    for (const CommissionTrial& t : trials) {
      if (t.motor_class != c.name) continue;
      ++draws;
      finished += t.result.end == firmware::CommissioningEnd::done ? 1 : 0;
      bool good = true;
      for (std::size_t q = 0; q < kQuantities; ++q) good &= within(t, q);
      all += good ? 1 : 0;
      took_s = std::max(took_s, t.took_s);
      peak_A = std::max(peak_A, t.peak_A);
      heated_K = std::max(heated_K, t.heated_K);
    }
    if (draws > 0)
      fmt::print("| {} | {} | {} | {} | {:.1f} s | {:.1f} A | {:.0f} K |\n", c.name, draws, finished, all, took_s, peak_A, heated_K);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app("Commissions drawn motors on drawn boards with the native firmware and compares what it finds with the truth.");
  app.add_option("--trials", o.trials, "number of draws, every class in turn")->check(CLI::Range(1, 100000));
  app.add_option("--from", o.from, "the first seed; the judged ones begin at 6001")->check(CLI::Range(1, 1000000));
  app.add_option("--only", o.only, "one class: 3in 5in 7in 10in 12in 17in gimbal")->check([](const std::string& name) {
    return find_motor_class(name) ? std::string() : "no motor class \"" + name + "\"; use 3in 5in 7in 10in 12in 17in gimbal";
  });
  app.add_flag("--verbose", o.verbose, "a line for each draw");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  std::vector<CommissionTrial> trials;
  for (std::uint64_t i = 0; i < o.trials; ++i) {
    const MotorClass& c = o.only.empty() ? motor_classes()[i % motor_classes().size()] : *find_motor_class(o.only);
    trials.push_back(run_commission_trial(c, o.from + i));
    if (o.verbose) print_trial(trials.back());
  }
  const bool met = quantity_table(trials);
  class_table(trials);
  for (const CommissionTrial& t : trials)
    if (t.result.end != firmware::CommissioningEnd::done)
      fmt::print("not finished: {} {} (end {})\n", t.motor_class, t.seed, static_cast<int>(t.result.end));
  fmt::print("\n{}\n", met ? "all limits met" : "a limit is missed");
  return met ? 0 : 6;
}
