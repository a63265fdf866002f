// `rotorloop calibrate`: puts a plant into the virtual wind tunnel, fits the paper's load model to what the balance read,
// and writes a vehicle file. The plant goes to the tunnel, the vehicle to the fit; between them lies only the load table.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/hil/calibrate/flown.hpp"
#include "bench/hil/calibrate/programme.hpp"
#include "bench/hil/flight/scenario.hpp"
#include "bench/render/digits.hpp"
#include "bench/render/document.hpp"
#include "bench/render/page.hpp"
#include "bench/sysid/identify/identification_run.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/refused_result.hpp"
#include "cli/fit_options.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "host/control/trajectory_file.hpp"
#include "host/vehicle/thrust.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

struct CalibrateArguments {
  std::filesystem::path plant, vehicle, out, table, report;
  std::vector<std::filesystem::path> trajectories, flown;
  std::string variant;
  double period_s = 0.05;
  bool force = false;
};

struct Coefficient {
  const char* name;
  calibrate::FittedValue value;
  const char* unit;
};

template <class Fit>
std::vector<Coefficient> coefficients(const Fit& fit) {
  return {{"k1", fit.k1_N_s2, "N s²"},   {"k2", fit.k2_N_s2_m, "N s²/m"},         {"c_q", fit.c_q_N_m_s2, "N m s²"},
          {"c_dh", fit.c_dh_s_m, "s/m"}, {"c_dxy", fit.c_dxy_N_s2_m2, "N s²/m²"}, {"c_dz", fit.c_dz_N_s2_m2, "N s²/m²"}};
}

// What a calibration came to.
struct Calibrated {
  host::VehicleFile vehicle;
  std::vector<Coefficient> coefficients;
  std::string misfit;               // a sentence
  std::vector<std::string> inputs;  // "sha256:…"
};

std::string written_by() { return std::string("rotorloop calibrate ") + kVersion; }

// Points made for the coefficients, and the states of planned flights: what a builder with a wind tunnel would do.
Calibrated from_programme(const CalibrateArguments& o, const calibrate::Tunnel& tunnel, const host::VehicleFile& base) {
  std::vector<calibrate::FlightState> planned;
  std::vector<std::string> inputs{"sha256:" + sha256_file(o.vehicle)};
  for (const auto& path : o.trajectories) {
    const auto states = calibrate::planned_states(host::read_trajectory(path).trajectory, base.mass_kg.value, o.period_s);
    planned.insert(planned.end(), states.begin(), states.end());
    inputs.push_back("sha256:" + sha256_file(path));
  }
  const auto points = calibrate::run_programme(tunnel, planned, base.mass_kg.value * kGravity_m_s2);
  if (!o.table.empty()) calibrate::write_load_points(o.table, points);
  const calibrate::LoadFit fit = calibrate::fit_loads(points, host::to_model(base));
  fmt::print("{} load points: {} powered, {} of these axial\n", points.size(), fit.powered_points, fit.axial_points);
  return {calibrate::calibrated(base, fit, written_by(), inputs), coefficients(fit),
          fmt::format("misfit (rms): thrust {:.3f} N, in-plane force {:.3f} N, yaw torque {:.2e} N m", fit.thrust_rms_N, fit.in_plane_rms_N,
                      fit.yaw_torque_rms_N_m),
          inputs};
}

