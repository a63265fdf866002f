// `rotorloop esc-lab`: batteries of trials of one ESC on drawn boards, judged.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bench/hil/esc_lab/lab.hpp"
#include "bench/hil/esc_lab/lab_page.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"
#include "sim/plant/plant_file.hpp"

namespace rotorloop::cli {
namespace {

struct EscLabArguments {
  std::filesystem::path plant, out;
  std::string motor = "5in";
  std::vector<std::string> only;
  std::uint64_t seed = 1, draws = 8, schedules = 300;
  bool json = false, quiet = false, force = false;
};

std::vector<esc_lab::Battery> batteries(const std::vector<std::string>& names) {
  std::vector<esc_lab::Battery> out;
  for (const std::string& name : names) {
    const auto at = std::find(esc_lab::kBatteryNames.begin(), esc_lab::kBatteryNames.end(), name);
    if (at == esc_lab::kBatteryNames.end())
      throw Error({"--only", "\"" + name + "\" is not a trial", "",
                   "use one or several of step, chirp, start, catch, sag, commission, fault, separated by commas"});
    out.push_back(static_cast<esc_lab::Battery>(at - esc_lab::kBatteryNames.begin()));
  }
  return out;
}

// Redrawn on a terminal, else one line for each battery that is done.
void show_progress(std::string_view battery, std::uint64_t done, std::uint64_t of) {
  static const bool terminal = isatty(STDERR_FILENO) != 0;
  if (terminal)
    fmt::print(stderr, "\r\x1b[K{} {}/{}{}", battery, done, of, done == of ? "\r\x1b[K" : "");
  else if (done == of)
    fmt::print(stderr, "{} {}/{}\n", battery, done, of);
  std::fflush(stderr);
}

int run(const EscLabArguments& o) {
  if (!o.out.empty()) check_outputs(report_files("--out", o.out), o.force);
  esc_lab::LabSettings s;
  s.seed = o.seed;
  s.draws = o.draws;
  s.schedules = o.schedules;
  s.only = batteries(o.only);
  if (!o.quiet) s.progress = show_progress;
  const esc_lab::Subject subject =
      o.plant.empty() ? esc_lab::class_subject(*esc_lab::find_motor_class(o.motor)) : esc_lab::plant_subject(sim::read_plant(o.plant));
  const esc_lab::LabResult result = run_lab(subject, s);
  const std::string version = std::string("rotorloop ") + kVersion + " (" + kGit + ")";
  const std::string json = esc_lab::lab_json(result, version);
  fmt::print("{}", o.json ? json : esc_lab::lab_text(result));
  if (!o.out.empty()) {
    write_text_file(o.out / "result.json", json);
    write_text_file(o.out / "report.html", esc_lab::lab_html(result, version));
    if (!o.json) fmt::print("report: {}\n", (o.out / "report.html").generic_string());
  }
  return to_int(result.met() ? ExitCode::ok : ExitCode::verdict);
}

}  // namespace

void add_esc_lab(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<EscLabArguments>();
  CLI::App* c = app.add_subcommand(
      "esc-lab",
      "judge one simulated ESC on boards with sampled tolerances: speed steps, start-up, catching a spinning rotor, sag, faults");
  auto* plant = c->add_option("--plant", o->plant, "plant file; its first motor and propeller, power stage and battery are used")
                    ->check(CLI::ExistingFile);
  c->add_option("--motor", o->motor, "without --plant: class from which motors are sampled")
      ->check(CLI::IsMember({"3in", "5in", "7in", "10in", "12in", "17in", "gimbal"}))
      ->capture_default_str()
      ->excludes(plant);
  c->add_option("--seed", o->seed, "seed of the first sample; the others follow")->check(CLI::Range(1, 1000000))->capture_default_str();
  c->add_option("--draws", o->draws, "number of sampled boards for each battery")->check(CLI::Range(1, 1000))->capture_default_str();
  c->add_option("--schedules", o->schedules, "number of fault schedules")->check(CLI::Range(1, 1000000))->capture_default_str();
  c->add_option("--only", o->only, "only these trials, separated by commas: step, chirp, start, catch, sag, commission, fault")
      ->delimiter(',');
  c->add_option("--out", o->out, "folder for report.html and result.json");
  add_force(*c, o->force);
  c->add_flag("--json", o->json, "print the result as JSON in place of the table");
  c->add_flag("-q,--quiet", o->quiet, "no progress on stderr");
  c->footer(
      "The ESC is the firmware core, compiled for this machine, on a simulated inverter and motor. Each seed samples dead time, gains,\n"
      "offsets and their drift, saliency, saturation and bad samples, and with --motor also R, L, flux and inertia. Start and catch "
      "trials\n"
      "use data-sheet parameters, step trials the parameters from a commissioning. Limits: docs/acceptance/esc_any_motor.md,\n"
      "esc_rpm_loop.md, esc_commissioning.md.\n"
      "Examples:\n"
      "  rotorloop esc-lab --out runs/esc_lab\n"
      "  rotorloop esc-lab --plant vehicles/quad_7in/plant.toml --only start,step,catch --draws 20\n"
      "Exit codes: 0 all limits met, 2 bad arguments or plant file, 3 the report cannot be written, 6 a limit was missed.");
  c->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace rotorloop::cli
