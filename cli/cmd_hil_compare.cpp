// `rotorloop hil compare RUN RUN`: two run folders side by side, from their files alone.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "bench/hil/flight/compare.hpp"
#include "cli/hil_commands.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {

void add_hil_compare(CLI::App& hil, int& exit_code) {
  struct Options {
    std::string a, b;
    bool json = false, fail_on_diff = false, verify = false;
  };
  auto* c = hil.add_subcommand("compare", "two run folders side by side: same bytes, or figures that differ by more than scatter");
  auto o = std::make_shared<Options>();
  c->add_option("A", o->a, "run folder")->required();
  c->add_option("B", o->b, "run folder")->required();
  c->add_flag("--fail-on-diff", o->fail_on_diff, "exit with 8 when a figure differs significantly or a flight ended differently");
  c->add_flag("--verify", o->verify, "hash the logs again instead of trusting result.json");
  c->add_flag("--json", o->json, "print one JSON document");
  c->footer(
      "Examples:\n"
      "  rotorloop hil compare runs/paper runs/repeat --verify          are two runs the same to the bit\n"
      "  rotorloop hil compare runs/before runs/after --fail-on-diff    for scripts: 0 same, 8 different\n"
      "\nDifferences are paired by seed where both runs flew it, and marked when they leave their 99 % interval.\n"
      "\nExit codes: 0 compared, 2 bad arguments or no run folder, 5 nothing could be compared, 8 different (--fail-on-diff).");
  c->callback([o, &exit_code] {
    const auto comparison = hil::compare_runs(o->a, o->b, o->verify);
    fmt::print("{}", o->json ? hil::comparison_json_text(comparison) : hil::comparison_text(comparison));
    exit_code = o->fail_on_diff && comparison.differs ? to_int(ExitCode::differs) : 0;
  });
}

}  // namespace rotorloop::cli
