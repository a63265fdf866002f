// Builds on the installed libraries alone: flies a simulation, reads its logs, identifies the vehicle, finds an effect that only this
// program knows, and flies again with another gain. Ends with 1, and says why, when a result is not what it must be.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/hil/flight/flight.hpp"
#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/log/check/checks.hpp"
#include "bench/sysid/log/read_flight.hpp"
#include "host/base/error.hpp"
#include "host/effects/term_math.hpp"
#include "host/vehicle/effect_catalogue.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace {

namespace fs = std::filesystem;
using namespace rotorloop;

// An effect of this program's own, a class as those of host/effects: a fin at the tail turns the nose into the flow, τ_z = k v_x v_y.
struct TailFin {
  static constexpr std::string_view kId = "tail_fin";
  // name, unit, min, max, scale (a size that matters), neutral
  static constexpr host::TermParameter kParameters[] = {{"k_N_s2_m", "N s2/m", 0.0, 3e-3, 2e-4, 0.0}};

  template <class S>
  static void body(const S* c, host::LoadState<S>& s) {
    s.torque_B_N_m.z += c[0] * s.v_air_B_m_s.x * s.v_air_B_m_s.y;
  }
};
constexpr host::Term kTailFin = host::make_term<TailFin>();
constexpr double kFin_N_s2_m = 1e-3;  // what is flown: 36 mN m at 8.5 m/s and 45 degrees of sideslip

int g_failures = 0;
void expect(bool holds, const std::string& promise) {
  std::printf("%s  %s\n", holds ? "ok    " : "FAILED", promise.c_str());
  if (!holds) ++g_failures;
}

hil::FlightResult fly(const hil::Scenario& scenario, const hil::Inputs& inputs, std::size_t flight, const fs::path& folder) {
  if (!folder.empty()) fs::create_directories(folder);
  const hil::FlightRequest request{.flight = flight, .variant = hil::Variant::pd_ff_thrust_drag, .seed = 1, .folder = folder};
  return hil::fly(
             scenario, inputs, request, nullptr, [](double) {}, nullptr)
      .result;
}

// The three flights of scenarios/diagnose.toml, of a vehicle whose tail fin no file mentions, as logs below `folder`.
std::vector<fs::path> fly_with_fin(const hil::Scenario& scenario, const fs::path& folder) {
  hil::Inputs inputs = hil::read_inputs(scenario);
  const sim::EffectInfo* fin = sim::find_effect("sideslip_yaw_moment");  // the same physics, in the simulated world
  inputs.plant.effects.push_back({std::string(fin->id), sim::effect_values(*fin, kFin_N_s2_m)});
  std::vector<fs::path> logs;
  for (std::size_t f = 0; f < scenario.flights.size(); ++f) {
    const fs::path log = folder / scenario.flights[f].name;
    const hil::FlightResult flown = fly(scenario, inputs, f, log);
    expect(flown.end == hil::FlightEnd::completed, "flight " + flown.flight + " with a fin is flown to its end");
    logs.push_back(log);
  }
  return logs;
}

// Read and checked as the command does it.
std::vector<identify::FlightToFit> read_logs(const std::vector<fs::path>& logs, const host::VehicleModel& vehicle) {
  std::vector<identify::FlightToFit> out;
  for (const fs::path& path : logs) {
    log::CheckedFlight checked = log::check_flight(log::read_flight(path, nullptr), vehicle);
    checked.throw_if_refused();
    expect(checked.flight.pose.size() > 3000, "the log of " + path.filename().string() + " has more than 3000 poses (15 s at 200 Hz)");
    out.push_back({checked.flight, identify::FlightRole::any, checked.segments, {}});
  }
  return out;
}

identify::IdentifyOptions fit_options(const host::VehicleFile& vehicle) {
  identify::IdentifyOptions o;
  o.grid.rate_Hz = 50.0;
  o.grid.longest_substep_s = 1e-2;
  o.grid.slopes_by_middle = true;
  o.grid.use_gyro = o.grid.use_accel = true;
  for (const host::VehicleEffect& e : vehicle.effects) {
    if (const host::Term* term = host::find_term(e.id)) o.terms.add(*term);
  }
  o.fit.noise.rounds = 16;
  o.fit.noise.tolerance = 0.05;
  o.fit.noise.per_flight = true;
  o.fit.max_iterations = 80;
  o.fit.tolerance = 0.02;
  o.fit.threads = 2;
  return o;
}

