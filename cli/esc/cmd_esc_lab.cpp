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
      throw Error(
          {"--only", "no battery \"" + name + "\"", "", "use step, chirp, start, catch, sag, commission, fault, with commas between"});
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
  s.seed = o.seed, s.draws = o.draws, s.schedules = o.schedules;
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
  CLI::App* c = app.add_subcommand("esc-lab", "steps, starts, catches, sag, commissioning and faults of one ESC on drawn boards, judged");
  auto* plant =
      c->add_option("--plant", o->plant, "plant file: its first motor and propeller, power stage and battery")->check(CLI::ExistingFile);
  c->add_option("--motor", o->motor, "without a plant: motors drawn from a class")
      ->check(CLI::IsMember({"3in", "5in", "7in", "10in", "12in", "17in", "gimbal"}))
      ->capture_default_str()
      ->excludes(plant);
  c->add_option("--seed", o->seed, "the first draw; the others follow")->check(CLI::Range(1, 1000000))->capture_default_str();
  c->add_option("--draws", o->draws, "boards drawn for each battery")->check(CLI::Range(1, 1000))->capture_default_str();
  c->add_option("--schedules", o->schedules, "schedules of faults")->check(CLI::Range(1, 1000000))->capture_default_str();
  c->add_option("--only", o->only, "some of step,chirp,start,catch,sag,commission,fault")->delimiter(',');
  c->add_option("--out", o->out, "folder for report.html and result.json");
  add_force(*c, o->force);
  c->add_flag("--json", o->json, "the result as JSON in place of the table");
  c->add_flag("-q,--quiet", o->quiet, "no progress");
  c->footer(
      "The ESC is the firmware core compiled for this machine on a simulated bridge and motor. Drawn for each seed: dead time, gains, "
      "offsets\n"
      "and their drift, saliency and saturation, bad samples; of a class R, L, flux and inertia too. Starts and catches have data-sheet\n"
      "parameters, steps those that a commissioning leaves. Limits: docs/acceptance/esc_any_motor.md, esc_rpm_loop.md, "
      "esc_commissioning.md.\n"
      "Examples:\n"
      "  rotorloop esc-lab --out runs/esc_lab\n"
      "  rotorloop esc-lab --plant vehicles/quad_7in/plant.toml --only start,step,catch --draws 20\n"
      "Exit codes: 0 all limits met, 6 one missed, 2 bad arguments or plant file, 3 the report cannot be written.");
  c->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace rotorloop::cli
