// `rotorloop fly`: estimator and controller of a flight, in a process of its own on live buses.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "bench/hil/processes/fly_process.hpp"
#include "cli/commands.hpp"
#include "cli/processes/flight_options.hpp"
#include "cli/processes/props_off.hpp"
#include "host/base/real_time.hpp"

namespace rotorloop::cli {
namespace {

struct FlyArguments {
  FlightOptions flight;
  PropsOff props;
};

int fly(const FlyArguments& o) {
  const double ceiling_rad_s = checked_ceiling_rad_s(o.props, o.flight.esc_bus);
  OpenedFlight f = open_flight(o.flight);
  const StopSignals stop;
  hil::FlyProcess process(f.scenario, f.inputs, f.request, f.pace, ceiling_rad_s, *f.state, *f.esc, stop.flag());
  if (f.pace.pace > 0.0)
    for (const std::string& text : ask_for_real_time().refused) fmt::print(stderr, "real time: {}\n", text);
  const int signal_code = run_flight(process, f);
  if (!process.end().ended) process.stop("stopped by a signal: motors disarmed");
  fmt::print("flown:    {:.3f} s of {}/{}/{}\n", process.flown_s(), f.scenario.name, f.scenario.flights[f.request.flight].name,
             hil::variant_name(f.request.variant));
  fmt::print("heard:    {} IMU samples\n", process.samples_heard());
  close_flight(f);
  const int code = report_end("fly", process.end());
  return signal_code != 0 ? signal_code : code;
}

}  // namespace

void add_fly(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<FlyArguments>();
  CLI::App* c = app.add_subcommand("fly", "fly a scenario on buses: estimator and controller, for an airframe and ESCs there");
  add_flight_options(*c, o->flight);
  c->add_option("--variant", o->flight.variant, "controller; default: the first of the scenario");
  add_props_off(*c, o->props);
  c->footer(
      "Arms when the airframe sends samples and all four ESCs are operational; disarms when one of them is silent, or at the end.\n"
      "Example: see rotorloop airframe --help\n"
      "Exit codes: 0 flown to its end, 3 no airframe appeared, 4 ended in the safe state with its reason.");
  c->callback([o, &exit_code] { exit_code = fly(*o); });
}

}  // namespace rotorloop::cli
