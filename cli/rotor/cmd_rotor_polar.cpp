// `rotorloop rotor polar`: polars of a section as a plant's blade names them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "bench/propeller/fit/blade_files.hpp"
#include "bench/propeller/polar/polar_cache.hpp"
#include "bench/propeller/polar/section_maker.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

struct RotorPolarArguments {
  std::string section;
  fs::path out;
  propeller::SectionMakerOptions make;
  bool force = false, no_cache = false;
};

int make_polar(RotorPolarArguments o) {
  check_outputs({{"-o", o.out}}, o.force);
  for (std::size_t i = 1; i < o.make.settings.reynolds.size(); ++i)
    if (!(o.make.settings.reynolds[i] > o.make.settings.reynolds[i - 1]))
      throw Error({"--reynolds",
                   fmt::format("{:.0f} does not exceed {:.0f} before it", o.make.settings.reynolds[i], o.make.settings.reynolds[i - 1]), "",
                   "give them rising, each once"});
  if (!o.no_cache) o.make.cache = propeller::polar_cache_folder();
  o.make.progress = [](const std::string& line) { fmt::print(stderr, "{}\n", line); };
  const propeller::SectionPolars p = propeller::SectionMaker(o.make).make(o.section);
  std::string text = fmt::format("# {} by rotorloop rotor polar {}.\n", o.section, kVersion);
  for (const std::string& r : p.remarks) text += "# " + r + "\n";
  if (!o.out.parent_path().empty()) fs::create_directories(o.out.parent_path());
  write_text_file(o.out, text + propeller::polar_file_text(p.polar));
  fmt::print("{}{}\n", p.polar.source, p.cached ? " (kept from before)" : "");
  for (const std::string& r : p.remarks) fmt::print("  {}\n", r);
  fmt::print("written: {}\n", o.out.generic_string());
  return 0;
}

}  // namespace

void add_rotor_polar(CLI::App& rotor, int& exit_code) {
  auto o = std::make_shared<RotorPolarArguments>();
  o->make.shipped_polars = "vehicles/polars";
  CLI::App* c = rotor.add_subcommand(
      "polar", "compute lift and drag of an airfoil section over 360° with xfoil, from NACA digits or a coordinate file");
  c->add_option("section", o->section, "NACA digits (4412, 23012), or a coordinate file NAME.dat (Selig or Lednicer format)")->required();
  c->add_option("-o,--out", o->out, "polar file to write; a blade file finds it in ../polars")->required();
  c->add_option("--reynolds", o->make.settings.reynolds, "Reynolds numbers in ascending order")
      ->delimiter(',')
      ->check(CLI::Range(1e4, 1e6))
      ->capture_default_str();
  c->add_option("--ncrit", o->make.settings.n_crit, "critical amplification factor N of the transition model; 9 is a quiet wind tunnel")
      ->check(CLI::Range(1.0, 12.0))
      ->capture_default_str();
  c->add_option("--sweep-limit", o->make.settings.time_limit_s, "time limit of one xfoil sweep, s; points that converged before are used")
      ->check(CLI::Range(1.0, 600.0))
      ->capture_default_str();
  c->add_option("--polars", o->make.shipped_polars,
                "folder with the included sections, which replace NACA digits if xfoil is not installed")
      ->capture_default_str();
  c->add_flag("--no-cache", o->no_cache, "do not read or write the cache of polars");
  add_force(*c, o->force);
  c->footer(
      "Takes about a minute and needs xfoil (apt install xfoil). Without it the nearest included section replaces NACA digits, and output\n"
      "and file say so; coordinate files are refused. Polars are cached in $XDG_CACHE_HOME/rotorloop/polars (~/.cache).\n"
      "Examples:\n"
      "  rotorloop rotor polar 4412 -o my/polars/naca4412.toml\n"
      "  rotorloop rotor polar clarky.dat --reynolds 50000,100000,200000 -o my/polars/clarky.toml\n"
      "Exit codes: 0 written; 2 bad arguments or a damaged file; 3 a file cannot be written, or xfoil cannot be run.");
  c->callback([o, &exit_code] { exit_code = make_polar(*o); });
}

}  // namespace rotorloop::cli
