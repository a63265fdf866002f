// `rotorloop stand compare`: the thrust coefficient of a stand against that of flights, at one speed and one density.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "bench/stand/evaluate/report/comparison_document.hpp"
#include "bench/sysid/log/read_flight.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/shipped_mapping.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kTypicalRotorScatter = 0.02;  // of one rotor: 2.3 to 3.1 % between motors of one propeller type on one public stand
constexpr double kWindowShare = 0.15;          // of the hover speed, to both sides

struct StandCompareArguments {
  std::vector<fs::path> runs, flights;
  fs::path mapping, flight_mapping, vehicle, uncertainty, report;
  std::vector<double> stand_c_t;
  std::optional<double> density_kg_m3, diameter_m, correlation, rotor_scatter;
  double margin_percent = 3.0, arm_width_m = 0.0, mount_rotors = 1.0;
  int draws = 1000;
  std::uint64_t seed = 1;
  bool arm_behind = false, same_speed_sensor = false, fail_on_diff = false, json = false, force = false;
};

struct StandSide {
  stand::Compared value;
  std::string note;
  double exponent = 2.0, exponent_u = 0.0, zero_share = 0.0, density_u = 3e-3;
};

// Runs at the flight's hover speed; several runs by their mean, their scatter counted with it.
StandSide from_runs(const StandCompareArguments& o, double hover_rad_s, double density_kg_m3, std::vector<std::string>& remarks) {
  stand::RunOptions with;
  if (!o.mapping.empty()) with.mapping = stand::read_stand_mapping(o.mapping);
  with.diameter_m = o.diameter_m;
  with.air_density_kg_m3 = o.density_kg_m3;
  if (!o.uncertainty.empty())
    with.known =
        stand::stand_uncertainty(stand::read_uncertainties(TomlFile::read(o.uncertainty).root().table("uncertainty")), "stand file");
  stand::EstimateOptions options;
  options.window_rad_s = {{(1.0 - kWindowShare) * hover_rad_s, (1.0 + kWindowShare) * hover_rad_s}};
  options.reference_density_kg_m3 = density_kg_m3;
  options.draws = o.draws;
  options.seed = o.seed;
  StandSide side;
  double logs = 0.0, squares = 0.0, n = 0.0;
  for (const fs::path& path : o.runs) {
    const stand::StandEstimate e = stand::estimate_stand(stand::read_stand_run(path, with), options);
    for (const auto& f : e.faults) remarks.push_back(e.name + ": " + f);
    if (!e.thrust) {
      remarks.push_back(e.name + ": left out, as its thrust cannot be used");
      continue;
    }
    if (!(e.reduced_c_t > 0.0))
      throw Error(
          {"--density", "the air density of " + e.name + " is not known, and the comparison needs it", "", "give --density, in kg/m³"});
    const double l = std::log(e.reduced_c_t);
    logs += l;
    squares += l * l;
    n += 1.0;
    side.value.u = e.thrust->u / e.thrust->value;
    side.value.degrees = e.thrust->degrees;
    side.exponent = e.thrust->exponent;
    side.exponent_u = e.thrust->exponent_u;
    side.note = fmt::format("{} at the hover speed; {}", e.name,
                            e.thrust->square_fails ? fmt::format("thrust goes with ω^{:.2f} there", e.thrust->exponent) : "c ω² holds");
    for (const auto& b : e.thrust->budget)
      if (b.name == "zero" || b.name == "hysteresis") side.zero_share = std::hypot(side.zero_share, b.u);
  }
  if (n == 0.0)
    throw Error({"RUN", "no run has a thrust that can be used", "faulty channels, named above", "correct them and measure again"},
                ExitCode::data_quality);
  side.value.name = "stand";
  side.value.value = std::exp(logs / n);
  const double scatter = n > 1.0 ? std::sqrt(std::max(0.0, (squares - logs * logs / n) / (n - 1.0) / n)) : 0.0;
  if (n > 1.0) side.note = fmt::format("mean of {:.0f} runs at the hover speed, their scatter {:.2f} % of the mean", n, 100.0 * scatter);
  side.value.u = side.value.value * std::hypot(side.value.u, scatter);
  return side;
}

