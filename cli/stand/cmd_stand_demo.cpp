// `rotorloop stand demo`: a whole run in virtual time, from the stand file to a report; opens no port.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "bench/stand/evaluate/estimate/estimate_files.hpp"
#include "bench/stand/evaluate/report/estimate_document.hpp"
#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/prediction.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/shipped_files.hpp"
#include "cli/stand/bus_commands.hpp"
#include "cli/stand/device_argument.hpp"
#include "cli/stand/stand_run_options.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

struct DemoArguments {
  StandRunOptions run;
  VirtualOptions virtual_run;
  std::filesystem::path folder = "stand_demo";
  bool json = false;
};

int stand_demo(DemoArguments& o) {
  o.run.setup = "devices/virtual/stand.toml";
  o.run.sequences = {"staircase", "step"};
  o.run.sequence.levels = 12;
  // The reference propeller's usual speeds, the middle at 9 000 RPM.
  o.run.rpm = {3000.0, 13500.0};
  o.run.out = o.folder / "run";
  const modbus::StandSetup setup = modbus::read_stand_setup(shipped_or_given(o.run.setup), profile_path);
  const stand_run::Plan plan = stand_run::plan_of(o.run, setup);
  o.run.summary = !o.json;
  if (!o.json)
    fmt::print("{}", stand_run::prediction_text(setup, plan, stand_run::predict(setup, plan, o.run.session.settle_s, o.run.supply_V)));
  if (const int code = run_virtually(o.run, o.virtual_run, setup, plan); code != 0) return code;
  stand::EstimateOptions options;
  options.window_rad_s = {{7000.0 * kRad_s_per_rpm, 11000.0 * kRad_s_per_rpm}};
  stand::EstimateDocument d;
  d.version = o.run.version;
  d.command = "rotorloop stand demo";
  d.reference_density_kg_m3 = options.reference_density_kg_m3;
  const std::filesystem::path samples = o.run.out / stand::kSamplesFile;
  d.inputs.emplace_back(samples.generic_string(), sha256_file(samples));
  d.files.push_back({stand::estimate_stand(stand::read_stand_run(o.run.out, {}), options), std::nullopt});
  fmt::print("{}", o.json ? stand::estimate_json(d) : stand::estimate_text(d));
  write_text_file(o.folder / "result.json", stand::estimate_json(d));
  write_text_file(o.folder / "report.html", stand::estimate_page(d));
  if (d.files[0].estimate.motor)
    write_text_file(o.folder / "motor.toml",
                    stand::motor_file_text(d.files[0].estimate, {shipped_or_given("vehicles/motors/2306_2300kv.toml"), {}},
                                           std::string("rotorloop stand demo ") + kVersion));
  if (!o.json) fmt::print("simulated from beginning to end; report: {}\n", (o.folder / "report.html").generic_string());
  return 0;
}

}  // namespace

void add_stand_demo(CLI::App& stand, int& exit_code) {
  auto o = std::make_shared<DemoArguments>();
  CLI::App* c = stand.add_subcommand("demo", "simulate a whole session in virtual time: plan, run, estimate, report; opens no port");
  c->add_option("-o,--out", o->folder, "folder to create")->capture_default_str();
  add_virtual_options(*c, o->virtual_run);
  c->add_flag("--json", o->json, "result.json on stdout instead of plan and tables");
  c->add_flag("-q,--quiet", o->run.quiet, "no progress on stderr");
  c->footer(
      "The simulation contains the ESC firmware, motor, inverter and a blade-element rotor; the errors of mount and instruments are "
      "sampled\n"
      "with --seed.\n"
      "Example:\n  rotorloop stand demo -o demo && xdg-open demo/report.html");
  c->callback([o, &exit_code] { exit_code = stand_demo(*o); });
}

}  // namespace rotorloop::cli
