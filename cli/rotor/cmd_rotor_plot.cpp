// `rotorloop rotor plot`: one HTML page with pictures of a rotor.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "bench/propeller/report/rotor_plot.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

constexpr double kRad_s_per_rpm = std::numbers::pi / 30;
constexpr double kUsualTip_m_s = 60.0;  // near hover of small multirotors, whatever their size

struct RotorPlotArguments {
  std::filesystem::path blade, out = "rotor.html";
  std::optional<double> rpm;
  double density_kg_m3 = 1.225, climb_m_s = 0.0, edgewise_m_s = 8.5;
  std::string spin = "ccw";
  bool force = false;
};

// CLI::Range lets not-a-number pass; no other number has an n in it.
CLI::Validator within(double low, double high) {
  CLI::Validator v = CLI::Range(low, high);
  v.operation([range = v](std::string& text) mutable {
    return text.find_first_of("nN") != std::string::npos ? text + " is not a number" : range(text);
  });
  return v;
}

int plot(const RotorPlotArguments& o) {
  check_outputs({{"-o", o.out}}, o.force);
  const sim::Blade blade = sim::read_blade(o.blade);
  propeller::RotorPlotRequest request;
  request.title = o.blade.stem().string();
  request.source = o.blade.generic_string();
  request.version = std::string("rotorloop ") + kVersion + " (" + kGit + ")";
  request.condition.v_R_m_s = {o.edgewise_m_s, 0.0, o.climb_m_s};
  request.condition.omega_rad_s = o.rpm ? *o.rpm * kRad_s_per_rpm : kUsualTip_m_s / blade.radius_m;
  request.condition.density_kg_m3 = o.density_kg_m3;
  request.condition.spin = o.spin == "ccw" ? 1 : -1;
  write_text_file(o.out, propeller::rotor_plot_html(blade, request));
  fmt::print("{}\n", o.out.generic_string());
  return 0;
}

}  // namespace

void add_rotor_plot(CLI::App& rotor_group, int& exit_code) {
  auto o = std::make_shared<RotorPlotArguments>();
  CLI::App* c = rotor_group.add_subcommand("plot", "plot a rotor in one HTML page: blade, coefficients, descent, maps over the disk");
  c->add_option("blade", o->blade, "blade file: radius, chord, twist, polars (docs/files.md)")->required();
  c->add_option("-o,--out", o->out, "HTML page to write")->capture_default_str();
  add_force(*c, o->force);
  c->add_option("--rpm", o->rpm, "rotor speed, RPM; default: tip speed 60 m/s, near hover of small multirotors")->check(within(1.0, 2e5));
  c->add_option("--density", o->density_kg_m3, "air density, kg/m³: 1.225 at sea level and 15 °C, 1.2 at 20 °C, 1.0 at 2000 m")
      ->check(within(0.01, 10.0))
      ->capture_default_str();
  c->add_option("--climb", o->climb_m_s, "speed along the thrust axis, m/s, negative in descent; for the operating point and the disk maps")
      ->check(within(-200.0, 200.0))
      ->capture_default_str();
  c->add_option("--edgewise", o->edgewise_m_s, "speed in the disk plane, m/s; for the operating point and the disk maps")
      ->check(within(0.0, 200.0))
      ->capture_default_str();
  c->add_option("--spin", o->spin, "direction of rotation seen from above: ccw (front right and rear left rotors) or cw")
      ->check(CLI::IsMember({"ccw", "cw"}))
      ->capture_default_str();
  c->footer(
      "The page shows the rotor as the simulation uses it: chord, twist and polars; C_T, C_P and efficiency over J at three speeds;\n"
      "C_T, C_P, C_H and hub moments over mu; thrust and induced velocity through vortex ring and windmill states; and maps over the disk\n"
      "at the given operating point. It is one file and needs no network.\n"
      "\n"
      "Level flight at 10 m/s with a forward tilt of 30° is --edgewise 8.7 --climb 5.0: the air comes from above the disk.\n"
      "\n"
      "Examples:\n"
      "  rotorloop rotor plot vehicles/blades/triblade_5in.toml\n"
      "  rotorloop rotor plot vehicles/blades/triblade_5in.toml -o descent.html --rpm 9000 --climb -6 --edgewise 0\n"
      "\n"
      "Exit codes: 0 written, 2 bad arguments or blade file, 3 the page cannot be written.");
  c->callback([o, &exit_code] { exit_code = plot(*o); });
}

}  // namespace rotorloop::cli
