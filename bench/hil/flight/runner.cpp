#include "bench/hil/flight/runner.hpp"

#include <algorithm>

#include "bench/hil/flight/flight.hpp"
#include "bench/hil/flight/run_outcome.hpp"
#include "bench/hil/flight/run_report.hpp"
#include "host/base/error.hpp"
#include "host/base/parallel.hpp"
#include "host/base/run_clock.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::hil {
namespace {

std::vector<FlightRequest> plan(const Scenario& scenario) {
  std::vector<FlightRequest> flights;
  for (std::size_t f = 0; f < scenario.flights.size(); ++f)
    for (const Variant& v : scenario.variants)
      for (const std::uint64_t seed : scenario.seeds) flights.push_back({.flight = f, .variant = v, .seed = seed, .folder = {}});
  return flights;
}

// "emulated: …" of all, or "1 native, 2 native, 3 emulated, …"; nothing when all are native.
std::string escs_text(const Scenario& scenario, const Inputs& inputs) {
  const auto& kinds = scenario.esc.kind;
  const bool alike = std::all_of(kinds.begin(), kinds.end(), [&](EscKind k) { return k == kinds[0]; });
  if (alike && kinds[0] == EscKind::native) return "";
  std::string out = alike ? std::string(esc_kind_name(kinds[0])) : "";
  for (std::size_t i = 0; i < kinds.size() && !alike; ++i)
    out += (i == 0 ? "" : ", ") + std::to_string(i + 1) + " " + std::string(esc_kind_name(kinds[i]));
  return inputs.program ? out + ": STM32G431 with " + inputs.program->text() : out;
}

std::vector<Warning> warnings_of(const Scenario& scenario, const Inputs& inputs, const std::vector<FlightResult>& flights) {
  std::vector<Warning> out;
  for (const std::string& id : inputs.effects.not_flown)
    out.push_back({scenario.vehicle.generic_string(), "effect " + id + " is no load that a controller could counter: not used"});
  for (const std::string& text : ablation_texts(scenario.ablation)) out.push_back({"ablation", text});
  for (const FlightResult& f : flights) {
    const std::string where = f.flight + "/" + variant_name(f.variant) + "/" + std::to_string(f.seed);
    if (f.end != FlightEnd::completed) out.push_back({where, std::string(flight_end_name(f.end)) + ": " + f.end_detail});
    for (const char* name : {"rotor.not_converged", "control.bad_input", "control.effects_not_finite", "control.effects_bounded",
                             "sensor.frames_refused", "estimator.resets"}) {
      const auto found = f.counters.find(name);
      if (found != f.counters.end() && found->second > 0)
        out.push_back({where, std::string(name) + " = " + std::to_string(static_cast<long long>(found->second))});
    }
  }
  return out;
}

// Paced flights are flown one at a time, and none after one that was late: the next would be as well.
std::vector<FlightOutcome> fly_all(const Scenario& scenario, const Inputs& inputs, std::vector<FlightRequest>& requests,
                                   const RunOptions& options, RunFolder& folder, Progress& progress) {
  std::vector<FlightOutcome> outcomes(requests.size());
  WaitClock clock;
  bool late = false;
  const auto fly_one = [&](std::size_t i) {  // a world of its own: the order does not matter
    if (late) return;
    FlightRequest& q = requests[i];
    q.clock = &clock;
    q.catch_up_ns = options.catch_up_ns;
    if (options.logs) q.folder = folder.flight_folder(scenario.flights[q.flight].name, q.variant, q.seed);
    outcomes[i] = fly(
        scenario, inputs, q, &folder, [&](double s) { progress.advance(s); }, options.stop);
    progress.finished(outcomes[i].result);
    if (outcomes[i].result.end == FlightEnd::late) late = true;
  };
  parallel_for(requests.size(), scenario.bus.pace > 0.0 ? 1 : options.jobs, fly_one, options.stop);
  return outcomes;
}

}  // namespace

HilResult run_hil(const Scenario& scenario, const RunOptions& options, Progress& progress) {
  const RunClock clock;
  const Inputs inputs = read_inputs(scenario);
  HilResult out;
  RunResult& r = out.result;
  r.started_utc = clock.started_utc();
  RunFolder folder = RunFolder::create(options.runs_dir, options.name.empty() ? folder_name(scenario.name) : options.name, options.force);
  out.folder = folder.path();
  r.version = kVersion;
  r.git = kGit;
  r.scenario = scenario.name;
  r.escs = escs_text(scenario, inputs);
  r.seeds = scenario.seeds;
  // The copied scenario has to find every file it names, flown this time or not.
  std::vector<std::filesystem::path> files = inputs.files;
  files.insert(files.end(), scenario.files.begin(), scenario.files.end());
  r.inputs = folder.copy_inputs(files);
  folder.write_run_toml(r, options.command_line, scenario);  // first: a run that is killed is still known as one

  std::vector<FlightRequest> requests = plan(scenario);
  double total_s = 0.0;
  for (const FlightRequest& q : requests) total_s += flight_duration_s(scenario, inputs, q);
  progress.begin(requests.size(), total_s);
  RealTimeGrants grants;
  if (scenario.bus.pace > 0.0) grants = ask_for_real_time();
  const std::vector<FlightOutcome> outcomes = fly_all(scenario, inputs, requests, options, folder, progress);
  progress.end();

  for (const FlightOutcome& o : outcomes)
    if (!o.result.flight.empty()) out.flights.push_back(o.result);
  out.assessment = assess(scenario, out.flights, requests.size());
  r.verdict = out.assessment.verdict;
  r.limits = out.assessment.limits;
  r.figures = figures_of(scenario, out.assessment, out.flights);
  r.flights = out.flights;
  r.published = scenario.published;
  r.log_hashes = folder.log_hashes();
  r.log_sha256 = hash_of_logs(r.log_hashes);
  r.warnings = warnings_of(scenario, inputs, out.flights);
  for (const std::string& text : grants.refused) r.warnings.push_back({"real time", text});
  r.real_time = grants.granted;
  r.errors = errors_of(r, requests.size());
  r.next = outcome_of(r, folder.path()).next;
  if (!options.logs) r.warnings.push_back({"logs", "none was kept (--no-logs): figures can be compared, bytes and plots over time cannot"});
  for (const Warning& w : r.warnings) progress.warn(w.where, w.what);
  r.wall_s = clock.elapsed_s();
  folder.write_result(r);
  try {
    write_hil_report(folder.path());
  } catch (const Error& e) {  // the run and its result stand without the page
    progress.warn("report.html", e.what());
  }
  return out;
}

}  // namespace rotorloop::hil
