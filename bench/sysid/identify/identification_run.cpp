#include "bench/sysid/identify/identification_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <thread>

#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/identify/mass_check.hpp"
#include "bench/sysid/identify/vehicle_priors.hpp"
#include "host/base/sha256.hpp"
#include "host/base/statistics.hpp"
#include "host/effects/term_size.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::identify {

namespace fs = std::filesystem;

void FitRequest::apply(IdentifyOptions& i) const {
  i.grid.rate_Hz = rate_Hz;
  i.grid.from_s = from_s;
  i.grid.to_s = to_s;
  for (const std::string& stream : use) {
    if (stream == "gyro") i.grid.use_gyro = true;
    if (stream == "accel") i.grid.use_accel = true;
    if (stream == "velocity") i.grid.use_velocity = true;
    if (stream == "load") i.grid.use_load = true;
  }
  i.wishes = {free, hold, per_flight};
  i.fit.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

void FitRequest::use_what_all_have(const std::vector<FlightToFit>& flights) {
  if (!use.empty()) return;
  const auto all_have = [&](auto log::FlightRecord::*stream) {
    return std::none_of(flights.begin(), flights.end(), [&](const FlightToFit& f) { return (f.record.*stream).empty(); });
  };
  if (all_have(&log::FlightRecord::gyro_B_rad_s)) use.push_back("gyro");
  if (all_have(&log::FlightRecord::accel_B_m_s2)) use.push_back("accel");
}

void FitRequest::free_place_of_accelerometer(const host::VehicleFile& vehicle) {
  constexpr double kWithinArms = 0.3;
  const auto of_place = [](const std::string& name) { return name.starts_with("imu_place"); };
  const bool used = std::find(use.begin(), use.end(), "accel") != use.end();
  const bool said = std::any_of(free.begin(), free.end(), of_place) || std::any_of(hold.begin(), hold.end(), of_place);
  if (used && !said)
    free.push_back(fmt::format("imu_place={:.3g}", kWithinArms * host::arm_m(host::load_geometry(host::to_model(vehicle)))));
}

std::string_view name(NoiseSearch noise) {
  constexpr std::array<std::string_view, 3> kNames{"em", "em-per-flight", "fixed"};
  return kNames[static_cast<std::size_t>(noise)];
}

std::optional<Error> not_credible(const std::filesystem::path& path, const host::VehicleFile& v, const host::EffectCatalogue& catalogue) {
  try {
    (void)host::parse_vehicle(host::vehicle_text(v), path.empty() ? std::filesystem::path("the identified vehicle") : path, catalogue);
    return std::nullopt;
  } catch (const Error& e) {
    ErrorText text = e.text();
    // Line numbers are those of a file that nobody has.
    text.where = path.empty() ? "" : path.generic_string();
    text.what = std::string("the identified vehicle is not credible") + (path.empty() ? ": " : " and was not written: ") + text.what;
    text.likely =
        "the flights do not determine these parameters, the model lacks an effect that they show, or a stream is wrong (see the findings "
        "of the "
        "checks)";
    text.remedy =
        "hold what they do not determine (--hold torque_model.c_q where the figure of merit is off: c_q hangs on the rotors' own inertia), "
        "add the effect (--term; `rotorloop diagnose` names it), or fly the manoeuvres that "
        "excite it";
    return Error(text, ExitCode::data_quality);
  }
}

IdentifyAnalysis analyse(const Identification& r, const host::VehicleModel& base, double drag_speed_m_s) {
  IdentifyAnalysis a;
  a.derived = derived_quantities(r.fit, base, drag_speed_m_s);
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    if (!r.fit.reduced[f].innovations.empty()) a.whiteness.push_back(whiteness_of(r.flights[f].name, r.fit.reduced[f].innovations));
  }
  std::vector<double> ratio;
  for (const estimate::Estimate& e : r.fit.estimates) {
    if (e.prior_share <= 0.5 && e.u > 0.0) ratio.push_back(e.u_robust * e.u_robust / (e.u * e.u));
  }
  if (!ratio.empty()) a.inflation = std::max(1.0, median(std::move(ratio)));
  a.homogeneity = homogeneity_of(r.problem, r.fit, a.inflation);
  a.observability = observability_of(r.problem, r.fit);
  return a;
}

