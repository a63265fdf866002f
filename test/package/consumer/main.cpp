// Builds on the installed libraries alone: flies a simulation, reads its logs, identifies the vehicle, finds an effect that only this
// program knows, and flies again with another gain. Ends with 1, and says why, when a result is not what it must be.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/hil/flight/flight.hpp"
#include "bench/sysid/diagnose/diagnosis_run.hpp"
#include "bench/sysid/identify/identification_run.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"
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
const fs::path kVehicle = fs::path(ROTORLOOP_SHARE) / "vehicles/hil_baseline.toml";  // knows of no fin
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

// With the choices of `rotorloop identify`, of which only the rate is another: so that this takes seconds.
identify::IdentificationRequest identification(const std::vector<fs::path>& logs) {
  return {.vehicle = kVehicle, .flights = {.flights = logs}, .fit = {.rate_Hz = 50.0}};
}

// The effect of the catalogue with the fin's law, as `rotorloop identify --term sideslip_yaw_moment` fits it; every digit is printed for a
// comparison with that.
void identify_as_the_command(const std::vector<fs::path>& logs) {
  identify::IdentificationRequest request = identification(logs);
  request.terms.add(*host::find_term("sideslip_yaw_moment"));
  const identify::IdentificationRun run = identify::run_identification(request);
  for (const estimate::Estimate& e : run.result.fit.estimates)
    std::printf("estimate %s %.17g %.17g\n", estimate::estimate_name(e, run.result.problem).c_str(), e.value, identify::reported_u(e));
}

void identify_with_own_term(const std::vector<fs::path>& logs) {
  identify::IdentificationRequest request = identification(logs);
  for (const host::VehicleEffect& e : host::read_vehicle(kVehicle, host::builtin_effect_catalogue()).effects)
    if (const host::Term* term = host::find_term(e.id)) request.terms.add(*term);
  request.terms.add(kTailFin);  // fitted with the rest, as an effect of the catalogue would be
  const int fin = estimate::kCoreParameters + static_cast<int>(request.terms.first_parameter(request.terms.size() - 1));
  const identify::IdentificationRun run = identify::run_identification(request);
  expect(run.result.fit.converged, "identification converges");
  const estimate::Estimate* k = run.result.fit.find(fin);
  expect(k != nullptr, "the own effect's parameter is among the estimates");
  if (!k) return;
  std::printf("        tail_fin k = %.4g +- %.1g N s2/m, true %.4g\n", k->value, identify::reported_u(*k), kFin_N_s2_m);
  expect(std::fabs(k->value / kFin_N_s2_m - 1.0) < 0.1, "identification finds the fin within 10 % of its true 1e-3 N s2/m");
}

void diagnose_vehicle(const std::vector<fs::path>& logs) {
  diagnose::DiagnosisRequest request{.vehicle = kVehicle, .flights = {.flights = logs}, .own = {&kTailFin}, .fit = {.rate_Hz = 50.0}};
  // What the catalogue lists as indistinguishable from it is left out, and most of the rest, so that this takes seconds.
  for (const host::Term& term : host::all_terms()) {
    if (term.info.id != "linear_drag" && term.info.id != "com_offset" && term.info.id != "quadratic_rate_damping")
      request.without.emplace_back(term.info.id);
  }
  request.max_effects = 1;
  request.placebos = 20;
  const diagnose::DiagnosisRun run = diagnose::run_diagnosis(request).run;
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
  const hil::Scenario scenario = hil::read_scenario(fs::path(ROTORLOOP_SHARE) / "scenarios/diagnose.toml");
  const std::vector<fs::path> logs = fly_with_fin(scenario, folder);
  identify_as_the_command(logs);
  identify_with_own_term(logs);
  diagnose_vehicle(logs);
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
