// `rotorloop rotor validate`: the BEM rotor model against measured propellers of the data folder.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "bench/propeller/report/validation_output.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/refusal.hpp"
#include "cli/rotor/measured_data.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

struct RotorValidateArguments {
  std::vector<std::string> propellers;
  std::filesystem::path page;
  propeller::PropellerInputs inputs;
  bool json = false, force = false;
};

std::vector<propeller::CataloguedPropeller> chosen(const std::vector<std::string>& keys) {
  const auto& all = propeller::propeller_catalogue();
  if (keys.empty()) return all;
  std::vector<propeller::CataloguedPropeller> out;
  std::vector<std::string> known;
  for (const auto& e : all) known.push_back(e.key);
  for (const std::string& key : keys) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& e) { return e.key == key; });
    if (found == all.end())
      throw Error({"--propeller", fmt::format("\"{}\" is not a measured propeller", key), "", use_one_of(key, known)});
    out.push_back(*found);
  }
  return out;
}

int validate(RotorValidateArguments o) {
  check_outputs({{"-o", o.page}}, o.force);
  const auto entries = chosen(o.propellers);
  o.inputs.data = measured_data_folder();
  propeller::ValidationDocument d;
  d.version = std::string("rotorloop ") + kVersion + " (" + kGit + ")";
  d.stall_drag = o.inputs.stall_drag;
  d.command = "rotorloop rotor validate";
  for (const auto& key : o.propellers) d.command += " --propeller " + key;
  if (!o.inputs.section.empty()) d.command += " --section " + o.inputs.section;
  if (o.inputs.fit_rpm > 0.0) d.command += fmt::format(" --fit-rpm {:g}", o.inputs.fit_rpm);
  if (d.stall_drag != 0.0) d.command += fmt::format(" --stall-drag {:g}", d.stall_drag);
  // Everything is read before the first fit.
  std::vector<propeller::MeasuredPropeller> measured;
  for (const auto& e : entries) measured.push_back(propeller::read_measured_propeller(o.inputs, e));
  for (const auto& m : measured) d.results.push_back(propeller::validate(m));
  d.limits = propeller::judge(d.results);
  if (!o.page.empty()) write_text_file(o.page, propeller::validation_html(d));
  fmt::print("{}", o.json ? propeller::validation_json(d) : propeller::validation_text(d));
  if (!o.page.empty() && !o.json) fmt::print("\nwritten: {}\n", o.page.generic_string());
  return to_int(propeller::all_pass(d.limits) ? ExitCode::ok : ExitCode::verdict);
}

}  // namespace

void add_rotor_validate(CLI::App& rotor, int& exit_code) {
  auto o = std::make_shared<RotorValidateArguments>();
  CLI::App* c = rotor.add_subcommand(
      "validate", "compare the BEM rotor model with measured propellers: errors before and after a fit of four parameters");
  c->add_option("--propeller", o->propellers, "only this propeller, by the name of its folder in the data; may be repeated");
  c->add_option("-o,--out", o->page, "also write an HTML page with plots");
  add_force(*c, o->force);
  c->add_option("--section", o->inputs.section, "airfoil section to use for all propellers, in place of their own");
  c->add_option("--polars", o->inputs.shipped_polars, "folder with polar files NAME.toml, for sections that the data lack")
      ->capture_default_str();
  c->add_option("--fit-rpm", o->inputs.fit_rpm,
                "fit the sweep nearest to this rotor speed, RPM; default: the middle one of those that reach zero thrust")
      ->check(CLI::Range(100.0, 1e5));
  c->add_option("--stall-drag", o->inputs.stall_drag, "share of the drag that comes with delayed stall, 0 to 1; the included blade has 0")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  c->add_flag("--json", o->json, "print one JSON document instead of tables");
  c->footer(
      "Needs measured data: the environment variable ROTORLOOP_DATA is the folder that contains propellers/.\n"
      "Exit codes: 0 all limits met; 2 bad arguments or file; 5 data are missing; 6 a limit was missed.\n"
      "Examples:\n"
      "  rotorloop rotor validate -o rotors.html\n"
      "  rotorloop rotor validate --propeller da4002_5x3.75 --section clark_y\n"
      "  rotorloop rotor validate --json | jq .limits");
  c->callback([o, &exit_code] { exit_code = validate(*o); });
}

}  // namespace rotorloop::cli