namespace {

IdentifyOptions identify_options(const IdentificationRequest& o, estimate::StopFit stop) {
  IdentifyOptions i;
  o.fit.apply(i);
  i.terms = o.terms;
  i.fit.noise.rounds = o.noise == NoiseSearch::fixed ? 0 : 30;
  i.fit.noise.per_flight = o.noise == NoiseSearch::per_flight;
  i.fit.innovations = true;
  i.fit.robust_scale = o.robust_scale;
  i.fit.block_s = o.block_s;
  i.fit.max_iterations = o.iterations;
  i.fit.stop = stop;
  if (o.priors) i.priors = priors_beside_flights;
  i.hold_priors_first = false;
  i.priors_against_scatter = true;
  i.keep_possible = o.priors;
  return i;
}

// Files are named by their file name, and by the whole path where two have the same.
std::vector<ComparedVehicle> read_compared(const std::vector<fs::path>& paths) {
  std::vector<ComparedVehicle> out;
  for (const fs::path& path : paths) {
    const auto same = std::count_if(paths.begin(), paths.end(), [&](const fs::path& other) { return other.filename() == path.filename(); });
    out.push_back({(same > 1 ? path : path.filename()).generic_string(), host::read_vehicle(path, host::builtin_effect_catalogue())});
  }
  return out;
}

// A fit without an end: what the flights disagree about says why, when they do.
Error not_converged(const IdentificationRun& run) {
  std::string moved;
  for (const ParameterHomogeneity& p : run.analysis.homogeneity.parameters) {
    if (p.moved) moved += (moved.empty() ? "" : ", ") + estimate::parameter_info(p.parameter, run.result.problem.start.terms).symbol;
  }
  const std::string what = fmt::format("the fit did not converge in {} iterations{}", run.result.fit.iterations,
                                       run.request.out.empty() ? "" : "; no vehicle file was written") +
                           (run.request.check_by_ceres ? "; nor is there anything that Ceres could check" : "");
  if (moved.empty()) {
    return Error(
        {"", what, "parameters that these flights do not determine",
         run.request.fit.use == std::vector<std::string>{"none"}
             ? "give the fit the gyro and accelerometer of the logs too (without --use none), hold what the observability table names, or "
               "look at the findings of the checks"
             : "hold what the observability table names (--hold), fit several flights together, or look at the findings of the checks"},
        ExitCode::data_quality);
  }
  return Error({"", what, "estimates differ significantly between flights: " + moved + "; the model lacks an effect that some of them show",
                "add it (--term; `rotorloop diagnose` names it), hold what cannot differ (--hold pose_delay for synchronised logs), or "
                "leave out the flight that disagrees"},
               ExitCode::data_quality);
}

// What keeps the fit from being an answer; none when it is one.
std::optional<Error> problem_of(const IdentificationRun& run) {
  if (!run.result.fit.converged) return not_converged(run);
  if (const auto mass = mass_contradicted(run.result, run.base)) return mass;
  if (run.analysis.solver_check && !run.analysis.solver_check->good())
    return Error(
        {"--solver ceres",
         solver_check_problem(*run.analysis.solver_check) + (run.request.out.empty() ? "" : "; no vehicle file was written"),
         "one of them ended in a lesser optimum, or the flights leave a direction so nearly open that rounding decides",
         "hold what the weakest directions name (--hold), start from a vehicle file nearer to the vehicle, or report it with the logs"},
        ExitCode::data_quality);
  return not_credible(run.request.out, run.vehicle, host::builtin_effect_catalogue());
}

// The fit, and its check by Ceres where that is asked for.
void fit_flights(const IdentifyOptions& options, const IdentificationWatch& watch, IdentificationRun& run) {
  const bool check = run.request.check_by_ceres;
  const auto report = [&](const IdentifyProgress& p) {
    if (watch.progress) watch.progress(p);
  };
  if (watch.begins) watch.begins(options.fit);
  int parts = 0;
  run.result = identify(run.flights.to_fit(), run.base, options, [&](IdentifyProgress p) {
    parts = p.parts += check ? 1 : 0;
    report(p);
  });
  run.analysis = analyse(run.result, host::to_model(run.base), run.request.drag_speed_m_s);
  if (!check || !run.result.fit.converged) return;
  if (watch.begins) watch.begins(check_options(options.fit));
  run.analysis.solver_check = check_by_ceres(run.result, options.fit, [&](const estimate::FitProgress& p) {
    report({"check by Ceres", parts, parts, p});
  });
}

}  // namespace

IdentificationRun run_identification(const IdentificationRequest& asked, const IdentificationWatch& watch) {
  IdentificationRun run;
  run.request = asked;
  IdentificationRequest& o = run.request;
  run.base = host::read_vehicle(o.vehicle, host::builtin_effect_catalogue());
  const std::vector<ComparedVehicle> compared_files = read_compared(o.compare);
  log::FlightSet& flights = run.flights;
  flights = log::read_flight_set(o.flights, host::to_model(run.base), watch.reading);
  o.fit.use_what_all_have(flights.flights);
  o.fit.free_place_of_accelerometer(run.base);
  flights.inputs.insert(flights.inputs.begin(), {o.vehicle.generic_string(), sha256_file(o.vehicle)});
  const std::vector<std::string> fitted_hashes = flights.fitted_hashes();
  for (const fs::path& path : o.compare) flights.inputs.push_back({path.generic_string(), sha256_file(path)});
  const IdentifyOptions options = identify_options(o, watch.stop);
  fit_flights(options, watch, run);
  if (flights.flights.size() > flights.fitted && !watch.stop.asked())
    run.analysis.held_out = score_held_out(flights.held_out(), run.result, options);
  run.comparison =
      compared(run.result, run.analysis.derived, o.drag_speed_m_s, {o.vehicle.filename().generic_string(), run.base}, compared_files);
  run.stopped = watch.stop.asked();
  if (run.stopped) return run;
  WrittenVehicle written = written_vehicle(run.result.fit, run.base, flown_rpm(run.result.flights),
                                           std::string("rotorloop identify ") + kVersion, fitted_hashes);
  run.vehicle = std::move(written.file);
  run.analysis.written_differences = std::move(written.differences);
  run.problem = problem_of(run);
  return run;
}

}  // namespace rotorloop::identify
