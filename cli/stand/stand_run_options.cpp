#include "cli/stand/stand_run_options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/shipped_files.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

nlohmann::ordered_json step_json(const stand_run::StepMeans& s) {
  return {{"event", "step"},
          {"step", s.number},
          {"configuration", std::string(1, s.configuration)},
          {"wanted_rad_s", s.wanted_rad_s},
          {"omega_rad_s", s.omega_rad_s},
          {"thrust_N", s.thrust_N},
          {"torque_N_m", s.torque_N_m},
          {"samples", s.samples},
          {"settled", s.settled},
          {"limited", s.limited}};
}

}  // namespace

StandRunOptions::StandRunOptions() { version = std::string("rotorloop ") + kVersion + " (" + kGit + ")"; }

void add_sequence_options(CLI::App& c, StandRunOptions& o) {
  c.add_option("-o,--out", o.out, "run folder to create");
  c.add_option("--sequence", o.sequences, fmt::format("one or several of {}", fmt::join(stand_run::kSequences, ", ")))
      ->delimiter(',')
      ->capture_default_str();
  c.add_option("--rpm", o.rpm, "LOW,HIGH: speed range, RPM; default: 1/3 to 9/10 of the limit in the stand file")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::PositiveNumber);
  c.add_option("--idle", o.idle_rpm, "idle speed, RPM: torque almost zero, and the motor still runs smoothly")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  c.add_option("--levels", o.sequence.levels, "number of speeds of a staircase")->capture_default_str();
  c.add_option("--hold", o.sequence.hold_s, "averaging time at each speed, s")->check(CLI::Range(0.2, 600.0))->capture_default_str();
  c.add_option("--settle", o.session.settle_s, "shortest settling time after each change of speed, s")
      ->check(CLI::Range(0.5, 60.0))
      ->capture_default_str();
  c.add_option("--zero", o.sequence.zero_s, "duration of each zero measurement, s")->check(CLI::Range(0.5, 600.0))->capture_default_str();
  c.add_option("--repeats", o.sequence.repeats,
               fmt::format("pairs of steps, or of A and B; default: {} and {}", stand_run::kStepPairs, stand_run::kAbabPairs));
  c.add_option("--step-share", o.sequence.step_share, "size of the speed steps, as a fraction of the middle speed")
      ->check(CLI::Range(0.005, 0.2))
      ->capture_default_str();
  c.add_option("--duration", o.sequence.endurance_s, "duration of the sequence endurance, s")
      ->check(CLI::Range(10.0, 7200.0))
      ->capture_default_str();
  c.add_option("--replay", o.replay, "CSV with rotor speed over time, for the sequence replay");
  c.add_option("--order-seed", o.sequence.seed, "seed for the order of the sequence shuffled")->capture_default_str();
  c.add_option("--supply", o.supply_V, "supply voltage, V, for the predicted current")
      ->check(CLI::Range(1.0, 200.0))
      ->capture_default_str();
  c.add_option("--density", o.density_kg_m3, "air density, kg/m³, if no instrument measures it")->check(CLI::Range(0.5, 1.6));
  c.add_option("--airspeed", o.airspeed_m_s,
               "air speed of a wind tunnel along the axis, m/s, positive as in climb; stored in the run for c_q(J)")
      ->check(CLI::Range(-100.0, 100.0));
  c.add_option("--index", o.session.esc_index, "esc_index of the motor, from 0")->check(CLI::Range(0, 15))->capture_default_str();
  c.add_flag_function(
      "--commission,!--no-commission", [&o](std::int64_t times) { o.commission = times > 0; },
      "before the run let a rotorloop ESC measure R and L of the motor at rest (5 s, up to the current limit of the motor); default: only "
      "with --virtual");
  c.add_flag("--json", o.json, "print one JSON document at the end");
  c.add_flag("--jsonl", o.jsonl, "print one JSON line for each step");
  c.add_flag("-q,--quiet", o.quiet, "no progress on stderr");
}

