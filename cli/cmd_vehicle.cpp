// `rotorloop vehicle new`: a folder for a vehicle of one's own, from a scale, a ruler and data sheets, and what to do with it next.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "bench/hil/calibrate/blade_hover.hpp"
#include "bench/hil/calibrate/vehicle_sketch.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/shipped_files.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "sim/rotor/blade.hpp"

namespace rotorloop::cli {
namespace {

constexpr const char* kPolar = "vehicles/polars/naca4410.toml";  // of the section that a guessed blade has

struct VehicleArguments {
  std::filesystem::path folder;
  calibrate::VehicleSketch sketch;
  double wheelbase_mm = 0.0, resistance_mohm = 0.0;
  std::string propeller;
  std::filesystem::path blade;
  bool force = false;
};

// A blade's polars are files of their own, "../polars" seen from it (docs/files.md): the folder takes them along.
void copy_polar(const std::filesystem::path& from, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "polars");
  std::error_code none;
  if (std::filesystem::equivalent(from, folder / "polars" / from.filename(), none)) return;
  std::filesystem::copy_file(from, folder / "polars" / from.filename(), std::filesystem::copy_options::overwrite_existing);
}

// The propeller's numbers from its blade, and what the blade says of hover.
std::string take_blade(VehicleArguments& o, const sim::Blade& blade) {
  constexpr double kGravity_m_s2 = 9.81, kInch_m = 0.0254;
  const calibrate::BladeHover hover =
      calibrate::blade_hover(blade, o.sketch.mass_kg * kGravity_m_s2 / 4.0, calibrate::kSketchDensity_kg_m3);
  o.sketch.own_blade = true;
  o.sketch.blades = blade.blades;
  o.sketch.diameter_m = 2.0 * blade.radius_m;
  o.sketch.pitch_m = calibrate::blade_pitch_m(blade);
  o.sketch.blade_inertia_kg_m2 = blade.blade_inertia_kg_m2;
  o.sketch.c_t_N_s2 = hover.c_t_N_s2;
  o.sketch.c_q_N_m_s2 = hover.c_q_N_m_s2;
  return fmt::format("{}: {:.3g} x {:.3g} inch, {} blades; hover at {:.0f} RPM by the blade, {:.3g} W at the shaft, tip at {:.0f} m/s\n",
                     o.blade.generic_string(), o.sketch.diameter_m / kInch_m, o.sketch.pitch_m / kInch_m, blade.blades,
                     hover.omega_rad_s * 30.0 / std::numbers::pi, hover.shaft_power_W, hover.tip_speed_m_s);
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

int make(VehicleArguments& o) {
  o.sketch.wheelbase_m = 1e-3 * o.wheelbase_mm;
  o.sketch.line_resistance_ohm = 1e-3 * o.resistance_mohm;
  if (o.propeller.empty() == o.blade.empty())
    throw Error({"", "--propeller and --blade: one of them is needed, and one alone", "",
                 "give diameter x pitch (6x4.5), or the blade file that `rotorloop rotor fit` wrote"});
  if (o.blade.empty() && !calibrate::parse_propeller(o.propeller, o.sketch))
    throw Error({"", fmt::format("--propeller is \"{}\"", o.propeller), "",
                 "give diameter x pitch in inches, and the blades if more than two: 6x4.5 or 5.1x4.6x3"});
  sim::Blade blade;
  std::string said;
  if (!o.blade.empty()) {
    blade = sim::read_blade(o.blade);
    said = take_blade(o, blade);
  }
  const std::string name = o.folder.filename().empty() ? o.folder.parent_path().filename().string() : o.folder.filename().string();
  o.sketch.name = name;
  const std::filesystem::path polar = shipped_or_given(kPolar);
  if (o.blade.empty() && !std::filesystem::exists(polar))
    throw Error({polar.string(), "the polar of the blade is not there; " + places_looked_in(kPolar),
                 "the program was copied away from its files", "install rotorloop, or run it where it was built"});
  calibrate::SketchFiles files = calibrate::sketch_files(o.sketch);
  if (!o.blade.empty()) files.blade = text_of(o.blade);
  const std::array<std::pair<const char*, const std::string*>, 5> all{{{"blades/propeller.toml", &files.blade},
                                                                       {"motor.toml", &files.motor},
                                                                       {"plant.toml", &files.plant},
                                                                       {"start.toml", &files.vehicle},
                                                                       {"flights.toml", &files.scenario}}};
  std::filesystem::create_directories(o.folder / "blades");
  std::vector<OutputFile> outputs;
  for (const auto& [file, text] : all) outputs.push_back({"FOLDER", o.folder / file});
  check_outputs(outputs, o.force);
  for (const auto& [file, text] : all) write_text_file(o.folder / file, *text);
  for (const auto& file : o.blade.empty() ? std::vector{polar} : blade.polar_files) copy_polar(file, o.folder);
  const std::string f = o.folder.generic_string();
  fmt::print(stderr, "{}", said);
  fmt::print(stderr, "phase current limit {:.4g} A; the ESC holds up to {}\n", o.sketch.current_limit_A,
             sim::servable_text(calibrate::sketch_servable(o.sketch)));
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
  CLI::App* group = app.add_subcommand("vehicle", "files for your own vehicle, from its mass, dimensions and data sheets");
  group->require_subcommand(1);
  auto o = std::make_shared<VehicleArguments>();
  CLI::App* c = group->add_subcommand("new", "write blade, motor, plant and initial vehicle file of a quadrotor into a folder");
  c->add_option("folder", o->folder, "folder to create; its name becomes the vehicle's name")->required();
  c->add_option("--mass-kg", o->sketch.mass_kg, "take-off mass with battery, kg")->required();
  c->add_option("--wheelbase-mm", o->wheelbase_mm, "distance from motor to motor along the diagonal, mm")->required();
  c->add_option("--propeller", o->propeller, "diameter x pitch in inches, x blades if more than two: 6x4.5 or 5.1x4.6x3");
  c->add_option("--blade", o->blade,
                "in place of --propeller: a blade file from `rotorloop rotor fit`; the command copies it with its polars");
  c->add_option("--kv", o->sketch.kv_rpm_V, "no-load speed of the motor per volt, RPM/V")->required();
  c->add_option("--resistance-mohm", o->resistance_mohm, "between two leads of the motor, mΩ (\"internal resistance\" of data sheets)")
      ->required();
  c->add_option("--pole-pairs", o->sketch.pole_pairs, "half the number of magnets in the bell")
      ->check(CLI::Range(1, 30))
      ->capture_default_str();
  c->add_option("--no-load-A", o->sketch.no_load_A, "no-load current of the motor, A; default: estimated");
  c->add_option("--cells", o->sketch.cells, "battery cells in series")->required();
  c->add_option("--capacity-Ah", o->sketch.capacity_Ah, "battery capacity, Ah; default: estimated from the mass");
  c->add_option("--current-limit-A", o->sketch.current_limit_A,
                "limit of the phase current of an ESC, A; at most what it can hold with this motor and battery")
      ->required();
  add_force(*c, o->force);
  c->footer(
      "Prints the commands of the next steps, up to the first flight.\n"
      "Examples:\n  rotorloop vehicle new my/six_inch --mass-kg 0.75 --wheelbase-mm 265 --propeller 6x4.5x2 --kv 1700 --resistance-mohm 90 "
      "--cells 4 --current-limit-A 35\n"
      "  rotorloop vehicle new my/nine_inch --mass-kg 1.3 --wheelbase-mm 380 --blade my/blades/prop.toml --kv 900 --resistance-mohm 90 "
      "--cells 4 --current-limit-A 40");
  c->callback([o, &exit_code] { exit_code = make(*o); });
  group->footer("Example:\n  rotorloop vehicle new --help\nrotorloop --help lists the exit codes.");
}

}  // namespace rotorloop::cli
