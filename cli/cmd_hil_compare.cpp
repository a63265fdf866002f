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
  auto* c = hil.add_subcommand("compare", "compare two run folders: identical bytes, or figures that differ by more than their scatter");
  auto o = std::make_shared<Options>();
  c->add_option("A", o->a, "first run folder")->required();
  c->add_option("B", o->b, "second run folder")->required();
  c->add_flag("--fail-on-diff", o->fail_on_diff, "exit with 8 when a figure differs significantly or a flight ended differently");
  c->add_flag("--verify", o->verify, "compute the hashes of the logs again, do not take them from result.json");
  c->add_flag("--json", o->json, "print one JSON document");
  c->footer(
      "Examples:\n"
      "  rotorloop hil compare runs/paper runs/repeat --verify          are two runs identical bit for bit\n"
      "  rotorloop hil compare runs/before runs/after --fail-on-diff    for scripts: 0 same, 8 different\n"
      "\nFigures are compared in pairs of the same seed when both runs have common seeds. A difference is marked when its 99 % confidence\n"
      "interval does not contain zero.\n"
      "\nExit codes: 0 compared, 2 bad arguments or no run folder, 5 nothing could be compared, 8 different (--fail-on-diff).");
  c->callback([o, &exit_code] {
    const auto comparison = hil::compare_runs(o->a, o->b, o->verify);
    fmt::print("{}", o->json ? hil::comparison_json_text(comparison) : hil::comparison_text(comparison));
    exit_code = o->fail_on_diff && comparison.differs ? to_int(ExitCode::differs) : 0;
  });
}

}  // namespace rotorloop::cli
