// `rotorloop airframe`: plant and sensors of a flight, in a process of its own on live buses.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "bench/hil/processes/airframe_process.hpp"
#include "cli/commands.hpp"
#include "cli/processes/flight_options.hpp"
#include "host/base/constants.hpp"
#include "host/base/real_time.hpp"

namespace rotorloop::cli {
namespace {

void tell_pace(const hil::AirframeProcess& airframe) {
  const Lateness* l = airframe.lateness();
  if (l == nullptr) return;
  fmt::print("pace:     {} of {} deadlines missed; late by at most {:.0f} us in 99.9 %, {:.0f} us at worst\n", l->missed, l->steps,
             l->quantile_us(0.999), 1e-3 * static_cast<double>(l->worst_ns));
}

// Of a flight to its end: the limits of the scenario on its tracking error.
int judge_limits(const hil::AirframeProcess& airframe, const OpenedFlight& f) {
  hil::FlightResult result;
  result.flight = f.scenario.flights[f.request.flight].name;
  result.variant = f.request.variant;
  result.tracking = airframe.tracking();
  hil::Scenario alone = f.scenario;
  alone.limits = {};
  for (const hil::ErrorLimit& l : f.scenario.limits.error)
    if (l.flight == result.flight && l.variant == result.variant) alone.limits.error.push_back(l);
  const hil::Assessment assessment = hil::assess(alone, {result}, 1);
  fmt::print("{}", hil::limits_text(assessment));
  return to_int(assessment.verdict == hil::Verdict::pass ? ExitCode::ok : ExitCode::verdict);
}

int airframe(const FlightOptions& o) {
  OpenedFlight f = open_flight(o);
  hil::AirframeProcess process(f.scenario, f.inputs, f.request, f.pace, *f.state, *f.esc);
  if (f.pace.pace > 0.0)
    for (const std::string& text : ask_for_real_time().refused) fmt::print(stderr, "real time: {}\n", text);
  FlushedLog<log::TruthLogWriter> log(o.log, f);
  if (log) process.on_truth = [&](double t_s, const hil::PlantTruth& t) { log.write(hil::airframe_row(t_s, t)); };
  fmt::print(
      stderr,
      "airframe: its rotors turn as the ESCs report and load no motor: a real motor without its propeller accelerates faster, and the "
      "thrust of a real propeller is not felt\n");
  const int signal_code = run_flight(process, f);
  const hil::TrackingFigures t = process.tracking();
  fmt::print("flown:    {:.3f} s of {}/{}\n", process.flown_s(), f.scenario.name, f.scenario.flights[f.request.flight].name);
  if (std::isfinite(t.truth.mean_3d_cm))
    fmt::print("tracking: {:.2f} cm mean, {:.2f} cm worst, against {} set-points heard\n", t.truth.mean_3d_cm, t.truth.max_3d_cm,
               process.setpoints_heard());
  else
    fmt::print("tracking: none, the flight ended before its trajectory began\n");
  fmt::print("ESCs:     {} reports heard, {:.0f} rpm at most\n", process.feedback_heard(), process.fastest_rad_s() / kRad_s_per_rpm);
  tell_pace(process);
  close_flight(f);
  log.close();
  if (signal_code != 0) return signal_code;
  const int code = report_end("airframe", process.end());
  return code == 0 ? judge_limits(process, f) : code;
}

}  // namespace

void add_airframe(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<FlightOptions>();
  CLI::App* c =
      app.add_subcommand("airframe", "fly the airframe of a scenario on buses: plant and sensors, for ESCs and a controller there");
  add_flight_options(*c, *o, "write the true motion to this file, as truth.csv of rotorloop hil");
  c->footer(
      "Waits for ESCs 21 to 24 and a controller (rotorloop fly), then begins. Rotor speeds are those that the ESCs report.\n"
      "Example, each in a terminal of its own:\n"
      "  for i in 0 1 2 3; do rotorloop esc-sim --bus mcast:0 --node-id $((21 + i)) --esc-index $i --pace lockstep & done\n"
      "  rotorloop airframe scenarios/paper.toml --flight vertical --esc-bus mcast:0 --state-bus mcast:1 --pace lockstep\n"
      "  rotorloop fly scenarios/paper.toml --flight vertical --esc-bus mcast:0 --state-bus mcast:1 --pace lockstep\n"
      "Exit codes: 0 flown to its end, 3 somebody did not appear, 4 ended for safety (late, somebody silent), 6 crashed or a limit of the "
      "scenario missed.");
  c->callback([o, &exit_code] { exit_code = airframe(*o); });
}

}  // namespace rotorloop::cli
