// Estimates of simulated thrust-stand runs against the truth, judged by the limits of docs/acceptance/thrust_stand.md.
//   stats_stand BLADE.toml [--runs 500] [--from 1] [--draws 400] [--drawn-blades] [--virtual SOURCE] [--coverage LEAST MOST] [--near-limit
//   NAME…]
// Exit 0: all limits met; 2: wrong arguments; 6: a limit missed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "host/base/error.hpp"
#include "test/stats/virtual_stand_ensemble.hpp"

using namespace rotorloop;

int main(int argc, char** argv) {
  std::string blade, scratch = "build/stats/stand";
  std::uint64_t first = 1;
  std::size_t runs = 500;
  int draws = 400;
  CLI::App app("Estimates of simulated thrust-stand runs of seeds FROM, FROM + 1, … against the truth.");
  app.add_option("blade", blade, "blade file of the simulated rotor")->required();
  app.add_option("--runs", runs)->check(CLI::Range(1, 100000));
  app.add_option("--from", first)->check(CLI::Range(1, 1000000));
  app.add_option("--draws", draws, "of each bootstrap")->check(CLI::Range(50, 10000));
  std::string source;
  bool each = false;
  // 500 runs of intervals that hold the truth in 95 % of cases lie within these with 99.7 %; of fewer runs they scatter more.
  std::pair<double, double> coverage{92.0, 98.0};
  app.add_option(
      "--virtual", source,
      "folder of the repository: the runs are those of the virtual stand, with ESC, buses and instruments, and the blade of its plant");
  bool drawn = false;
  app.add_flag("--drawn-blades", drawn, "each run has a blade of its own, whose pitch, chord and drag are drawn about the given one");
  app.add_flag("--each", each, "with --virtual: a line for each run");
  app.add_option("--coverage", coverage, "LEAST MOST: share of the intervals that hold the truth, %");
  constexpr double kShare = 95.0;  // of the runs within a value's tolerance, %
  std::vector<std::string> near;
  app.add_option("--near-limit", near,
                 "values whose share is so near its limit that few runs scatter about it: three standard deviations of a share of 95 % "
                 "below are let pass");
  app.add_option("--scratch", scratch, "folder for the files of a run, removed again");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  bool met = true;
  const auto judge = [&](bool good) {
    met &= good;
    return good ? "met" : "missed";
  };
  try {
    const auto one = [&](std::uint64_t seed, const stand::StandEstimate& got, const test::StandTruth& truth) {
      if (!each) return;
      fmt::print(
          "{:>6} c_t {:+.3f} %, c_q {:+.3f} %, J {:+.2f} %, K_v {:+.2f} %, R {:+.2f} %, u of c_q {:.2f} %, time constants {:+.2f} %, "
          "{:+.2f} %\n",
          seed, 100.0 * (got.reduced_c_t / truth.c_t_N_s2 - 1.0), 100.0 * (got.reduced_c_q / truth.c_q_N_m_s2 - 1.0),
          got.dynamics && got.dynamics->inertia_kg_m2 ? 100.0 * (*got.dynamics->inertia_kg_m2 / truth.inertia_kg_m2 - 1.0) : -100.0,
          got.motor ? 100.0 * (got.motor->speed_constant_rpm_V.value / truth.speed_constant_rpm_V - 1.0) : -100.0,
          got.motor ? 100.0 * (got.motor->resistance_ohm.value / truth.resistance_ohm - 1.0) : -100.0,
          got.torque ? 100.0 * got.torque->u / got.torque->value : 0.0,
          got.dynamics && got.dynamics->up ? 100.0 * (got.dynamics->up->value_s / truth.up_s - 1.0) : -100.0,
          got.dynamics && got.dynamics->down ? 100.0 * (got.dynamics->down->value_s / truth.down_s - 1.0) : -100.0);
      std::fflush(stdout);
    };
    const stats::StandEnsemble e = source.empty() ? stats::stand_ensemble(sim::read_blade(blade), scratch, first, runs, draws, drawn)
                                                  : stats::virtual_stand_ensemble({source, scratch, first, runs, draws, drawn, one});
    fmt::print("{} runs from seed {}\n{:<6}{:>10}{:>10}{:>12}{:>12}\n", e.runs, first, "", "bias, %", "RMSE, %", "mean u, %", "covered, %");
    const double most_bias[] = {0.002, 0.005}, most_rmse[] = {0.006, 0.012};
    for (std::size_t k = 0; k < 2; ++k) {
      const auto& c = e.coefficients[k];
      fmt::print(
          "{:<6}{:>10.3f}{:>10.3f}{:>12.3f}{:>12.1f}  bias {} (at most {:.1f}), RMSE {} (at most {:.1f}), coverage {} ({:g} to {:g})\n",
          c.name, 100.0 * c.bias, 100.0 * c.rmse, 100.0 * c.mean_u, 100.0 * c.covered, judge(std::abs(c.bias) <= most_bias[k]),
          100.0 * most_bias[k], judge(c.rmse <= most_rmse[k]), 100.0 * most_rmse[k],
          judge(100.0 * c.covered >= coverage.first && 100.0 * c.covered <= coverage.second), coverage.first, coverage.second);
    }
    for (const auto& v : e.values) {
      const bool scatters = std::find(near.begin(), near.end(), v.name) != near.end();
      const double share = scatters ? kShare - 3.0 * std::sqrt(kShare * (100.0 - kShare) / static_cast<double>(e.runs)) : kShare;
      fmt::print("{:<22} within {:.0f} % in {:.1f} % of the runs, RMSE {:.2f} %  {} (at least {:.1f})\n", v.name, 100.0 * v.tolerance,
                 100.0 * v.within, 100.0 * v.rmse, judge(100.0 * v.within >= share), share);
    }
  } catch (const Error& e) {
    fmt::print(stderr, "{}\n", e.what());
    return to_int(e.exit_code());
  }
  fmt::print("{}\n", met ? "all limits met" : "a limit is missed");
  return met ? 0 : 6;
}