StandSide stand_side(const StandCompareArguments& o, const host::VehicleFile& v, double hover_rad_s, std::vector<std::string>& remarks) {
  if (!o.runs.empty()) return from_runs(o, hover_rad_s, v.air_density_kg_m3, remarks);
  StandSide side;
  side.value.name = "stand";
  if (!o.stand_c_t.empty()) {
    const double scale = o.density_kg_m3 ? v.air_density_kg_m3 / *o.density_kg_m3 : 1.0;
    side.value.value = o.stand_c_t[0] * scale;
    side.value.u = o.stand_c_t[1] * scale;
    side.note = o.density_kg_m3 ? "as given" : "as given; density taken as the vehicle file's (--density)";
    return side;
  }
  const host::StaticThrust* s = v.static_thrust_of(host::Origin::stand);
  if (!s)
    throw Error(
        {"RUN", "no stand: no run, no --stand-c-t, and the vehicle file has no [[static_thrust]] of origin stand", "", "give one of them"});
  const double scale = v.air_density_kg_m3 / s->air_density_kg_m3;
  side.value.value = s->c_t_N_s2 * scale;
  side.value.u = s->u_N_s2 * scale;
  side.note = fmt::format("[[static_thrust]] of the vehicle file, {:.0f} to {:.0f} RPM", s->rpm_window[0], s->rpm_window[1]);
  return side;
}

std::optional<stand::FlightCoefficient> from_hover(const StandCompareArguments& o, const host::VehicleFile& v) {
  if (o.flights.empty()) return std::nullopt;
  std::optional<log::LogMapping> mapping;
  if (const fs::path path = mapping_or_shipped(o.flight_mapping, o.flights); !path.empty()) mapping = log::read_log_mapping(path);
  std::vector<log::FlightRecord> flights;
  for (const fs::path& f : o.flights) flights.push_back(log::read_flight(f, mapping ? &*mapping : nullptr));
  return stand::hover_coefficient(flights,
                                  {.mass_kg = v.mass_kg.value, .mass_u_kg = v.mass_kg.u, .air_density_kg_m3 = v.air_density_kg_m3});
}

stand::ComparisonDocument compare(const StandCompareArguments& o) {
  const host::VehicleFile v = host::read_vehicle(o.vehicle, host::builtin_effect_catalogue());
  stand::ComparisonDocument d;
  d.version = std::string("rotorloop ") + kVersion + " (" + kGit + ")";
  d.margin = 0.01 * o.margin_percent;

  d.air_density_kg_m3 = v.air_density_kg_m3;
  const stand::FlightCoefficient flight = stand::flight_coefficient(v, o.correlation);
  const auto hover = from_hover(o, v);
  if (!o.flights.empty() && !hover)
    d.remarks.push_back("no hover in the flights: fewer than five windows of a second in which the vehicle stays where it is");
  d.omega_rad_s = hover ? hover->omega_rad_s : flight.omega_rad_s;
  StandSide side = stand_side(o, v, d.omega_rad_s, d.remarks);
  // One rotor stands for four that differ: of the stand's rotor against the mean of the vehicle's.
  const double scatter = o.rotor_scatter.value_or(kTypicalRotorScatter) * std::sqrt(1.0 / o.mount_rotors + 0.25);
  side.value.u = std::hypot(side.value.u, scatter * side.value.value);
  d.remarks.push_back(fmt::format(
      "u of the stand holds {:.2f} % for rotor to rotor ({}: {:.2g} % of one rotor; {:.0f} on the stand, 4 in flight)", 100.0 * scatter,
      o.rotor_scatter ? "as given" : "typical", 100.0 * o.rotor_scatter.value_or(kTypicalRotorScatter), o.mount_rotors));
  const double shared = o.same_speed_sensor ? 2.0 * stand::StandUncertainty{}.rotor_speed.u : 0.0, mass = v.mass_kg.u / v.mass_kg.value;
  if (shared > 0.0) d.remarks.push_back("the same speed sensor on stand and vehicle: its scale cancels");
  d.values = {side.value, {"flight, k1 and k2", flight.c_t_N_s2, flight.u_N_s2}};
  d.notes = {side.note, flight.note};
  d.pairs.push_back(stand::compare_pair(d.values[0], d.values[1], d.margin, shared));
  if (hover) {
    d.values.push_back({"flight, hover", hover->c_t_N_s2, hover->u_N_s2});
    d.notes.push_back(hover->note);
    d.pairs.push_back(stand::compare_pair(d.values[0], d.values[2], d.margin, shared));
    d.pairs.push_back(stand::compare_pair(d.values[1], d.values[2], d.margin, std::min(mass, flight.u_N_s2 / flight.c_t_N_s2)));
    d.remarks.push_back("k1, k2 and hover share the mass, which cancels between them");
  }
  d.causes = stand::attribution({.density_u = side.density_u,
                                 .mass_u = mass,
                                 .exponent = side.exponent,
                                 .exponent_u = side.exponent_u,
                                 .stand_centre_rad_s = o.runs.empty() ? 0.0 : d.omega_rad_s,
                                 .hover_rad_s = d.omega_rad_s,
                                 .arm_width_m = o.arm_width_m,
                                 .rotor_radius_m = v.radius_m,
                                 .rotor_scatter = o.rotor_scatter.value_or(kTypicalRotorScatter),
                                 .zero_share = side.zero_share,
                                 .abab = o.arm_behind},
                                d.pairs[0].d);
  return d;
}