// The states that simulated flights really met: the least misfit that eq. (1)-(5) can have there. A yardstick; no real vehicle has it.
Calibrated from_flown(const CalibrateArguments& o, const calibrate::Tunnel& tunnel, const host::VehicleFile& base) {
  std::vector<calibrate::LoadPoint> points;
  std::vector<std::string> inputs{"sha256:" + sha256_file(o.vehicle)};
  std::size_t logs = 0;
  for (const auto& folder : o.flown)
    for (const auto& log : calibrate::truth_logs(folder, o.variant)) {
      for (const auto& s : calibrate::flown_states(log, o.period_s)) points.push_back(tunnel.measure(s.v_B_m_s, s.omega_rad_s));
      inputs.push_back("sha256:" + sha256_file(log));
      ++logs;
    }
  if (!o.table.empty()) calibrate::write_load_points(o.table, points);
  const calibrate::FlownFit fit = calibrate::fit_flown(points, host::to_model(base));
  fmt::print("{} states of {} flights\n", fit.states, logs);
  std::vector<Coefficient> values = coefficients(fit);
  values.insert(values.end(), {{"com_x", fit.com_x_m, "m"}, {"com_y", fit.com_y_m, "m"}});
  return {calibrate::calibrated(base, fit, written_by(), inputs), values,
          fmt::format("misfit (rms): in-plane force {:.3f} N, thrust {:.3f} N, roll and pitch torque {:.2e} N m, yaw torque {:.2e} N m",
                      fit.force_xy_rms_N, fit.force_z_rms_N, fit.roll_pitch_rms_N_m, fit.yaw_rms_N_m),
          inputs};
}

// Beside a rounding error of the arithmetic there is no u: plant and model have the same law for this term, so that the tunnel gives it
// back.
constexpr double kRounding = 1e-9;  // of the value
std::string u_text(const Coefficient& k) {
  if (k.value.u <= kRounding * std::abs(k.value.value)) return "exact by construction: the plant's own law";
  return "± " + render::measured(k.value.value, k.value.u).u;
}

void publish(const CalibrateArguments& o, const Calibrated& c, const render::Outcome& outcome, const RunClock& clock) {
  render::Table table{{render::left("coefficient"), {"value"}, {"u"}, render::left("unit")}};
  for (const Coefficient& k : c.coefficients) {
    const std::string u = u_text(k);
    const bool exact = !u.starts_with("±");
    const std::string value = exact ? fmt::format("{:.6g}", k.value.value) : render::measured(k.value.value, k.value.u).value;
    fmt::print("{:<8} {:>12} {} {}\n", k.name, value, exact ? k.unit : u, exact ? "(" + u + ")" : k.unit);
    table.rows.push_back({{k.name, render::Cell(value, "big"), u, k.unit}});
  }
  fmt::print("{}\n{}", c.misfit, render::outcome_text(outcome));
  if (o.report.empty()) return;
  nlohmann::ordered_json j{{"format", 1}, {"command", "calibrate"}, {"version", kVersion}, {"git", kGit}, {"inputs", c.inputs}};
  j["started_utc"] = clock.started_utc();
  j["wall_s"] = clock.elapsed_s();
  j["verdict"] = outcome.verdict;
  j["limits"] = nlohmann::ordered_json::array();
  for (const Coefficient& k : c.coefficients) j["figures"][k.name] = {{"value", k.value.value}, {"u", k.value.u}, {"unit", k.unit}};
  j["warnings"] = nlohmann::ordered_json::array();
  j["errors"] = outcome.errors;
  j["next"] = outcome.next;
  write_text_file(o.report / "result.json", j.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  write_text_file(o.report / "report.html",
                  render::page_begin("Load model of " + c.vehicle.name, "calibrated in the virtual wind tunnel", "calibration") +
                      render::banner_html(outcome) +
                      render::page_html({{"Coefficients", "coefficients", {table, render::Paragraph{c.misfit}}}}) + render::page_end());
}

int calibrate_plant(const CalibrateArguments& o, const RunClock& clock, bool& printed) {
  const sim::PlantFile plant = sim::read_plant(o.plant);
  const auto rotors = sim::read_rotors(plant);
  const host::VehicleFile base = host::read_vehicle(o.vehicle, host::builtin_effect_catalogue());
  const calibrate::Tunnel tunnel(plant, rotors);
  const Calibrated c = o.flown.empty() ? from_programme(o, tunnel, base) : from_flown(o, tunnel, base);
  const std::optional<Error> problem = identify::not_credible(o.out, c.vehicle, host::builtin_effect_catalogue());
  publish(o, c,
          problem ? refused_outcome(*problem)
                  : render::Outcome{"pass",
                                    render::Standing::good,
                                    "The load model fits what the balance read.",
                                    {},
                                    "fly with it: rotorloop hil SCENARIO --vehicle " + o.out.filename().generic_string()},
          clock);
  printed = true;
  if (problem) throw *problem;
  write_text_file(o.out, host::vehicle_text(c.vehicle));
  fmt::print("static c_t {:.4e} N s², hover at {:.0f} RPM\nwritten: {}\n", c.vehicle.static_thrust.front().c_t_N_s2,
             host::hover_omega_rad_s(host::to_model(c.vehicle)) * 60.0 / (2.0 * 3.14159265358979), o.out.generic_string());
  return 0;
}

int calibrate(const CalibrateArguments& o) {
  if (o.trajectories.empty() == o.flown.empty())
    throw Error({"", o.flown.empty() ? "no states to measure" : "--trajectory and --flown are given together", "",
                 "give either --trajectory (planned flights) or --flown (run folders of simulated flights)"});
  if (o.flown.empty() && !o.variant.empty())
    throw Error({"--variant", "does nothing without --flown", "", "leave it out, or name run folders with --flown"});
  if (!o.variant.empty()) (void)hil::parse_variants(o.variant);
  std::vector<OutputFile> files = report_files("--report", o.report);
  files.insert(files.end(), {{"-o", o.out}, {"--table", o.table}});
  check_outputs(files, o.force);
  const RunClock clock;
  bool printed = false;
  try {
    return calibrate_plant(o, clock, printed);
  } catch (const Error& e) {
    if (!printed && e.exit_code() == ExitCode::data_quality)
      report_unfinished({.command = "calibrate", .report = o.report}, refused_outcome(e), clock);
    throw;
  }
}

}  // namespace

