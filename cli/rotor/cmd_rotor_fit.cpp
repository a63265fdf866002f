// `rotorloop rotor fit`: a blade file of any propeller from its geometry and what was measured of it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <optional>

#include "bench/propeller/fit/blade_document.hpp"
#include "bench/propeller/fit/blade_files.hpp"
#include "bench/propeller/polar/polar_cache.hpp"
#include "bench/propeller/polar/section_maker.hpp"
#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

struct RotorFitArguments {
  std::vector<fs::path> files, stand;
  fs::path out, mapping;
  propeller::PropellerInputs inputs;
  propeller::PropellerFileOptions read;
  double sweep_limit_s = propeller::SweepSettings{}.time_limit_s;
  bool force = false, json = false;
};

// Steps of a run on a stand as rows of a static table.
void add_stand_rows(const RotorFitArguments& o, propeller::PropellerFiles& files) {
  stand::RunOptions with;
  if (!o.mapping.empty()) with.mapping = stand::read_stand_mapping(o.mapping);
  std::vector<propeller::MeasuredRow> rows;
  for (const fs::path& path : o.stand) {
    const stand::StandRun run = stand::read_stand_run(path, with);
    stand::EstimateOptions options;
    options.draws = 100;
    const stand::StandEstimate e = stand::estimate_stand(run, options);
    if (!e.thrust || !e.torque)
      throw Error({path.generic_string(), "thrust and torque are needed, and one of them cannot be used", "a channel lacks or is faulty",
                   "rotorloop stand estimate names the fault"},
                  ExitCode::data_quality);
    const double rho = run.facts.air_density_kg_m3;
    const auto &T = e.thrust->rows, &Q = e.torque->rows;
    for (Eigen::Index i = 0; i < T.y.size() && i < Q.y.size(); ++i) {
      const double n = T.omega_rad_s(i) / (2.0 * std::numbers::pi), force = rho * n * n * std::pow(files.diameter_m, 4);
      if (!(n > 0.0)) continue;
      const double thrust = T.y(i) - e.thrust->fit.value("zero"),
                   torque = Q.y(i) - e.torque->fit.value("zero") - e.torque->fit.value("running offset");
      rows.push_back({60.0 * n, 0.0, thrust / force, 2.0 * std::numbers::pi * torque / (force * files.diameter_m)});
    }
  }
  std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.rpm < b.rpm; });
  if (!files.sets.empty() && files.sets.front().label == "static")
    files.sets.insert(files.sets.begin() + 1, {"stand", rows, false, true});
  else
    files.sets.insert(files.sets.begin(), {"static", rows, true, true});
}

int fit(RotorFitArguments o) {
  check_outputs({{"-o", o.out}}, o.force);
  if (const char* data = std::getenv("ROTORLOOP_DATA")) o.inputs.data = data;
  propeller::PropellerFiles files = propeller::read_propeller_files(o.files, o.read);
  if (!o.stand.empty()) add_stand_rows(o, files);
  propeller::SectionMakerOptions make{.settings = {},
                                      .shipped_polars = o.inputs.shipped_polars,
                                      .cache = propeller::polar_cache_folder(),
                                      .progress = [](const std::string& line) { fmt::print(stderr, "{}\n", line); }};
  make.settings.time_limit_s = o.sweep_limit_s;
  const propeller::SectionMaker maker(make);
  o.inputs.make_polars = [&maker](const std::string& section) { return maker.make(section); };
  o.inputs.can_make_polars = [&maker](const std::string& section) { return maker.can_make(section); };
  const propeller::BladeFit result = propeller::fit_any_blade(files, o.inputs, o.out.stem().string());
  const auto files_written = propeller::blade_files(result, o.out, std::string("rotorloop rotor fit ") + kVersion);
  for (const auto& [path, text] : files_written) {
    fs::create_directories(path.parent_path().empty() ? fs::path(".") : path.parent_path());
    write_text_file(path, text);
  }
  fmt::print("{}", o.json ? propeller::blade_fit_json(result, files_written, kVersion) : propeller::blade_fit_text(result));
  if (!o.json)
    for (const auto& [path, text] : files_written) fmt::print("written: {}\n", path.generic_string());
  return to_int(!result.fitted || propeller::holds(result) ? ExitCode::ok : ExitCode::verdict);
}

}  // namespace

