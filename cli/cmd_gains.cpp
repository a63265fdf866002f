// `rotorloop gains`: gains of the controller for a vehicle, with the margins that they keep.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>

#include "bench/hil/calibrate/gains_design.hpp"
#include "bench/hil/flight/vehicle_figures.hpp"
#include "cli/commands.hpp"
#include "cli/ending/outputs.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "host/vehicle/effect_catalogue.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::cli {
namespace {

constexpr double kOneRpm_rad_s = std::numbers::pi / 30.0;
// A small step of speed, over which the lag is taken; and the lag of the speed loop itself where current does not limit it.
constexpr double kSmallStep = 0.1, kSpeedLoop_s = 0.005;
constexpr double kOfTopSpeed = 0.95;  // the sagging battery of a full-thrust climb

struct GainsArguments {
  std::filesystem::path vehicle, plant, out;
  std::optional<double> lag_ms, max_rpm;
  double delay_ms = 3.0;
  bool force = false;
};

calibrate::ActuatorDynamics actuators(const GainsArguments& o) {
  calibrate::ActuatorDynamics a{.delay_s = 1e-3 * o.delay_ms};
  if (!o.plant.empty()) {
    const sim::PlantFile plant = sim::read_plant(o.plant);
    const hil::VehicleFigures f = hil::vehicle_figures(plant, sim::read_rotors(plant));
    a.lag_s = std::max(kSpeedLoop_s, kSmallStep * f.hover_rpm * kOneRpm_rad_s / f.hover_slew_rad_s2);
    a.omega_max_rad_s = kOfTopSpeed * f.top_rpm * kOneRpm_rad_s;
  } else if (!o.lag_ms || !o.max_rpm) {
    throw Error({"", "neither --plant nor both of --motor-lag and --max-rpm", "the vehicle file knows no motor",
                 "give the plant file, or the lag that a thrust stand shows (`rotorloop stand estimate`) and the highest RPM"});
  }
  if (o.lag_ms) a.lag_s = 1e-3 * *o.lag_ms;
  if (o.max_rpm) a.omega_max_rad_s = *o.max_rpm * kOneRpm_rad_s;
  return a;
}

void print(const char* name, const calibrate::DesignedLoop& l) {
  fmt::print(stderr, "{:<12} {:>6.1f} rad/s   damping {:.1f}   phase {:>3.0f}°   gain factor {:>5.1f}   held by {}\n", name,
             l.gains.frequency_rad_s, l.gains.damping, l.margins.phase_deg, l.margins.gain_factor, l.limited_by);
}

int design(const GainsArguments& o) {
  check_outputs({{"-o", o.out}}, o.force);
  const host::VehicleFile file = host::read_vehicle(o.vehicle, host::builtin_effect_catalogue());
  const calibrate::ActuatorDynamics a = actuators(o);
  const calibrate::GainsDesign d = calibrate::design_gains(host::to_model(file), a);
  const std::string text = calibrate::gains_text(d, file.name, a);
  if (o.out.empty()) {
    fmt::print("{}", text);
  } else {
    write_text_file(o.out, text);
  }
  fmt::print(stderr, "motor lag {:.1f} ms, delay {:.1f} ms; hover {:.0f} RPM, up to {:.0f} RPM, thrust-to-weight {:.2f} there\n",
             1e3 * a.lag_s, 1e3 * a.delay_s, d.hover_rad_s / kOneRpm_rad_s, a.omega_max_rad_s / kOneRpm_rad_s, d.thrust_to_weight);
  print("horizontal", d.horizontal);
  print("vertical", d.vertical);
  print("roll, pitch", d.roll_pitch);
  print("yaw", d.yaw);
  return 0;
}

}  // namespace

void add_gains(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<GainsArguments>();
  CLI::App* c = app.add_subcommand("gains", "compute controller gains for a vehicle, with their stability margins");
  c->add_option("--vehicle", o->vehicle, "vehicle file: mass, inertia, arms, thrust and torque model")
      ->required()
      ->check(CLI::ExistingFile);
  c->add_option("--plant", o->plant, "plant file: motor lag and highest speed from its motor, battery and ESC limits")
      ->check(CLI::ExistingFile);
  c->add_option("--motor-lag", o->lag_ms, "time constant of a small step of rotor speed, ms; overrides the plant's")
      ->check(CLI::Range(1.0, 300.0));
  c->add_option("--max-rpm", o->max_rpm, "highest rotor speed that may be commanded, RPM; overrides the plant's")
      ->check(CLI::Range(100.0, 100000.0));
  c->add_option("--delay", o->delay_ms, "delay from the measured body rate to the set-point at the ESC, ms")
      ->check(CLI::Range(0.5, 50.0))
      ->capture_default_str();
  c->add_option("-o,--out", o->out, "file to write; without it the gains go to standard output");
  add_force(*c, o->force);
  c->footer(
      "The attitude loops are as fast as three limits allow: a phase margin of 45°, a gain margin of a factor of 3, and the torque "
      "available\n"
      "in hover. The position loops are 5.5 times slower.\n"
      "Examples:\n  rotorloop gains --vehicle vehicles/quad_7in/calibrated.toml --plant vehicles/quad_7in/plant.toml -o gains.toml\n"
      "  rotorloop gains --vehicle identified.toml --motor-lag 18 --max-rpm 9500 -o gains.toml     # figures from a thrust stand");
  c->callback([o, &exit_code] { exit_code = design(*o); });
}

}  // namespace rotorloop::cli