void add_calibrate(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<CalibrateArguments>();
  CLI::App* c = app.add_subcommand("calibrate", "fit the paper's load model to a plant in the virtual wind tunnel; writes a vehicle file");
  c->add_option("--plant", o->plant, "plant file: the simulated vehicle in the wind tunnel")->required();
  c->add_option("--vehicle", o->vehicle, "vehicle file with mass and geometry; its thrust, torque and drag are replaced")->required();
  c->add_option("--trajectory", o->trajectories, "trajectory files: loads are measured at the states of these planned flights");
  c->add_option("--flown", o->flown, "in place of --trajectory: run folders of simulated flights; loads are measured at their true states");
  c->add_option("--variant", o->variant, "with --flown: only the flights of this controller");
  c->add_option("-o,--out", o->out, "vehicle file to write")->required();
  c->add_option("--table", o->table, "also write the load table (CSV)");
  c->add_option("--report", o->report, "folder for report.html and result.json");
  add_force(*c, o->force);
  c->add_option("--period", o->period_s, "time between two states of a planned flight, s")
      ->check(CLI::Range(0.005, 1.0))
      ->capture_default_str();
  c->footer(
      "Example:\n  rotorloop calibrate --plant vehicles/reference_plant.toml --vehicle vehicles/reference_cad.toml\n"
      "    --trajectory scenarios/trajectories/horizontal_8p5.toml -o vehicles/calibrated.toml\n"
      "  rotorloop calibrate --plant vehicles/reference_plant.toml --vehicle vehicles/reference_cad.toml\n"
      "    --flown runs/paper --variant pd_ff_thrust_drag -o best.toml\n"
      "Exit codes: 0 written; 2 bad arguments or input file; 3 disk; 5 refused: the states do not determine a coefficient, or the fitted\n"
      "vehicle is not credible.");
  c->callback([o, &exit_code] { exit_code = calibrate(*o); });
}

}  // namespace rotorloop::cli
