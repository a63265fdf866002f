#include "bench/stand/virtual/virtual_run.hpp"

#include "bench/stand/virtual/virtual_stand.hpp"
#include "host/base/error.hpp"

namespace rotorloop::virtual_stand {
namespace {

VirtualStandConfig config_of(const VirtualRunOptions& v, const modbus::StandSetup& setup, int esc_index) {
  VirtualStandConfig c;
  c.rotor.plant = v.plant;
  c.rotor.axial_wind_m_s = v.wind_m_s;
  c.rotor.thrust_lost = v.strut;
  c.rotor.esc_index = esc_index;
  c.rotor.pole_pairs = v.esc_pole_pairs;
  c.rotor.seed = c.seed = v.seed;
  c.dies = v.dies;
  c.dies_at_s = v.dies_at_s;
  c.chipped_at_s = v.chipped_at_s;
  if (v.perfect) {
    c.properties.noise = {};
    c.properties.division = {};
    c.properties.creep_share = 0.0;
  } else
    c.errors = drawn_errors(v.seed, setup.calibration.full_scale);
  // The shipped matrix is that of its cells: what is drawn is what a calibration leaves.
  c.errors.sensitivity = {{{1.0, 0.0}, {0.0, 1.0}}};
  return c;
}

}  // namespace

stand_run::RunSummary run_virtually(const modbus::StandSetup& given, const stand_run::Plan& plan, stand_run::RunOptions o,
                                    const VirtualRunOptions& v, const stand_run::RunObserver& observer) {
  modbus::StandSetup setup = given;
  if (v.esc_pole_pairs > 0) setup.pole_pairs = v.esc_pole_pairs;
  VirtualStand stand(setup, config_of(v, setup, o.session.esc_index));
  tools::ToolNode tool(stand.bus());
  tools::EscTable table(tool);
  if (v.wind_m_s != 0.0) o.airspeed_m_s = v.wind_m_s;
  o.session.configured = [&stand](char configuration) {
    stand.rotor().set_configuration(configuration);
    return true;
  };
  stand_run::RunOnStand run(setup, plan, tool, table, o, o.commission.value_or(true), observer);
  run.facts.simulated = true;
  stand_run::Session& session = run.begin(table);
  const auto turn = [&] {
    if (observer.on_turn) observer.on_turn(session, stand.now_s());
  };
  constexpr double kMore = 3.0, kAtLeast_s = 120.0;  // settling and starts may take longer than planned; a run that hangs ends
  stand.run(session, kAtLeast_s + kMore * plan.typical_s(o.session.settle_s), turn);
  turn();
  if (!session.done())
    throw Error(
        {setup.path.generic_string(), "the run did not end: no reading of " + session.missing(), "", "bind axes to channels that are read"},
        ExitCode::device);
  run.write_facts();
  return summary_of(session);
}

}  // namespace rotorloop::virtual_stand
