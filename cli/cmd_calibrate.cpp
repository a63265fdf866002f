// `rotorloop calibrate`: puts a plant into the virtual wind tunnel, fits the paper's load model to what the balance read,
// and writes a vehicle file. The plant goes to the tunnel, the vehicle to the fit; between them lies only the load table.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "bench/calibrate/flown.hpp"
#include "bench/calibrate/programme.hpp"
#include "host/base/error.hpp"
#include "host/base/sha256.hpp"
#include "cli/commands.hpp"
#include "host/control/trajectory_file.hpp"
#include "host/vehicle/thrust.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

struct CalibrateArguments {
  std::filesystem::path plant, vehicle, out, table;
  std::vector<std::filesystem::path> trajectories, flown;
  std::string variant;
  double period_s = 0.05;
};

void row(const char* name, const calibrate::FittedValue& v, const char* unit) {
  fmt::print("{:<8} {:>12.4e} ± {:.1e} {}\n", name, v.value, v.u, unit);
}

template <class Fit>
void coefficient_rows(const Fit& fit) {
  row("k1", fit.k1_N_s2, "N s²");
  row("k2", fit.k2_N_s2_m, "N s²/m");
  row("c_q", fit.c_q_N_m_s2, "N m s²");
  row("c_dh", fit.c_dh_s_m, "s/m");
  row("c_dxy", fit.c_dxy_N_s2_m2, "N s²/m²");
  row("c_dz", fit.c_dz_N_s2_m2, "N s²/m²");
}

std::string written_by() { return std::string("rotorloop calibrate ") + kVersion; }

// Points made for the coefficients, and the states of planned flights: what a builder with a wind tunnel would do.
host::VehicleFile from_programme(const CalibrateArguments& o, const calibrate::Tunnel& tunnel, const host::VehicleFile& base) {
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
  coefficient_rows(fit);
  fmt::print("misfit (rms): thrust {:.3f} N, in-plane force {:.3f} N, yaw torque {:.2e} N m\n", fit.thrust_rms_N, fit.in_plane_rms_N,
             fit.yaw_torque_rms_N_m);
  return calibrate::calibrated(base, fit, written_by(), inputs);
}

// The states that simulated flights really met: the least misfit that eq. (1)-(5) can have there. A yardstick; no real vehicle has it.
host::VehicleFile from_flown(const CalibrateArguments& o, const calibrate::Tunnel& tunnel, const host::VehicleFile& base) {
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
  coefficient_rows(fit);
  row("com x", fit.com_x_m, "m");
  row("com y", fit.com_y_m, "m");
  fmt::print("misfit (rms): in-plane force {:.3f} N, thrust {:.3f} N, roll and pitch torque {:.2e} N m, yaw torque {:.2e} N m\n",
             fit.force_xy_rms_N, fit.force_z_rms_N, fit.roll_pitch_rms_N_m, fit.yaw_rms_N_m);
  return calibrate::calibrated(base, fit, written_by(), inputs);
}

int calibrate(const CalibrateArguments& o) {
  if (o.trajectories.empty() == o.flown.empty())
    throw Error({"rotorloop calibrate", o.flown.empty() ? "no states to measure" : "--trajectory and --flown are given together", "",
                 "give either --trajectory (planned flights) or --flown (run folders of simulated flights)"});
  const sim::PlantFile plant = sim::read_plant(o.plant);
  const auto rotors = sim::read_rotors(plant);
  const host::VehicleFile base = host::read_vehicle(o.vehicle, host::builtin_effect_catalogue());
  const calibrate::Tunnel tunnel(plant, rotors);
  const host::VehicleFile result = o.flown.empty() ? from_programme(o, tunnel, base) : from_flown(o, tunnel, base);
  host::write_vehicle(o.out, result);
  fmt::print("static c_t {:.4e} N s², hover at {:.0f} RPM\nwritten: {}\n", result.static_thrust.front().c_t_N_s2,
             host::hover_omega_rad_s(host::to_model(result)) * 60.0 / (2.0 * 3.14159265358979), o.out.generic_string());
  return 0;
}

}  // namespace

void add_calibrate(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<CalibrateArguments>();
  CLI::App* c = app.add_subcommand("calibrate", "fit the paper's load model to a plant in the virtual wind tunnel; writes a vehicle file");
  c->add_option("--plant", o->plant, "plant file: what stands in the tunnel")->required();
  c->add_option("--vehicle", o->vehicle, "vehicle file with mass and geometry; its thrust, torque and drag are replaced")->required();
  c->add_option("--trajectory", o->trajectories, "planned flights whose states are measured");
  c->add_option("--flown", o->flown,
                "instead: run folders of simulated flights; their true states are measured, and the fit is the best over these");
  c->add_option("--variant", o->variant, "of --flown: only flights of this controller");
  c->add_option("-o,--out", o->out, "vehicle file to write")->required();
  c->add_option("--table", o->table, "also write the load table (CSV)");
  c->add_option("--period", o->period_s, "seconds between two states of a planned flight")
      ->check(CLI::Range(0.005, 1.0))
      ->capture_default_str();
  c->footer(
      "Example:\n  rotorloop calibrate --plant vehicles/reference_plant.toml --vehicle vehicles/reference_cad.toml\n"
      "    --trajectory scenarios/trajectories/horizontal_8p5.toml -o vehicles/calibrated.toml\n"
      "  rotorloop calibrate --plant vehicles/reference_plant.toml --vehicle vehicles/reference_cad.toml\n"
      "    --flown runs/paper --variant pd_ff_thrust_drag -o best.toml");
  c->callback([o, &exit_code] { exit_code = calibrate(*o); });
}

}  // namespace rotorloop::cli
