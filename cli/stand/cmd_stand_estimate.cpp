// `rotorloop stand estimate`: coefficients of runs on a thrust stand, each with its uncertainty budget.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>

#include "bench/stand/evaluate/estimate/credibility.hpp"
#include "bench/stand/evaluate/estimate/estimate_files.hpp"
#include "bench/stand/evaluate/report/estimate_document.hpp"
#include "bench/stand/evaluate/stand_comparison.hpp"
#include "bench/stand/evaluate/stand_diagnosis.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

struct StandEstimateArguments {
  std::vector<fs::path> runs, wind;
  fs::path mapping, uncertainty, motor_out, base, vehicle, vehicle_out, report;
  std::vector<double> window_rpm;
  std::optional<double> diameter_m, density_kg_m3, propeller_inertia_kg_m2;
  stand::EstimateOptions estimate;
  std::vector<std::string> accepted;
  bool json = false, force = false;
};

stand::RunOptions run_options(const StandEstimateArguments& o) {
  stand::RunOptions r;
  if (!o.mapping.empty()) r.mapping = stand::read_stand_mapping(o.mapping);
  r.diameter_m = o.diameter_m;
  r.air_density_kg_m3 = o.density_kg_m3;
  if (!o.uncertainty.empty()) {
    const TomlFile file = TomlFile::read(o.uncertainty);
    r.known = stand::stand_uncertainty(stand::read_uncertainties(file.root().table("uncertainty")), "stand file");
  }
  return r;
}

// A mount is named by the run, or else by its motor: a propeller on another motor was mounted anew.
void add_components(stand::EstimateDocument& d) {
  std::vector<stand::LabelledValue> c_t, c_q;
  for (const auto& f : d.files) {
    const stand::StandEstimate& e = f.estimate;
    if (f.verdict == "faulty" || e.facts.propeller.empty()) continue;
    const std::string mount = e.facts.mount.empty() ? e.facts.motor : e.facts.mount;
    if (e.thrust) c_t.push_back({e.facts.propeller, mount, e.thrust->value});
    if (e.torque) c_q.push_back({e.facts.propeller, mount, e.torque->value});
  }
  if (c_t.size() >= 3) d.c_t_components = stand::variance_components(c_t);
  if (c_q.size() >= 3) d.c_q_components = stand::variance_components(c_q);
}

// Files against each other, as `diagnose --stand` does it: one far from the others of its propeller has a fault.
void compare_files(stand::EstimateDocument& d, const std::vector<stand::StandRun>& runs) {
  stand::StandDiagnosis all;
  for (const auto& run : runs) {
    stand::StandFileDiagnosis f;
    if (!run.checked.record.points.empty()) f = stand::diagnose_stand(run.checked.record);
    f.name = run.name;
    f.faults = run.checked.faults;
    if (!f.faults.empty()) f.verdict = diagnose::DiagnosisVerdict::faulty;
    all.files.push_back(std::move(f));
  }
  stand::compare_stands(all);
  for (std::size_t i = 0; i < d.files.size(); ++i) {
    d.files[i].verdict = std::string(diagnose::name(all.files[i].verdict));
    for (std::size_t k = runs[i].checked.faults.size(); k < all.files[i].faults.size(); ++k) {
      const stand::StandFault& fault = all.files[i].faults[k];
      d.files[i].estimate.faults.push_back(fault.channel + " " + fault.what + (fault.likely.empty() ? "" : "; likely: " + fault.likely));
    }
  }
  d.remarks = all.remarks;
}

// Several runs are compared at speeds that all of them have; nothing where there are none.
std::optional<std::array<double, 2>> common_speeds(const std::vector<stand::StandRun>& runs) {
  std::array<double, 2> w{0.0, std::numeric_limits<double>::infinity()};
  for (const auto& run : runs) {
    const auto of_run = stand::speeds_of(run);
    if (of_run[1] > 0.0) {
      w[0] = std::max(w[0], of_run[0]);
      w[1] = std::min(w[1], of_run[1]);
    }
  }
  return w[0] < w[1] ? std::optional(w) : std::nullopt;
}

