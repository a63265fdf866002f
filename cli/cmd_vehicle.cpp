// `rotorloop vehicle new`: a folder for a vehicle of one's own, from a scale, a ruler and data sheets, and what to do with it next.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/calibrate/vehicle_sketch.hpp"
#include "bench/hil/run_folder.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/shipped_files.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

struct VehicleArguments {
  std::filesystem::path folder;
  calibrate::VehicleSketch sketch;
  double wheelbase_mm = 0.0, resistance_mohm = 0.0;
  std::string propeller;
  bool force = false;
};

// A blade's polars are files of their own, "../polars" seen from it (docs/files.md): the folder takes the shipped one along.
void copy_polar(const std::filesystem::path& from, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "polars");
  std::filesystem::copy_file(from, folder / "polars/naca4410.toml", std::filesystem::copy_options::skip_existing);
}

int make(VehicleArguments& o) {
  o.sketch.wheelbase_m = 1e-3 * o.wheelbase_mm;
  o.sketch.line_resistance_ohm = 1e-3 * o.resistance_mohm;
  if (!calibrate::parse_propeller(o.propeller, o.sketch))
    throw Error({"", fmt::format("--propeller is \"{}\"", o.propeller), "",
                 "give diameter x pitch in inches, and the blades if more than two: 6x4.5 or 5.1x4.6x3"});
  const std::string name = o.folder.filename().empty() ? o.folder.parent_path().filename().string() : o.folder.filename().string();
  o.sketch.name = name;
  const std::filesystem::path polar = shipped_or_given("vehicles/polars/naca4410.toml", share_folder());
  if (!std::filesystem::exists(polar))
    throw Error({polar.string(), "the polar of the blade is not there", "neither installed nor run from the source tree",
                 "run from the source tree, or install rotorloop"});
  const calibrate::SketchFiles files = calibrate::sketch_files(o.sketch);
  const std::array<std::pair<const char*, const std::string*>, 5> all{{{"blades/propeller.toml", &files.blade},
                                                                       {"motor.toml", &files.motor},
                                                                       {"plant.toml", &files.plant},
                                                                       {"start.toml", &files.vehicle},
                                                                       {"flights.toml", &files.scenario}}};
  std::filesystem::create_directories(o.folder / "blades");
  std::vector<OutputFile> outputs;
  for (const auto& [file, text] : all) outputs.push_back({"FOLDER", o.folder / file});
  check_outputs(outputs, o.force);
  for (const auto& [file, text] : all) hil::write_text_file(o.folder / file, *text);
  copy_polar(polar, o.folder);
  const std::string f = o.folder.generic_string();
  fmt::print(stderr, "{}: blade, motor, plant, start and flights written; guesses are marked in the files. Next:\n", f);
  fmt::print(
      "rotorloop trajectory horizontal_8p5 -o {0}/horizontal.toml\nrotorloop trajectory vertical_3p1 -o {0}/vertical.toml\n"
      "rotorloop calibrate --plant {0}/plant.toml --vehicle {0}/start.toml --trajectory {0}/horizontal.toml {0}/vertical.toml -o "
      "{0}/calibrated.toml\n"
      "rotorloop gains --vehicle {0}/calibrated.toml --plant {0}/plant.toml -o {0}/gains.toml\n"
      "rotorloop trajectory horizontal_8p5 --gains {0}/gains.toml -o {0}/horizontal.toml --force\n"
      "rotorloop trajectory vertical_3p1 --gains {0}/gains.toml -o {0}/vertical.toml --force\n"
      "rotorloop hil {0}/flights.toml --dry-run\nrotorloop hil {0}/flights.toml\n",
      f);
  return 0;
}

}  // namespace

void add_vehicle(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("vehicle", "a vehicle of one's own: its files from a scale, a ruler and data sheets");
  group->require_subcommand(1);
  auto o = std::make_shared<VehicleArguments>();
  CLI::App* c = group->add_subcommand("new", "write blade, motor, plant and start file of a quadrotor into a folder");
  c->add_option("folder", o->folder, "folder to make; its name becomes the vehicle's")->required();
  c->add_option("--mass-kg", o->sketch.mass_kg, "ready to fly, battery included")->required();
  c->add_option("--wheelbase-mm", o->wheelbase_mm, "motor to motor, diagonally")->required();
  c->add_option("--propeller", o->propeller, "diameter x pitch in inches, x blades if more than two: 6x4.5 or 5.1x4.6x3")->required();
  c->add_option("--kv", o->sketch.kv_rpm_V, "no-load speed of the motor, rpm/V")->required();
  c->add_option("--resistance-mohm", o->resistance_mohm, "between two leads of the motor, mΩ (\"internal resistance\" of data sheets)")
      ->required();
  c->add_option("--pole-pairs", o->sketch.pole_pairs, "magnets of the bell over two")->check(CLI::Range(1, 30))->capture_default_str();
  c->add_option("--no-load-A", o->sketch.no_load_A, "current of the motor without propeller; without it a guess");
  c->add_option("--cells", o->sketch.cells, "of the battery, in series")->required();
  c->add_option("--capacity-Ah", o->sketch.capacity_Ah, "of the battery; without it a guess by mass");
  c->add_option("--current-limit-A", o->sketch.current_limit_A, "phase current that an ESC may give, A")->required();
  add_force(*c, o->force);
  c->footer(
      "Prints the commands that make it fly.\n"
      "Example:\n  rotorloop vehicle new my/six_inch --mass-kg 0.75 --wheelbase-mm 265 --propeller 6x4.5x2 --kv 1700 --resistance-mohm 90 "
      "--cells 4 --current-limit-A 35");
  c->callback([o, &exit_code] { exit_code = make(*o); });
}

}  // namespace rotorloop::cli
