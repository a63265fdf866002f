// Whether intervals hold: 200 runs of a stand that is simulated here, with errors drawn as its uncertainties say. Nothing is shared with
// the estimator but the format of the run folder.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "host/base/random.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kCt = 1.9e-6, kCq = 2.9e-8, kJ = 1.2e-5, kUp_s = 0.040, kDown_s = 0.060, kLow = 500.0, kHigh = 1300.0;
constexpr int kRuns = 200;

struct Draws {
  RandomStream stream;
  std::uint64_t at = 0;
  double normal(double sigma) { return sigma * stream.gaussian(at++); }
};

struct Level {
  double omega_rad_s, duration_s;
  bool counts;  // a hold of the staircase; else a step
};

std::vector<Level> levels() {
  std::vector<Level> out{{0.0, 4.0, true}};
  for (int i = 0; i <= 8; ++i) out.push_back({kLow + (kHigh - kLow) * i / 8.0, 2.5, true});
  for (int i = 7; i >= 0; --i) out.push_back({kLow + (kHigh - kLow) * i / 8.0, 2.5, true});
  for (int i = 0; i < 8; ++i) out.push_back({i % 2 == 0 ? 1080.0 : 720.0, 1.5, false});
  out.push_back({0.0, 4.0, true});
  return out;
}

// Speed follows the target with a lag that scatters by 2 % from step to step; the torque cell has a filter of 4 ms; read at 100 Hz. Steps
// fall anywhere between two readings.
void write_run(const std::filesystem::path& folder, std::uint64_t seed) {
  Draws d{RandomStream(seed, 77)};
  const double density = 1.0 + d.normal(0.003), speed = 1.0 + d.normal(5e-4), tilt = d.normal(0.0175);
  const double gain_T = (1.0 + d.normal(0.004)) * std::cos(tilt), gain_Q = (1.0 + d.normal(0.004)) * std::cos(tilt);
  const double zero_N = d.normal(0.02), zero_N_m = d.normal(2e-4), running_N_m = d.normal(1e-4);
  constexpr double kInner_s = 5e-4;
  std::string csv = "t_s,step,target_rad_s,omega_rad_s,thrust_N,torque_N_m\n";
  double omega = 0.0, cell = 0.0, t = 0.0;
  int number = 0, inner = 0;
  for (const Level& l : levels()) {
    const double tau = (l.omega_rad_s >= omega ? kUp_s : kDown_s) * (1.0 + d.normal(0.02)) * (l.omega_rad_s == 0.0 ? 4.0 : 1.0);
    const int steps = static_cast<int>(std::lround(l.duration_s / kInner_s)) + static_cast<int>(20.0 * d.stream.uniform(d.at++));
    for (int i = 0; i < steps; ++i, ++inner) {
      if (inner % 20 == 0) {
        const bool settled = l.counts && i * kInner_s > 1.0, turns = omega > 5.0;
        csv += fmt::format("{:.4f},{},{:.3f},{:.4f},{:.5f},{:.7f}\n", t, settled ? std::to_string(number) : std::string(), l.omega_rad_s,
                           turns ? speed * omega + d.normal(0.3) : 0.0, gain_T * density * kCt * omega * omega + zero_N + d.normal(0.01),
                           cell + zero_N_m + (turns ? running_N_m : 0.0) + d.normal(1e-4));
      }
      const double next = l.omega_rad_s + (omega - l.omega_rad_s) * std::exp(-kInner_s / tau);
      const double torque = gain_Q * (density * kCq * omega * omega + kJ * (next - omega) / kInner_s);
      cell += (torque - cell) * (1.0 - std::exp(-kInner_s / 0.004));
      omega = next;
      t += kInner_s;
    }
    ++number;
  }
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "samples.csv") << csv;
  std::ofstream(folder / "run.toml") << "format = 1\ndiameter_m = 0.13\n[air]\ndensity_kg_m3 = 1.2\n[uncertainty]\nthrust_calibration = "
                                        "0.004\ntorque_calibration = 0.004\narm_length = 0\nalignment_rad = 0.0175\nrotor_speed = 0.0005\n"
                                        "density = 0.003\nhysteresis = 0\ncross_talk_m = 0\n";
}

TEST(StandCoverage, IntervalsOf95percentHoldTheTruthIn90To98percentOf200SimulatedRunsAndThoseOfCQInMore) {
  const test::TempFolder folder;
  std::map<std::string, int> held;
  std::map<std::string, double> squares;
  EstimateOptions o;
  o.draws = 100;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    write_run(folder.path() / "run", seed);
    const StandEstimate e = estimate_stand(read_stand_run(folder.path() / "run", {}), o);
    ASSERT_TRUE(e.thrust && e.torque && e.dynamics && e.dynamics->up && e.dynamics->down && e.dynamics->inertia_kg_m2) << seed;
    const auto count = [&](const char* name, double value, double low, double high, double truth) {
      held[name] += low <= truth && truth <= high;
      squares[name] += (value / truth - 1.0) * (value / truth - 1.0);
    };
    const auto within = [&](const char* name, double value, double u, double truth) {
      count(name, value, value - 1.96 * u, value + 1.96 * u, truth);
    };
    count("c_t", e.thrust->value, e.thrust->low, e.thrust->high, kCt);
    count("c_q", e.torque->value, e.torque->low, e.torque->high, kCq);
    within("J", *e.dynamics->inertia_kg_m2, *e.dynamics->inertia_u_kg_m2, kJ);
    within("time constant up", e.dynamics->up->value_s, e.dynamics->up->u_s, kUp_s);
    within("time constant down", e.dynamics->down->value_s, e.dynamics->down->u_s, kDown_s);
  }
  for (const auto& [name, n] : held) {
    const double share = static_cast<double>(n) / kRuns;
    std::printf("[ measured ] %s: %.1f %% of %d intervals hold the truth, rms error %.2f %%\n", name.c_str(), 100.0 * share, kRuns,
                100.0 * std::sqrt(squares[name] / kRuns));
    EXPECT_GE(share, 0.90) << name;
    if (name != "c_q") {
      EXPECT_LE(share, 0.98) << name;
    }
  }
}

}  // namespace
}  // namespace rotorloop::stand
