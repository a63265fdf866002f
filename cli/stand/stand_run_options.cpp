#include "cli/stand/stand_run_options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "bench/stand/evaluate/compare/paired_steps.hpp"
#include "bench/stand/run/esc_commissioning.hpp"
#include "bench/stand/run/prediction.hpp"
#include "bench/sysid/log/column_table.hpp"
#include "bench/sysid/log/log_reader.hpp"
#include "cli/shipped_files.hpp"
#include "cli/stand/run_page.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::cli {
namespace {

constexpr double kMostUnsettled = 0.2;  // of the steps: more, and the run says little of steady thrust

std::vector<stand_run::ReplayPoint> read_replay(const std::filesystem::path& path) {
  const log::ColumnTable t = log::parse_csv(log::read_log_bytes(path), path, nullptr, {});
  const auto first = [&](std::initializer_list<std::pair<const char*, double>> names) -> std::pair<const std::vector<double>*, double> {
    for (const auto& [n, factor] : names)
      if (t.has(n)) return {&t.columns.at(n), factor};
    return {nullptr, 0.0};
  };
  const auto [time, s_per_unit] = first({{"t_s", 1.0}, {"time_s", 1.0}, {"time_us", 1e-6}, {"t_us", 1e-6}});
  const auto [speed, rad_s_per_unit] = first({{"omega_rad_s", 1.0},
                                              {"omega_1_rad_s", 1.0},
                                              {"omega1_rad_s", 1.0},
                                              {"rotor_1_rad_s", 1.0},
                                              {"rpm", kRad_s_per_rpm},
                                              {"rpm_1", kRad_s_per_rpm}});
  if (time == nullptr || speed == nullptr)
    throw Error({path.generic_string(), "has no time and rotor speed that are known", "another program's file",
                 "give a CSV with t_s and omega_rad_s (or rpm)"});
  std::vector<stand_run::ReplayPoint> out;
  for (std::size_t i = 0; i < time->size(); ++i)
    if (const double w = std::abs((*speed)[i]) * rad_s_per_unit;
        std::isfinite(w) && std::isfinite((*time)[i]) && (out.empty() || (*time)[i] * s_per_unit > out.back().t_s))
      out.push_back({(*time)[i] * s_per_unit, w});
  return out;
}

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

std::optional<stand::PairedDifference> paired(const stand_run::Session& session, bool thrust) {
  std::vector<stand::PairedStep> steps;
  for (const auto& s : session.steps())
    steps.push_back({s.configuration, s.wanted_rad_s, s.t_s, s.omega_rad_s, thrust ? s.thrust_N : s.torque_N_m});
  return stand::paired_difference(steps);
}

}  // namespace

