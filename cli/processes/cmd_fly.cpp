// `rotorloop fly`: estimator and controller of a flight, in a process of its own on live buses.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "bench/hil/processes/fly_process.hpp"
#include "cli/commands.hpp"
#include "cli/processes/flight_options.hpp"
#include "cli/processes/props_off.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/real_time.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::cli {
namespace {

struct FlyArguments {
  FlightOptions flight;
  PropsOff props;
};

// Throws Error when no flight can begin below the ceiling: the flight computer waits for all rotors at idle speed.
void check_ceiling(double ceiling_rad_s, double idle_rad_s, double hover_rad_s) {
  if (ceiling_rad_s >= idle_rad_s) return;
  const auto rpm = [](double omega_rad_s) { return omega_rad_s / kRad_s_per_rpm; };
  constexpr double kOverHover = 1.5;  // of hover speed: twice the thrust and some
  throw Error({"--max-rpm",
               fmt::format("{:.0f} rpm is below the {:.0f} rpm at which this vehicle's rotors idle: no flight can begin",
                           rpm(ceiling_rad_s), rpm(idle_rad_s)),
               fmt::format("it hovers at {:.0f} rpm", rpm(hover_rad_s)),
               fmt::format("when these motors and their mount bear it, give --max-rpm {:.0f}", rpm(kOverHover * hover_rad_s))});
}

int fly(const FlyArguments& o) {
  const double ceiling_rad_s = checked_ceiling_rad_s(o.props, o.flight.esc_bus);
  OpenedFlight f = open_flight(o.flight);
  const StopSignals stop;
  hil::FlyProcess process(f.scenario, f.inputs, f.request, f.pace, ceiling_rad_s, *f.state, *f.esc, stop.flag());
  check_ceiling(ceiling_rad_s, process.idle_rad_s(), host::hover_omega_rad_s(f.inputs.vehicle));
  FlushedLog<log::FlightLogWriter> log(o.flight.log, f);
  if (log) process.on_record = [&](const host::FlightRecord& r) { log.write(hil::flight_row(r)); };
  if (f.pace.pace > 0.0)
    for (const std::string& text : ask_for_real_time().refused) fmt::print(stderr, "real time: {}\n", text);
  const int signal_code = run_flight(process, f);
  if (!process.end().ended) process.stop("stopped by a signal: motors disarmed");
  fmt::print("flown:    {:.3f} s of {}/{}/{}\n", process.flown_s(), f.scenario.name, f.scenario.flights[f.request.flight].name,
             hil::variant_name(f.request.variant));
  fmt::print("heard:    {} IMU samples\n", process.samples_heard());
  close_flight(f);
  log.close();
  const int code = report_end("fly", process.end());
  return signal_code != 0 ? signal_code : code;
}

}  // namespace

void add_fly(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<FlyArguments>();
  CLI::App* c = app.add_subcommand("fly", "fly a scenario on buses: estimator and controller, for an airframe and ESCs there");
  add_flight_options(*c, o->flight, "write what the controller knew and did to this file, as flight.csv of rotorloop hil");
  add_props_off(*c, o->props);
  c->footer(
      "Arms when the airframe sends samples and all four ESCs are operational; disarms when one of them is silent, or at the end.\n"
      "Example: see rotorloop airframe --help\n"
      "Exit codes: 0 flown to its end, 3 no airframe appeared, 4 ended in the safe state with its reason.");
  c->callback([o, &exit_code] { exit_code = fly(*o); });
}

}  // namespace rotorloop::cli
