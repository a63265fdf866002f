// `rotorloop trajectory`: writes the shipped flights as trajectory files and tells their peaks.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "host/base/text_file.hpp"
#include "host/control/gains_file.hpp"
#include "host/control/trajectory_file.hpp"
#include "host/control/trajectory_generator.hpp"

namespace rotorloop::cli {
namespace {

const std::map<std::string, host::TrajectoryFile (*)()> kFlights{{"horizontal_8p5", host::horizontal_8p5},
                                                                 {"vertical_3p1", host::vertical_3p1},
                                                                 {"vertical_3p1_brisk", host::vertical_3p1_brisk},
                                                                 {"general", host::general},
                                                                 {"identify_vertical", host::identify_vertical},
                                                                 {"identify_horizontal", host::identify_horizontal},
                                                                 {"identify_rotation", host::identify_rotation},
                                                                 {"fast_descent", host::fast_descent},
                                                                 {"low_hover", host::low_hover},
                                                                 {"ceiling_hover", host::ceiling_hover},
                                                                 {"diagnose_vertical", host::diagnose_vertical},
                                                                 {"diagnose_horizontal", host::diagnose_horizontal},
                                                                 {"diagnose_rotation", host::diagnose_rotation}};

struct TrajectoryArguments {
  std::string name;
  std::filesystem::path out;
  std::filesystem::path gains;
  double time_scale = 1.0, max_speed_m_s = std::numeric_limits<double>::infinity();
  bool force = false;
};

// What the set-point may use of a vehicle's limits: the rest is for feedback and drag.
constexpr double kOfThrust = 0.8, kOfTilt = 0.85;

// A shipped flight or a file, slowed down as far as was asked for or the vehicle's limits need.
host::TrajectoryFile flight(const TrajectoryArguments& o) {
  host::TrajectoryFile file = kFlights.contains(o.name) ? kFlights.at(o.name)() : host::read_trajectory(o.name);
  file = host::slowed(file, o.time_scale);
  host::TrajectoryLimits limits{o.max_speed_m_s, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  if (!o.gains.empty()) {
    const host::ThrustLimits of_vehicle = host::read_gains(o.gains).limits;
    limits.thrust_weight = kOfThrust * of_vehicle.total_max_weight;
    limits.tilt_rad = kOfTilt * of_vehicle.tilt_max_rad;
  }
  const double factor = host::slowing(file.trajectory, limits);
  if (factor * o.time_scale > 1.0) file.name += fmt::format(", {:.2f} times slower", factor * o.time_scale);
  return host::slowed(file, factor);
}

int write(const TrajectoryArguments& o) {
  check_outputs({{"-o", o.out}}, o.force);
  const host::TrajectoryFile file = flight(o);
  const host::Peaks p = host::peaks(file.trajectory);
  const std::string text = host::trajectory_text(file);
  if (o.out.empty()) {
    fmt::print("{}", text);
  } else {
    write_text_file(o.out, text);
  }
  fmt::print(stderr, "{}: {:.1f} s, {:.2f} m/s horizontally, {:.2f} m/s vertically, {:.2f} m/s², yaw {:.2f} rad/s\n", file.name,
             file.trajectory.duration_s(), p.speed_xy_m_s, p.speed_z_m_s, p.accel_m_s2, p.yaw_rate_rad_s);
  return 0;
}

}  // namespace

void add_trajectory(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<TrajectoryArguments>();
  CLI::App* c = app.add_subcommand(
      "trajectory", "write a trajectory file from an included flight or another file, unchanged or slowed down to the limits of a vehicle");
  c->add_option("name", o->name,
                "horizontal_8p5, vertical_3p1, vertical_3p1_brisk, general, identify_vertical, identify_horizontal, identify_rotation, "
                "fast_descent, low_hover, ceiling_hover, diagnose_vertical, diagnose_horizontal or diagnose_rotation; or a trajectory file")
      ->required()
      ->check(CLI::Validator(
          [](std::string& word) { return std::filesystem::is_regular_file(word) ? std::string() : CLI::IsMember(kFlights)(word); },
          "NAME or FILE"));
  c->add_option("--time-scale", o->time_scale, "slow the flight down by this factor")->check(CLI::Range(1.0, 100.0))->capture_default_str();
  c->add_option("--max-speed", o->max_speed_m_s, "slow the flight down to this highest speed, m/s")->check(CLI::Range(0.05, 100.0));
  c->add_option("--gains", o->gains,
                "gains file: slow the flight down until it needs at most 80 % of the thrust and 85 % of the tilt that the file allows")
      ->check(CLI::ExistingFile);
  c->add_option("-o,--out", o->out, "file to write; without it the trajectory goes to standard output");
  add_force(*c, o->force);
  c->footer(
      "A trajectory file holds piecewise polynomials (docs/files.md); any planner can write one.\n"
      "Examples:\n  rotorloop trajectory vertical_3p1 -o scenarios/trajectories/vertical_3p1.toml\n"
      "  rotorloop trajectory horizontal_8p5 --gains gains.toml --max-speed 5 -o slow.toml");
  c->callback([o, &exit_code] { exit_code = write(*o); });
}

}  // namespace rotorloop::cli