int stand_compare(const StandCompareArguments& o) {
  check_outputs(report_files("--report", o.report), o.force);
  const stand::ComparisonDocument d = compare(o);
  const std::string text = o.json ? stand::comparison_json(d) : stand::comparison_text(d);
  std::fwrite(text.data(), 1, text.size(), stdout);
  if (!o.report.empty()) {
    write_text_file(o.report / "result.json", stand::comparison_json(d));
    write_text_file(o.report / "report.html", stand::comparison_page(d));
  }
  return o.fail_on_diff && stand::any_differs(d) ? to_int(ExitCode::differs) : 0;
}

}  // namespace

void add_stand_compare(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<StandCompareArguments>();
  CLI::App* c = group.add_subcommand(
      "compare", "compare the static thrust of a stand with k1, k2 and hover of flights: different, equivalent, or not decided");
  c->add_option("run", o->runs, "runs on the stand, as for stand estimate; default: --stand-c-t, or the entry in the vehicle file");
  c->add_option("--vehicle", o->vehicle, "vehicle file from identify: k1, k2, their covariance, mass, air density")->required();
  c->add_option("-m,--mapping", o->mapping, "mapping file: the meaning of the columns in the runs");
  c->add_option("-u,--uncertainty", o->uncertainty, "file with [uncertainty] of the stand (docs/files.md)");
  c->add_option("--stand-c-t", o->stand_c_t, "c_t of the stand and its standard uncertainty, N s²: C_T,U")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::PositiveNumber);
  c->add_option("--hover", o->flights, "flights with hover, which give c_t as m g / Σ ω²");
  c->add_option("--hover-mapping", o->flight_mapping, "mapping file of these flights");
  c->add_option("--density", o->density_kg_m3, "air density at the stand, kg/m³")->check(CLI::Range(0.5, 1.6));
  c->add_option("--diameter", o->diameter_m, "propeller diameter, m")->check(CLI::Range(0.01, 10.0));
  c->add_option("--correlation", o->correlation, "correlation of k1 and k2, in place of the covariance in the file")
      ->check(CLI::Range(-1.0, 1.0));
  c->add_option("--margin", o->margin_percent, "margin of equivalence, %")->check(CLI::Range(0.01, 50.0))->capture_default_str();
  c->add_option("--rotor-scatter", o->rotor_scatter,
                "relative standard deviation of c_t from rotor to rotor; default: 0.02, a typical value")
      ->check(CLI::Range(0.0, 0.5));
  c->add_option("--rotors-on-stand", o->mount_rotors, "number of rotors on the stand: 4 for a whole quadrotor on a load cell")
      ->check(CLI::Range(1.0, 100.0))
      ->capture_default_str();
  c->add_option("--arm-width", o->arm_width_m, "width of the arm below the rotor in flight, m: predicts the download on the arm")
      ->check(CLI::Range(0.0, 1.0));
  c->add_flag("--arm-behind", o->arm_behind, "the arm was behind the propeller on the stand too");
  c->add_flag("--same-speed-sensor", o->same_speed_sensor, "stand and vehicle read speed from the same ESC");
  c->add_option("--draws", o->draws, "number of bootstrap samples over the steps")->check(CLI::Range(100, 100000))->capture_default_str();
  c->add_option("--seed", o->seed, "seed of the bootstrap")->capture_default_str();
  c->add_flag("--fail-on-diff", o->fail_on_diff, "exit code 8 when a pair is different");
  c->add_option("--report", o->report, "folder for report.html and result.json");
  c->add_flag("--json", o->json, "result.json on stdout instead of tables");
  add_force(*c, o->force);
  c->footer(
      "Example: is the difference of 8 % in the paper significant? Its table does not give the correlation of k1 and k2.\n"
      "  rotorloop stand compare --vehicle vehicles/paper.toml --rotor-scatter 0 --correlation -0.9\n"
      "Example: three runs, the identified vehicle, and its hover flights.\n"
      "  rotorloop stand compare run1 run2 run3 --vehicle identified.toml --hover flight1 flight2 --fail-on-diff\n"
      "Exit codes: 0 compared; 2 bad arguments or input file; 5 no run can be used; 8 different, with --fail-on-diff.");
  c->callback([o, &exit_code] { exit_code = stand_compare(*o); });
}

}  // namespace rotorloop::cli