void add_rotor_fit(CLI::App& rotor, int& exit_code) {
  auto o = std::make_shared<RotorFitArguments>();
  CLI::App* c = rotor.add_subcommand(
      "fit",
      "write a blade file of a propeller from its geometry and measurements: four parameters are fitted, held-out rows give the errors");
  c->add_option("files", o->files,
                "files with geometry and measured tables in any order, or a folder with them; the command recognises each by its contents")
      ->required();
  c->add_option("-o,--out", o->out, "blade file to write, FOLDER/blades/NAME.toml; its polars are written to FOLDER/polars")->required();
  c->add_option("--stand", o->stand, "runs on a thrust stand, used as static measurements");
  c->add_option("-m,--mapping", o->mapping, "mapping file of these runs");
  c->add_option("--diameter", o->read.diameter_m, "nominal diameter that the coefficients refer to, m; default: that of the geometry")
      ->check(CLI::Range(0.01, 4.0));
  c->add_option("--blades", o->read.blades, "number of blades, if the geometry does not contain it")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  c->add_option("--density", o->read.air_density_kg_m3, "air density for tables of thrust and torque, kg/m³")
      ->check(CLI::Range(0.5, 1.6))
      ->capture_default_str();
  c->add_option(
      "--section", o->inputs.section,
      "airfoil section of the whole blade, in place of the automatic choice: NACA digits (4412, 23012), a coordinate file NAME.dat (xfoil "
      "computes its polars), or a name in --polars or in the measured data");
  c->add_option("--polars", o->inputs.shipped_polars, "folder with polar files NAME.toml and coordinate files NAME.dat")
      ->capture_default_str();
  c->add_option("--fit-rpm", o->inputs.fit_rpm, "fit the sweep nearest to this rotor speed, RPM")->check(CLI::Range(100.0, 1e5));
  c->add_option("--stall-drag", o->inputs.stall_drag, "share of the drag that comes with delayed stall, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  c->add_option("--sweep-limit", o->sweep_limit_s, "time limit of one xfoil sweep, s; points that converged before are used")
      ->check(CLI::Range(1.0, 600.0))
      ->capture_default_str();
  c->add_flag("--json", o->json, "one JSON document on stdout in place of tables");
  add_force(*c, o->force);
  c->footer(
      "As in `rotor validate`, every second static row and every second row of one sweep are fitted; all others are held out. Without a\n"
      "static table nothing is fitted, and the blade file is marked UNFITTED. Missing polars are computed with xfoil (apt install xfoil)\n"
      "at Reynolds numbers from 30 000 to 500 000, in about a minute, and cached in $XDG_CACHE_HOME/rotorloop/polars (~/.cache). Without\n"
      "xfoil the nearest included section replaces NACA digits, and output and blade file say so; coordinate files are refused.\n"
      "Examples:\n"
      "  rotorloop rotor fit prop_geom.txt prop_static.txt prop_J_5039rpm.txt --diameter 0.127 -o my/blades/prop.toml\n"
      "  rotorloop rotor fit folder_of_the_propeller --diameter 0.254 -o my/blades/prop.toml\n"
      "  rotorloop rotor fit folder_of_the_propeller --diameter 0.254 --section my/section.dat -o my/blades/prop.toml\n"
      "Exit codes: 0 written; 6 written, but held-out static rows or more than a third of the held-out sweeps are beyond their limits; 2 "
      "bad arguments or files; 3 a file cannot be "
      "written; 5 a stand's run cannot be used.");
  c->callback([o, &exit_code] { exit_code = fit(*o); });
}

}  // namespace rotorloop::cli