void identify_vehicle(const std::vector<identify::FlightToFit>& flights, const host::VehicleFile& vehicle) {
  identify::IdentifyOptions options = fit_options(vehicle);
  options.terms.add(kTailFin);  // fitted with the rest, as an effect of the catalogue would be
  const int fin = estimate::kCoreParameters + static_cast<int>(options.terms.first_parameter(options.terms.size() - 1));
  const identify::Identification result = identify::identify(flights, vehicle, options);
  expect(result.fit.converged, "identification converges");
  const estimate::Estimate* k = result.fit.find(fin);
  expect(k != nullptr, "the own effect's parameter is among the estimates");
  if (!k) return;
  std::printf("        tail_fin k = %.4g +- %.1g N s2/m, true %.4g\n", k->value, k->u_robust, kFin_N_s2_m);
  expect(std::fabs(k->value / kFin_N_s2_m - 1.0) < 0.1, "identification finds the fin within 10 % of its true 1e-3 N s2/m");
}

void diagnose_vehicle(const std::vector<identify::FlightToFit>& flights, const host::VehicleFile& vehicle) {
  diagnose::DiagnoseOptions options;
  options.identify = fit_options(vehicle);
  options.library = {&kTailFin};
  // What the catalogue lists as indistinguishable from it is left out, and most of the rest, so that this takes seconds.
  for (const host::Term& term : host::all_terms()) {
    if (term.info.id != "linear_drag" && term.info.id != "com_offset" && term.info.id != "quadratic_rate_damping")
      options.without.emplace_back(term.info.id);
  }
  options.max_effects = 1;
  options.placebos = 20;
  const diagnose::DiagnosisRun run = diagnose::diagnose({.fitted = flights}, vehicle, options);
  expect(run.diagnosis.added.size() == 1, "diagnosis adds one effect");
  if (run.diagnosis.added.empty()) return;
  const diagnose::AddedEffect& found = run.diagnosis.added.front();
  std::printf("        found %s, k = %.4g +- %.1g N s2/m\n", found.id.c_str(), found.parameters.front().value, found.parameters.front().u);
  expect(found.id == "tail_fin" && found.aliases.empty(), "diagnosis names the own effect, alone");
  expect(std::fabs(found.parameters.front().value / kFin_N_s2_m - 1.0) < 0.1, "its size is within 10 % of the true one");
}

void fly_with_another_gain(const hil::Scenario& scenario) {
  hil::Inputs inputs = hil::read_inputs(scenario);
  constexpr std::size_t kHorizontal = 1;
  const double error_cm = fly(scenario, inputs, kHorizontal, {}).tracking.truth.mean_3d_cm;
  const double again_cm = fly(scenario, inputs, kHorizontal, {}).tracking.truth.mean_3d_cm;
  expect(error_cm == again_cm, "the same flight twice has the same tracking error to the bit");
  inputs.gains.gains.horizontal.frequency_rad_s *= 0.6;
  const double softer_cm = fly(scenario, inputs, kHorizontal, {}).tracking.truth.mean_3d_cm;
  std::printf("        mean tracking error %.2f cm, with 0.6 of the horizontal frequency %.2f cm\n", error_cm, softer_cm);
  expect(softer_cm > 1.1 * error_cm, "a horizontal loop of 0.6 times its frequency tracks more than 10 % worse");
}

int run(const fs::path& folder) {
  const fs::path share = ROTORLOOP_SHARE;
  const hil::Scenario scenario = hil::read_scenario(share / "scenarios/diagnose.toml");
  const host::VehicleFile vehicle = host::read_vehicle(share / "vehicles/hil_baseline.toml", host::builtin_effect_catalogue());
  const auto flights = read_logs(fly_with_fin(scenario, folder), host::to_model(vehicle));
  identify_vehicle(flights, vehicle);
  diagnose_vehicle(flights, vehicle);
  fly_with_another_gain(scenario);
  std::printf("%s\n", g_failures ? "FAILED" : "all as promised");
  return g_failures ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: consumer FOLDER   (for the logs that it flies)\n");
    return 2;
  }
  try {
    return run(argv[1]);
  } catch (const Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return rotorloop::to_int(e.exit_code());
  }
}