stand::AdvanceTorque advance_of(const StandEstimateArguments& o, const stand::StandRun& still, const stand::RunOptions& with) {
  if (o.runs.size() > 1)
    throw Error({"--wind", fmt::format("belongs to one run in still air, and {} are given", o.runs.size()), "", "give one RUN"});
  std::vector<stand::StandRun> in_wind;
  for (const fs::path& path : o.wind) in_wind.push_back(stand::read_stand_run(path, with));
  const auto found = stand::advance_torque(still, in_wind);
  if (!found)
    throw Error({"--wind", "fewer than six steps in wind have a like speed in still air", "another plan, or runs without an airspeed",
                 "run the same plan with stand run --airspeed M_S"},
                ExitCode::data_quality);
  return *found;
}

stand::EstimateDocument estimate_all(const StandEstimateArguments& o) {
  const stand::RunOptions with = run_options(o);
  stand::EstimateOptions options = o.estimate;
  options.accepted = {o.accepted.begin(), o.accepted.end()};
  if (o.window_rpm.size() == 2) options.window_rad_s = {{o.window_rpm[0] * kRad_s_per_rpm, o.window_rpm[1] * kRad_s_per_rpm}};
  stand::EstimateDocument d;
  d.version = std::string("rotorloop ") + kVersion + " (" + kGit + ")";
  d.command = "rotorloop stand estimate";
  d.reference_density_kg_m3 = options.reference_density_kg_m3;
  std::vector<stand::StandRun> runs;
  for (const fs::path& path : o.runs) {
    runs.push_back(stand::read_stand_run(path, with));
    std::error_code ec;
    const fs::path data = fs::is_directory(path, ec) ? path / stand::kSamplesFile : path;
    d.inputs.emplace_back(data.generic_string(), sha256_file(data));
  }
  if (!options.window_rad_s && runs.size() > 1) options.window_rad_s = common_speeds(runs);
  for (const stand::StandRun& run : runs) d.files.push_back({stand::estimate_stand(run, options), stand::advance_torque(run)});
  if (!o.wind.empty()) {
    stand::AdvanceTorque advance = advance_of(o, runs[0], with);
    if (const auto& torque = d.files[0].estimate.torque) {
      advance.c_q0_N_m_s2 = torque->value;
      advance.u0_N_m_s2 = torque->u;
    }
    d.files[0].advance = std::move(advance);
  }
  compare_files(d, runs);
  add_components(d);
  return d;
}

void write_files(const StandEstimateArguments& o, const stand::EstimateDocument& d) {
  if (!o.report.empty()) {
    write_text_file(o.report / "result.json", stand::estimate_json(d));
    write_text_file(o.report / "report.html", stand::estimate_page(d));
  }
  const std::string written_by = std::string("rotorloop stand estimate ") + kVersion +
                                 (o.accepted.empty() ? "" : fmt::format(" --accept {}", fmt::join(o.accepted, ",")));
  const stand::StandEstimate& e = d.files[0].estimate;
  if (!o.motor_out.empty()) write_text_file(o.motor_out, stand::motor_file_text(e, {o.base, o.propeller_inertia_kg_m2}, written_by));
  if (!o.vehicle_out.empty())
    host::write_vehicle(o.vehicle_out, stand::with_stand_values(host::read_vehicle(o.vehicle, host::builtin_effect_catalogue()), e,
                                                                written_by, d.files[0].advance ? &*d.files[0].advance : nullptr));
}

int stand_estimate(const StandEstimateArguments& o) {
  if (o.vehicle.empty() != o.vehicle_out.empty())
    throw Error({o.vehicle.empty() ? "--vehicle" : "--vehicle-out", "is missing", "",
                 "give both: the vehicle file to start from and the one to write"});
  if (o.runs.size() > 1 && (!o.motor_out.empty() || !o.vehicle_out.empty()))
    throw Error({"RUN", fmt::format("{} runs, and one motor or vehicle file", o.runs.size()), "",
                 "give one run, or leave out -o and --vehicle-out"});
  std::vector<OutputFile> files = report_files("--report", o.report);
  files.push_back({"-o", o.motor_out});
  files.push_back({"--vehicle-out", o.vehicle_out});
  check_outputs(files, o.force);
  const stand::EstimateDocument d = estimate_all(o);
  const std::string text = o.json ? stand::estimate_json(d) : stand::estimate_text(d);
  std::fwrite(text.data(), 1, text.size(), stdout);
  write_files(o, d);
  return stand::estimate_outcome(d).verdict == "refused" ? to_int(ExitCode::data_quality) : 0;
}

}  // namespace