void add_virtual_options(CLI::App& c, VirtualOptions& o) {
  c.add_option("--plant", o.plant, "plant file; motor, inverter and propeller of its first rotor are used")->capture_default_str();
  c.add_option("--seed", o.seed, "seed of board tolerances, noise and instrument errors")->capture_default_str();
  c.add_option("--wind", o.wind_m_s, "axial wind through the virtual rotor, m/s")->check(CLI::Range(-20.0, 30.0));
  c.add_option("--strut", o.strut, "fraction of the thrust that configuration B of the sequence abab loses")
      ->check(CLI::Range(0.0, 0.5))
      ->capture_default_str();
  c.add_flag("--perfect", o.perfect, "instruments without errors");
  c.add_option("--esc-pole-pairs", o.esc_pole_pairs,
               "number of pole pairs set in ESC and stand file; a wrong one shows how the mistake is detected")
      ->check(CLI::Range(1, 30));
  c.add_option("--pace", o.pace, "simulated seconds per second of real time; 0: as fast as possible; default with --live: 1")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  c.add_option("--chipped-at", o.chipped_at_s, "seconds after which a blade lacks a piece: the mount shakes")->group("");
  c.add_option("--dies", o.dies, "name of an instrument that falls silent")->group("");
  c.add_option("--dies-at", o.dies_at_s, "seconds")->group("");
}

void RunProgress::operator()(const stand_run::Session& session) {
  for (; printed_ < session.steps().size(); ++printed_) {
    const stand_run::StepMeans& s = session.steps()[printed_];
    if (options_.jsonl) {
      fmt::print("{}\n", step_json(s).dump());
      std::fflush(stdout);
    }
    if (!options_.quiet)
      fmt::print(stderr, "[{}/{}] {:>6.1f} s  {:>7.0f} RPM  {:>8.4f} N  {:>9.6f} N m  {:>6.2f} V  {:>6.2f} A{}{}{}\n",
                 session.segment() + 1, session.plan().segments.size(), s.t_s, s.omega_rad_s * kRpm_per_rad_s, s.thrust_N, s.torque_N_m,
                 s.voltage_V, s.current_A, s.configuration == 'B' ? "  B" : "", s.settled ? "" : "  unsettled",
                 s.limited ? "  limited" : "");
  }
}

int print_end(const StandRunOptions& o, const stand_run::RunSummary& s) {
  if (o.json) {
    fmt::print("{}\n", stand_run::summary_json(o.out, s).dump(1));
  } else if (!o.jsonl && o.summary) {
    fmt::print("{}: {} steps, {} unsettled\n", o.out.generic_string(), s.steps, s.unsettled);
    for (const auto& [what, d] : {std::pair{"thrust", &s.thrust}, std::pair{"torque", &s.torque}})
      if (*d)
        fmt::print("configuration B takes {:.2f} % of the {} ± {:.2f} % (95 %, {} pairs)\n", 100.0 * (*d)->share, what,
                   50.0 * ((*d)->high - (*d)->low), (*d)->pairs);
  }
  if (s.trip)
    fmt::print(stderr, "stopped: {}; the two seconds before are in {}\n", stand_run::text(*s.trip),
               (o.out / stand::kTripFile).generic_string());
  if (s.end == stand_run::RunEnd::tripped) return to_int(ExitCode::safety);
  return s.steady() ? 0 : to_int(ExitCode::data_quality);
}

RunScreen::RunScreen(const StandRunOptions& o, double pace) : progress_(o), pace_(pace) {
  if (o.live) page_.emplace(o.live_port);
  if (!o.quiet) observer.say = [](const std::string& line) { fmt::print(stderr, "{}\n", line); };
  observer.on_turn = [this](stand_run::Session& session, double now_s) {
    progress_(session);
    if (page_) (*page_)(session);
    pace_.wait(now_s);
  };
}

int run_virtually(StandRunOptions& o, VirtualOptions& v, const modbus::StandSetup& setup, const stand_run::Plan& plan) {
  v.plant = shipped_or_given(v.plant);
  RunScreen screen(o, o.live && v.pace == 0.0 ? 1.0 : v.pace);
  return print_end(o, virtual_stand::run_virtually(setup, plan, o, v, screen.observer));
}

}  // namespace rotorloop::cli