void add_sequence_options(CLI::App& c, StandRunOptions& o) {
  c.add_option("-o,--out", o.out, "new folder for the run");
  c.add_option("--sequence", o.sequences, fmt::format("one or several of {}", fmt::join(stand_run::kSequences, ", ")))
      ->delimiter(',')
      ->capture_default_str();
  c.add_option("--rpm", o.rpm, "LOW,HIGH; default: a third to nine tenths of the stand file's limit")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::PositiveNumber);
  c.add_option("--idle", o.idle_rpm, "RPM at which torque is next to nothing and the motor still runs smoothly")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  c.add_option("--levels", o.sequence.levels, "speeds of a staircase")->capture_default_str();
  c.add_option("--hold", o.sequence.hold_s, "seconds that are averaged at each speed")
      ->check(CLI::Range(0.2, 600.0))
      ->capture_default_str();
  c.add_option("--settle", o.session.settle_s, "seconds after each change of speed at least")
      ->check(CLI::Range(0.5, 60.0))
      ->capture_default_str();
  c.add_option("--zero", o.sequence.zero_s, "seconds of each zero")->check(CLI::Range(0.5, 600.0))->capture_default_str();
  c.add_option("--repeats", o.sequence.repeats,
               fmt::format("pairs of steps, or of A and B; default: {} and {}", stand_run::kStepPairs, stand_run::kAbabPairs));
  c.add_option("--step-share", o.sequence.step_share, "size of steps about the middle, share of it")
      ->check(CLI::Range(0.005, 0.2))
      ->capture_default_str();
  c.add_option("--duration", o.sequence.endurance_s, "seconds of endurance")->check(CLI::Range(10.0, 7200.0))->capture_default_str();
  c.add_option("--replay", o.replay, "CSV with rotor speed over time, for the sequence replay");
  c.add_option("--order-seed", o.sequence.seed, "of shuffled levels")->capture_default_str();
  c.add_option("--supply", o.supply_V, "supply voltage, V, for the predicted current")
      ->check(CLI::Range(1.0, 200.0))
      ->capture_default_str();
  c.add_option("--density", o.density_kg_m3, "of the air, kg/m³, where no instrument measures it")->check(CLI::Range(0.5, 1.6));
  c.add_option("--airspeed", o.airspeed_m_s, "of a wind tunnel along the axis, m/s, above 0 as in climb: goes into the run for c_q(J)")
      ->check(CLI::Range(-100.0, 100.0));
  c.add_option("--index", o.session.esc_index, "esc_index of the motor, from 0")->check(CLI::Range(0, 15))->capture_default_str();
  c.add_flag_function(
      "--commission,!--no-commission", [&o](std::int64_t times) { o.commission = times > 0; },
      "before the run a rotorloop ESC measures R and L of the motor at rest, 5 s with up to the motor's current; default: in virtual time "
      "alone");
  c.add_flag("--json", o.json, "one JSON document at the end on stdout");
  c.add_flag("--jsonl", o.jsonl, "a JSON line for each step on stdout");
  c.add_flag("-q,--quiet", o.quiet, "no progress on stderr");
}

void add_virtual_options(CLI::App& c, VirtualRunOptions& o) {
  c.add_option("--plant", o.plant, "plant file: drive and propeller are those of its first rotor")->capture_default_str();
  c.add_option("--seed", o.seed, "of board, noise, and errors of the measuring chain")->capture_default_str();
  c.add_option("--wind", o.wind_m_s, "axial wind through the virtual rotor, m/s")->check(CLI::Range(-20.0, 30.0));
  c.add_option("--strut", o.strut, "share of the thrust that configuration B of abab loses")
      ->check(CLI::Range(0.0, 0.5))
      ->capture_default_str();
  c.add_flag("--perfect", o.perfect, "a measuring chain without errors");
  c.add_option("--esc-pole-pairs", o.esc_pole_pairs, "pole pairs that ESC and stand file are set to, to see a mistake found")
      ->check(CLI::Range(1, 30));
  c.add_option("--pace", o.pace, "seconds of the stand in one second of the clock; 0: as fast as it goes; with --live 1 unless given")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  c.add_option("--chipped-at", o.chipped_at_s, "seconds after which a blade lacks a piece: the mount shakes")->group("");
  c.add_option("--dies", o.dies, "name of an instrument that falls silent")->group("");
  c.add_option("--dies-at", o.dies_at_s, "seconds")->group("");
}

stand_run::Plan plan_of(StandRunOptions& o, const modbus::StandSetup& setup) {
  const double most = setup.limits.at("omega_rad_s").max;
  o.sequence.low_rad_s = o.rpm.size() == 2 ? o.rpm[0] * kRad_s_per_rpm : most / 3.0;
  o.sequence.high_rad_s = o.rpm.size() == 2 ? o.rpm[1] * kRad_s_per_rpm : 0.9 * most;
  o.sequence.idle_rad_s = o.idle_rpm * kRad_s_per_rpm;
  if (!o.replay.empty()) o.sequence.replay = read_replay(o.replay);
  return stand_run::make_plan(o.sequences, o.sequence);
}