void add_stand_estimate(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<StandEstimateArguments>();
  CLI::App* c = group.add_subcommand("estimate", "estimate c_t, c_q and motor constants from runs, each with its uncertainty budget");
  c->add_option("run", o->runs, "run folders or CSV files; exports of RCbenchmark and Tyto stands are read directly, others need -m")
      ->required();
  c->add_option("--wind", o->wind, "run folders with the same mount and plan in wind: the difference gives c_q(J) for --vehicle-out");
  c->add_option("-m,--mapping", o->mapping, "mapping file: the meaning of the columns in CSV files of other stands");
  c->add_option("-u,--uncertainty", o->uncertainty,
                "file with [uncertainty] of the stand (docs/files.md); missing entries get typical values");
  c->add_option("--rpm-window", o->window_rpm,
                "LOW,HIGH: speed range for the coefficients, RPM; default: the range that all runs have in common")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::PositiveNumber);
  c->add_option("--diameter", o->diameter_m, "propeller diameter, m")->check(CLI::Range(0.01, 10.0));
  c->add_option("--density", o->density_kg_m3, "air density during the run, kg/m³")->check(CLI::Range(0.5, 1.6));
  c->add_option("--reference-density", o->estimate.reference_density_kg_m3, "air density to which the coefficients are reduced, kg/m³")
      ->check(CLI::Range(0.5, 1.6))
      ->capture_default_str();
  c->add_option("-o,--out", o->motor_out, "motor file to write");
  c->add_option("--base", o->base, "motor file with values that a run cannot give (inductance, cogging)");
  c->add_option("--inductance", o->estimate.inductance_H, "inductance of one phase, H: corrects K_v and R for its voltage drop")
      ->check(CLI::Range(0.0, 1e-2));
  c->add_option("--propeller-inertia", o->propeller_inertia_kg_m2,
                "inertia of the propeller, kg m²: subtracted from the measured inertia in the motor file")
      ->check(CLI::NonNegativeNumber);
  c->add_option("--vehicle", o->vehicle, "vehicle file to start from");
  c->add_option("--vehicle-out", o->vehicle_out, "vehicle file to write, with c_t and c_q of the stand");
  c->add_option("--report", o->report, "folder for report.html and result.json");
  c->add_option("--draws", o->estimate.draws, "number of bootstrap samples over the steps")
      ->check(CLI::Range(100, 100000))
      ->capture_default_str();
  c->add_option("--seed", o->estimate.seed, "seed of the bootstrap")->capture_default_str();
  c->add_option(
       "--accept", o->accepted,
       "checks to override, on your responsibility: power_balance, figure_of_merit, uncertainty, speed_law, still_air; every file says so")
      ->delimiter(',')
      ->check(CLI::IsMember(std::vector<std::string>(stand::kCredibilityChecks.begin(), stand::kCredibilityChecks.end())));
  c->add_flag("--json", o->json, "result.json on stdout instead of tables");
  add_force(*c, o->force);
  c->footer(
      "Examples:\n"
      "  rotorloop stand estimate run_folder --report out -o motor.toml --base vehicles/motors/2306_2300kv.toml\n"
      "  rotorloop stand estimate log.csv --rpm-window 7000,11000 --diameter 0.127 --density 1.19\n"
      "  rotorloop stand estimate stand/*.csv -m vehicles/measured/stands/strawson_5inch.mapping.toml\n"
      "Exit codes: 0 estimated; 2 bad arguments or an unknown header; 5 no coefficient: every channel is faulty, or a file to write needs\n"
      "quantities that were not measured.");
  c->callback([o, &exit_code] { exit_code = stand_estimate(*o); });
}

}  // namespace rotorloop::cli
