// Speed and memory of the fit: model-true flights of 20 s at 200 Hz (vertical, horizontal, rotation in turn), the paper's θ and the
// pose delay (18 numbers), start values 5 % off. One solver, one problem per process, so that the peak of its memory is its own.
// Prints one JSON object. Called by scripts/bench.py.
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/sysid/estimate/ceres_solver.hpp"
#include "host/base/error.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace {

using namespace rotorloop;

double cpu_s() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(u.ru_utime) + s(u.ru_stime);
}
double peak_resident_MB() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return static_cast<double>(u.ru_maxrss) / 1024.0;
}

std::vector<estimate::GridFlight> fly(int flights) {
  std::vector<estimate::GridFlight> out;
  for (int i = 0; i < flights; ++i) {
    const auto manoeuvre = static_cast<model_true::Manoeuvre>(i % 3);
    const auto seed = static_cast<std::uint64_t>(i + 1);
    out.push_back(estimate::make_grid(model_true::fly(model_true::Truth{}, {.manoeuvre = manoeuvre, .seed = seed}).record, {}));
  }
  return out;
}

estimate::FitProblem problem_of(const std::vector<estimate::GridFlight>& flights, bool noise_unknown) {
  estimate::FitProblem p{.start = estimate::model_values(model_true::vehicle_of(model_true::Truth{})),
                         .free = {},
                         .flights = {},
                         .noise = {},
                         .flight_noise = {},
                         .flight_start = {}};
  double sign = 1.0;
  for (const int k : {estimate::kIxx, estimate::kIyy, estimate::kIzz, estimate::kCq, estimate::kComX, estimate::kComY, estimate::kK1,
                      estimate::kK2, estimate::kCdh, estimate::kCdxy, estimate::kCdz, estimate::kOffsetX, estimate::kOffsetY,
                      estimate::kOffsetZ, estimate::kTurnX, estimate::kTurnY, estimate::kTurnZ, estimate::kPoseDelay}) {
    p.free.push_back({.parameter = k});
    p.start[k] += 0.05 * (sign * p.start[k] + 0.1 * estimate::parameter_info(k, {}).scale);
    sign = -sign;
  }
  for (const estimate::GridFlight& g : flights) p.flights.push_back(&g);
  const double wrong = noise_unknown ? 2.0 : 1.0;
  p.noise.force_m_s2_rtHz.setConstant(wrong * 0.03);
  p.noise.angular_rad_s2_rtHz.setConstant(0.3 / wrong);
  p.noise.position_m.setConstant(wrong * 2e-3);
  p.noise.attitude_rad.setConstant(2e-3 / wrong);
  return p;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string solver = argc == 3 ? argv[1] : "";
  const int flights = argc == 3 ? std::atoi(argv[2]) : 0;
  if (flights < 1 || (solver != "own" && solver != "em" && solver != "ceres")) {
    std::fprintf(stderr,
                 "usage: bench_identify own|em|ceres FLIGHTS\n  em: the own solver with the noise unknown, twice and half too large\n");
    return to_int(ExitCode::usage);
  }
  try {
    const auto grids = fly(flights);
    const estimate::FitProblem problem = problem_of(grids, solver == "em");
    estimate::FitOptions options;
    if (solver == "em") options.noise.rounds = 40;
    const double flown_MB = peak_resident_MB(), cpu_before = cpu_s();
    const auto start = std::chrono::steady_clock::now();
    const estimate::Fit fit = solver == "ceres" ? estimate::fit_with_ceres(problem, options) : estimate::fit(problem, options);
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), used_s = cpu_s() - cpu_before;
    std::size_t states = 0;
    for (const auto& g : grids) states += g.nodes;
    nlohmann::json u, value;
    for (const estimate::Estimate& e : fit.estimates) {
      value.push_back(e.value);
      u.push_back(e.u);
    }
    const nlohmann::json out{{"solver", solver},
                             {"states", states},
                             {"parameters", fit.estimates.size()},
                             {"cpu_s", used_s},
                             {"wall_s", wall_s},
                             {"iterations", fit.iterations},
                             {"noise_rounds", fit.noise_rounds},
                             {"converged", fit.converged},
                             {"cost", fit.cost},
                             {"peak_resident_MB", peak_resident_MB()},
                             {"peak_resident_before_MB", flown_MB},
                             {"value", value},
                             {"u", u}};
    std::printf("%s\n", out.dump().c_str());
    return fit.converged ? 0 : to_int(ExitCode::verdict);
  } catch (const Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return to_int(e.exit_code());
  }
}