void RunTelling::operator()() {
  for (; told_ < session_.steps().size(); ++told_) {
    const stand_run::StepMeans& s = session_.steps()[told_];
    if (options_.jsonl) {
      fmt::print("{}\n", step_json(s).dump());
      std::fflush(stdout);
    }
    if (!options_.quiet)
      fmt::print(stderr, "[{}/{}] {:>6.1f} s  {:>7.0f} RPM  {:>8.4f} N  {:>9.6f} N m  {:>6.2f} V  {:>6.2f} A{}{}{}\n",
                 session_.segment() + 1, session_.plan().segments.size(), s.t_s, s.omega_rad_s * kRpm_per_rad_s, s.thrust_N, s.torque_N_m,
                 s.voltage_V, s.current_A, s.configuration == 'B' ? "  B" : "", s.settled ? "" : "  unsettled",
                 s.limited ? "  limited" : "");
  }
}

stand::RunFacts given_facts(const StandRunOptions& o, const modbus::StandSetup& setup) {
  stand::RunFacts f;
  f.started_utc = RunClock().started_utc();
  f.version = std::string("rotorloop ") + kVersion + " (" + kGit + ")";
  f.stand_sha256 = sha256_file(setup.path);
  if (o.density_kg_m3) f.air_density_kg_m3 = *o.density_kg_m3;
  if (o.airspeed_m_s != 0.0) f.airspeed_m_s = o.airspeed_m_s;
  return f;
}

void write_facts(const std::filesystem::path& folder, const stand::RunFacts& given, const stand_run::EscFacts& esc,
                 const stand_run::Session& session) {
  write_text_file(folder / stand::kFactsFile, stand::run_toml(stand_run::facts_of(given, esc, session)));
  if (std::filesystem::exists(folder / "inputs")) return;
  std::filesystem::create_directories(folder / "inputs");
  write_text_file(folder / "inputs" / "esc_parameters.toml", esc.parameter_file);
  std::error_code error;
  std::filesystem::copy_file(session.setup().path, folder / "inputs" / "stand.toml", error);
  if (error)
    throw Error({(folder / "inputs" / "stand.toml").generic_string(), "cannot be written: " + error.message(), "", ""}, ExitCode::device);
}

std::optional<stand::MeasuredWinding> measured_winding(const StandRunOptions& o, tools::ToolNode& tool, const tools::EscTable& table,
                                                       const stand_run::EscFacts& esc) {
  if (!o.quiet) fmt::print(stderr, "the ESC measures resistance and inductance of the motor at rest …\n");
  const auto w = stand_run::measure_winding(tool, table, esc, o.session.esc_index);
  if (w && !o.quiet)
    fmt::print(stderr, "R {:.1f} mΩ, with switches {:.1f} mΩ; L_d {:.1f} µH, L_q {:.1f} µH\n", 1e3 * w->winding_ohm, 1e3 * w->phase_ohm,
               1e6 * w->inductance_d_H, 1e6 * w->inductance_q_H);
  return w;
}

int tell_end(const StandRunOptions& o, const stand_run::Session& session) {
  std::size_t unsettled = 0;
  for (const auto& s : session.steps()) unsettled += !s.settled;
  const auto thrust = paired(session, true), torque = paired(session, false);
  const bool tripped = session.end() == stand_run::RunEnd::tripped;
  if (o.json) {
    nlohmann::ordered_json j{{"run", o.out.generic_string()},
                             {"end", tripped                                    ? "tripped"
                                     : session.end() == stand_run::RunEnd::done ? "done"
                                                                                : "stopped"},
                             {"steps", session.steps().size()},
                             {"unsettled", unsettled}};
    if (session.trip()) j["trip"] = stand_run::text(*session.trip());
    for (const auto& [key, d] : {std::pair{"B_takes_of_thrust", &thrust}, std::pair{"B_takes_of_torque", &torque}})
      if (*d) j[key] = {{"share", (*d)->share}, {"u", (*d)->u}, {"low", (*d)->low}, {"high", (*d)->high}, {"pairs", (*d)->pairs}};
    fmt::print("{}\n", j.dump(1));
  } else if (!o.jsonl && o.summary) {
    fmt::print("{}: {} steps, {} unsettled\n", o.out.generic_string(), session.steps().size(), unsettled);
    for (const auto& [what, d] : {std::pair{"thrust", &thrust}, std::pair{"torque", &torque}})
      if (*d)
        fmt::print("configuration B takes {:.2f} % of the {} ± {:.2f} % (95 %, {} pairs)\n", 100.0 * (*d)->share, what,
                   50.0 * ((*d)->high - (*d)->low), (*d)->pairs);
  }
  if (session.trip())
    fmt::print(stderr, "stopped: {}; the two seconds before are in {}\n", stand_run::text(*session.trip()),
               (o.out / stand::kTripFile).generic_string());
  if (tripped) return to_int(ExitCode::safety);
  return session.steps().empty() || static_cast<double>(unsettled) > kMostUnsettled * static_cast<double>(session.steps().size())
             ? to_int(ExitCode::data_quality)
             : 0;
}

