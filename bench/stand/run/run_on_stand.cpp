#include "bench/stand/run/run_on_stand.hpp"

#include <fmt/format.h>

#include "bench/stand/run/esc_commissioning.hpp"
#include "bench/stand/run/port_pump.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"

namespace rotorloop::stand_run {

RunOnStand::RunOnStand(const modbus::StandSetup& setup, const Plan& plan, tools::ToolNode& tool, const tools::EscTable& table,
                       const RunOptions& o, bool commission, const RunObserver& observer)
    : setup_(setup), plan_(plan), tool_(tool), options_(o) {
  refuse_unsafe(setup, plan, o);
  facts.started_utc = RunClock().started_utc();
  facts.version = o.version;
  facts.stand_sha256 = sha256_file(setup.path);
  if (o.density_kg_m3) facts.air_density_kg_m3 = *o.density_kg_m3;
  if (o.airspeed_m_s != 0.0) facts.airspeed_m_s = o.airspeed_m_s;
  const int index = o.session.esc_index;
  esc_ = find_esc(tool, table, setup, index, o.listen_s);
  options_.session.esc_pole_pairs = esc_.pole_pairs;
  options_.session.duty_node = esc_.duty_node();
  options_.session.airspeed_m_s = o.airspeed_m_s;
  if (!commission) return;
  const auto say = [&](const std::string& line) {
    if (observer.say) observer.say(line);
  };
  say("the ESC measures resistance and inductance of the motor at rest …");
  facts.winding = measure_winding(tool, table, esc_, index);
  if (const auto& w = facts.winding)
    say(fmt::format("R {:.1f} mΩ, with switches {:.1f} mΩ; L_d {:.1f} µH, L_q {:.1f} µH", 1e3 * w->winding_ohm, 1e3 * w->phase_ohm,
                    1e6 * w->inductance_d_H, 1e6 * w->inductance_q_H));
}

Session& RunOnStand::begin(tools::EscTable& table) {
  files_.emplace(options_.out);
  return session_.emplace(setup_, plan_, tool_, table, *files_, options_.session);
}

void RunOnStand::write_facts() {
  const std::filesystem::path &folder = options_.out, inputs = folder / "inputs";
  write_text_file(folder / stand::kFactsFile, stand::run_toml(facts_of(facts, esc_, *session_)));
  if (std::filesystem::exists(inputs)) return;
  std::filesystem::create_directories(inputs);
  write_text_file(inputs / "esc_parameters.toml", esc_.parameter_file);
  std::error_code error;
  std::filesystem::copy_file(setup_.path, inputs / "stand.toml", error);
  if (error) throw Error({(inputs / "stand.toml").generic_string(), "cannot be written: " + error.message(), "", ""}, ExitCode::device);
}

std::optional<RunSummary> run_on_ports(const modbus::StandSetup& setup, const Plan& plan, const RunOptions& options, TimedBus& bus,
                                       const tools::ToolNodeConfig& node, const RunObserver& observer) {
  tools::ToolNode tool(bus, node);
  tools::EscTable table(tool);
  RunOnStand run(setup, plan, tool, table, options, options.commission.value_or(false), observer);
  if (tool.stopped()) return std::nullopt;
  PortPump pump(setup);
  Session& session = run.begin(table);
  const std::int64_t begun_ns = tool.now_ns();
  constexpr std::int64_t kFirstReadings_ns = 10'000'000'000;
  std::string missing;
  bool written = false;
  const auto turn = [&] {
    if (observer.on_turn) observer.on_turn(session, 1e-9 * static_cast<double>(bus.now_ns()));
  };
  pump.run(session, bus, [&] {
    turn();
    if (session.turning() && !written) {
      written = true;
      run.write_facts();
    }
    if (!session.turning() && !written && missing.empty() && tool.now_ns() - begun_ns > kFirstReadings_ns) {
      missing = session.missing();
      session.ask_stop("no readings");
    }
  });
  turn();
  if (!missing.empty())
    throw Error({setup.path.generic_string(), "nothing was armed: no reading of " + missing,
                 "a device without power, another address, A and B exchanged", "look at: rotorloop stand read PORT PROFILE"},
                ExitCode::device);
  run.write_facts();
  return summary_of(session);
}

}  // namespace rotorloop::stand_run
