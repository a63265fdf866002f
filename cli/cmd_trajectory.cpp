// `rotorloop trajectory`: writes the shipped flights as trajectory files and tells their peaks.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "bench/hil/run_folder.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
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
  bool force = false;
};

int write(const TrajectoryArguments& o) {
  check_outputs({{"-o", o.out}}, o.force);
  const host::TrajectoryFile file = kFlights.at(o.name)();
  const host::Peaks p = host::peaks(file.trajectory);
  const std::string text = host::trajectory_text(file);
  if (o.out.empty()) {
    fmt::print("{}", text);
  } else {
    hil::write_text_file(o.out, text);
  }
  fmt::print(stderr, "{}: {:.1f} s, {:.2f} m/s horizontally, {:.2f} m/s vertically, {:.2f} m/s², yaw {:.2f} rad/s\n", file.name,
             file.trajectory.duration_s(), p.speed_xy_m_s, p.speed_z_m_s, p.accel_m_s2, p.yaw_rate_rad_s);
  return 0;
}

}  // namespace

void add_trajectory(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<TrajectoryArguments>();
  CLI::App* c = app.add_subcommand("trajectory", "write one of the shipped flights as a trajectory file");
  c->add_option("name", o->name,
                "horizontal_8p5, vertical_3p1, vertical_3p1_brisk, general, identify_vertical, identify_horizontal, identify_rotation, "
                "fast_descent, low_hover, ceiling_hover, diagnose_vertical, diagnose_horizontal or diagnose_rotation")
      ->required()
      ->check(CLI::IsMember(kFlights));
  c->add_option("-o,--out", o->out, "file to write; without it the trajectory goes to standard output");
  add_force(*c, o->force);
  c->footer(
      "Any planner can write trajectory files: piecewise polynomials, see docs/files.md.\n"
      "Example:\n  rotorloop trajectory vertical_3p1 -o scenarios/trajectories/vertical_3p1.toml");
  c->callback([o, &exit_code] { exit_code = write(*o); });
}

}  // namespace rotorloop::cli