int run_virtually(StandRunOptions& o, const VirtualRunOptions& v, const modbus::StandSetup& given, const stand_run::Plan& plan) {
  modbus::StandSetup setup = given;
  if (v.esc_pole_pairs > 0) setup.pole_pairs = v.esc_pole_pairs;
  virtual_stand::VirtualStandConfig c;
  c.rotor.plant = shipped_or_given(v.plant, share_folder());
  c.rotor.axial_wind_m_s = v.wind_m_s, c.rotor.thrust_lost = v.strut, c.rotor.esc_index = o.session.esc_index,
  c.rotor.pole_pairs = v.esc_pole_pairs;
  c.rotor.seed = c.seed = v.seed;
  c.dies = v.dies, c.dies_at_s = v.dies_at_s, c.chipped_at_s = v.chipped_at_s;
  if (v.perfect)
    c.properties.noise = {}, c.properties.division = {}, c.properties.creep_share = 0.0;
  else
    c.errors = virtual_stand::drawn_errors(v.seed, setup.calibration.full_scale);
  // The shipped matrix is that of its cells: what is drawn is what a calibration leaves.
  c.errors.sensitivity = {{{1.0, 0.0}, {0.0, 1.0}}};
  virtual_stand::VirtualStand stand(setup, c);
  tools::ToolNode tool(stand.bus());
  tools::EscTable table(tool);
  if (v.wind_m_s != 0.0) o.airspeed_m_s = v.wind_m_s;
  stand::RunFacts facts = given_facts(o, setup);
  facts.simulated = true;
  const stand_run::EscFacts esc = stand_run::find_esc(tool, table, setup, o.session.esc_index, 2.0);
  if (o.commission.value_or(true)) facts.winding = measured_winding(o, tool, table, esc);
  stand_run::RunFiles files(o.out);
  o.session.esc_pole_pairs = esc.pole_pairs, o.session.duty_node = esc.duty_node();
  o.session.configured = [&stand](char configuration) {
    stand.rotor().set_configuration(configuration);
    return true;
  };
  stand_run::Session session(setup, plan, tool, table, files, o.session);
  RunTelling tell(session, o);
  constexpr double kMore = 3.0, kAtLeast_s = 120.0;  // settling and starts may take longer than planned; a run that hangs ends
  std::optional<RunPage> page;
  if (o.live) page.emplace(o.live_port);
  RunPace pace(o.live && v.pace == 0.0 ? 1.0 : v.pace);
  stand.run(session, kAtLeast_s + kMore * plan.typical_s(o.session.settle_s), [&] {
    tell();
    if (page) (*page)(session);
    pace.wait(stand.now_s());
  });
  tell();
  if (page) (*page)(session);
  if (!session.done())
    throw Error(
        {setup.path.generic_string(), "the run did not end: no reading of " + session.missing(), "", "bind axes to channels that are read"},
        ExitCode::device);
  write_facts(o.out, facts, esc, session);
  return tell_end(o, session);
}

}  // namespace rotorloop::cli
