// `rotorloop-studies effects`: what each physical effect of the plant does, at defined points and in flight.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <thread>

#include "bench/hil/flight/effect_page.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/stop_signals.hpp"
#include "cli/progress/progress_line.hpp"
#include "cli/studies/studies.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"

namespace rotorloop::cli {
namespace {

struct EffectsArguments {
  std::string scenario = "scenarios/effects.toml", seeds, out;
  std::vector<std::string> effects;
  int jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  bool json = false, quiet = false, probes_only = false, force = false;
};

// For the page: without what changes neither table.
std::string command_line(const EffectsArguments& o) {
  std::string out = "rotorloop-studies effects";
  if (o.scenario != EffectsArguments{}.scenario) out += " --scenario " + o.scenario;
  for (const auto& e : o.effects) out += " --effect " + e;
  if (!o.seeds.empty()) out += " --seeds " + o.seeds;
  if (o.probes_only) out += " --probes-only";
  if (!o.out.empty()) out += " -o " + o.out;
  return out;
}

int effects(const EffectsArguments& o) {
  if (o.probes_only && !o.seeds.empty())
    throw Error({"--seeds", "does nothing with --probes-only: nothing is flown", "", "leave one of them out"});
  check_outputs({{"-o", o.out}}, o.force);
  const StopSignals stop;
  const auto chosen = hil::chosen_effects(o.effects);
  hil::EffectStudy study;
  study.scenario = hil::read_scenario(o.scenario);
  if (!o.seeds.empty()) study.scenario.seeds = hil::parse_seeds(o.seeds);
  study.command_line = command_line(o);
  const hil::Inputs inputs = hil::read_inputs(study.scenario);
  study.probes = hil::probe_effects(inputs, chosen);
  if (!o.probes_only) {
    ProgressLine progress(progress_style(o.quiet), stderr);
    study.flights = hil::compare_effects(study.scenario, inputs, chosen, {.jobs = o.jobs, .stop = stop.flag()}, progress);
  }
  if (stop.asked()) study.interrupted = stop.name();
  const std::string text = o.json ? hil::effect_json_text(study) : hil::effect_page(study);
  if (o.out.empty())
    fmt::print("{}", text);
  else
    write_text_file(o.out, text);
  const auto outside = std::count_if(study.probes.begin(), study.probes.end(), [](const auto& p) { return p.missed(); });
  if (outside > 0)
    fmt::print(stderr, "{} of {} sizes are outside a factor {:g} of their reference\n", outside, study.probes.size(), hil::kProbeFactor);
  if (stop.asked()) return stop.exit_code();
  return to_int(outside > 0 ? ExitCode::verdict : ExitCode::ok);
}

}  // namespace

void add_effects(CLI::App& app, int& exit_code) {
  auto* c = app.add_subcommand("effects", "each physical effect of the plant on and off: sizes against references, and in flight");
  auto o = std::make_shared<EffectsArguments>();
  c->add_option("--effect", o->effects, "only this effect, by id (repeatable); default: all");
  c->add_option("--scenario", o->scenario, "flights, and which effect each of them shows")->capture_default_str();
  c->add_option("--seeds", o->seeds, "other seeds than the file's: a count N (seeds 1 to N) or a list (1,4,7..9)");
  c->add_option("-j,--jobs", o->jobs, "flights at a time; results do not depend on it")->check(CLI::Range(1, 256))->capture_default_str();
  c->add_flag("--probes-only", o->probes_only, "sizes at defined points only: a second instead of minutes");
  c->add_option("-o,--out", o->out, "file to write; without it the page goes to standard output");
  add_force(*c, o->force);
  c->add_flag("--json", o->json, "one JSON document instead of Markdown");
  c->add_flag("-q,--quiet", o->quiet, "no progress on stderr");
  c->footer(
      "Examples:\n"
      "  rotorloop-studies effects --effect axial_inflow --effect blockage_strut     two effects, on standard output\n"
      "  rotorloop-studies effects -o docs/effects.md --force                        all of them: docs/effects.md\n"
      "  rotorloop-studies effects --probes-only --json | jq '.probes[] | select(.within | not)'\n"
      "\nExit codes: 0 all sizes within a factor 2 of their reference, 2 bad arguments or input file, 6 a size is outside,\n"
      "130 and 143 interrupted: what was flown until then is printed, marked.\n"
      "A flight that an effect brings down is a result: the table says why it ended.");
  c->callback([o, &exit_code] { exit_code = effects(*o); });
}

}  // namespace rotorloop::cli
