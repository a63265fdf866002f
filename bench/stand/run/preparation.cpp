#include "bench/stand/run/preparation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::stand_run {
namespace {

std::string quoted(const std::string& s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string identity(const modbus::StandPart& p) { return p.name + " " + p.serial; }

}  // namespace

std::uint8_t EscFacts::duty_node() const {
  const auto says = [](const tools::NodeParameter& p) { return p.name == kDutyParameter; };
  return std::any_of(parameters.begin(), parameters.end(), says) ? node : std::uint8_t{0};
}

EscFacts find_esc(tools::ToolNode& tool, const tools::EscTable& table, const modbus::StandSetup& setup, int esc_index, double listen_s) {
  // The handlers outlive this function, and so does what they touch.
  auto flag = std::make_shared<bool>(false);
  tool.on<protocols::RpmCommand>([flag](const protocols::RpmCommand&, std::uint8_t) { *flag = true; });
  tool.on<protocols::RawCommand>([flag](const protocols::RawCommand&, std::uint8_t) { *flag = true; });
  tool.run_for(static_cast<std::int64_t>(listen_s * 1e9));
  tool.run_until(tool.now_ns() + 3'000'000'000, [&] { return tool.requests_open() == 0; });
  const std::string where = tool.bus().name();
  if (tool.id_conflict())
    throw Error({where, fmt::format("another node has id {}, that of this program", tool.node_id()), "another tool runs",
                 "end the other tool, or give --tool-id 127"},
                ExitCode::device);
  const tools::EscRow* row = table.of_index(esc_index);
  if (row == nullptr)
    throw Error({where, fmt::format("no ESC reports with esc_index {}", esc_index), "no power, another bit rate, or another index",
                 "look at: rotorloop esc list"},
                ExitCode::device);
  if (row->shares_index)
    throw Error({where, fmt::format("two nodes have esc_index {}: both would turn", esc_index), "",
                 "give one another index: rotorloop esc set esc_index"},
                ExitCode::safety);
  if (*flag)
    throw Error({where, "another node sends commands on this bus", "an autopilot or another tool is connected", "disconnect it"},
                ExitCode::safety);
  EscFacts f;
  f.node = row->node;
  const auto node = tool.nodes().find(f.node);
  if (node != tool.nodes().end() && node->second.info) {
    const auto& info = *node->second.info;
    f.name = tools::node_name(node->second), f.unique_id = tools::unique_id_text(node->second);
    f.software = fmt::format("{}.{} {:08x}", info.software_major, info.software_minor, info.vcs_commit);
    if ((info.software_flags & 2u) != 0) f.image_crc = fmt::format("{:016x}", info.image_crc);
  }
  f.parameters = tools::read_parameters(tool, f.node);
  if (node != tool.nodes().end()) f.parameter_file = tools::parameter_file(node->second, f.parameters);
  for (const tools::NodeParameter& p : f.parameters)
    if (p.name == "pole_pairs") f.pole_pairs = static_cast<int>(std::strtol(tools::value_text(p.value).c_str(), nullptr, 10));
  if (f.pole_pairs != 0 && f.pole_pairs != setup.pole_pairs)
    throw Error(
        {setup.path.generic_string(), fmt::format("the stand file says {} pole pairs, the ESC has {}", setup.pole_pairs, f.pole_pairs),
         "magnets counted instead of pairs, or the ESC is set up for another motor",
         "count the magnets of the bell: half of them are pairs; then correct esc.pole_pairs or the ESC's pole_pairs"},
        ExitCode::safety);
  return f;
}

std::string run_toml(const modbus::StandSetup& s, const RunFacts& f, const Session& session) {
  std::string out = "format = 1\n";
  out += fmt::format("motor = {}\npropeller = {}\nesc = {}\nstand = {}\npole_pairs = {}\ndiameter_m = {}\n", quoted(identity(s.motor)),
                     quoted(identity(s.propeller)), quoted(identity(s.esc)), quoted(s.name), s.pole_pairs, number_text(s.diameter_m));
  out += fmt::format("sequence = {}\nstarted_utc = {}\nversion = {}\nsimulated = {}\n", quoted(f.sequence), quoted(f.started_utc),
                     quoted(f.version), f.simulated);
  constexpr const char* kEnds[] = {"running", "done", "stopped", "tripped"};
  out += fmt::format("end = \"{}\"\n", kEnds[static_cast<std::size_t>(session.end())]);
  if (session.trip()) out += fmt::format("trip = {}\n", quoted(text(*session.trip())));
  const double temperature = session.air_mean(modbus::StandAxis::air_temperature),
               pressure = session.air_mean(modbus::StandAxis::air_pressure), humidity = session.air_mean(modbus::StandAxis::air_humidity);
  if (f.density_kg_m3) {
    out += fmt::format("[air]\ndensity_kg_m3 = {}\n", number_text(*f.density_kg_m3));
  } else if (std::isfinite(temperature) && std::isfinite(pressure)) {
    out += fmt::format("[air]\ntemperature_degC = {}\npressure_Pa = {}\n", number_text(temperature), number_text(pressure));
    if (std::isfinite(humidity)) out += fmt::format("humidity = {}\n", number_text(std::clamp(0.01 * humidity, 0.0, 1.0)));
  }
  if (f.airspeed_m_s != 0.0) out += fmt::format("[wind]\nairspeed_m_s = {}\n", number_text(f.airspeed_m_s));
  if (const auto& w = f.winding) {
    out += fmt::format(
        "[winding]\nphase_ohm = {}\nwinding_ohm = {}\ninductance_d_H = {}\ninductance_q_H = {}\nu_resistance = {}\nu_inductance = {}\n",
        number_text(w->phase_ohm), number_text(w->winding_ohm), number_text(w->inductance_d_H), number_text(w->inductance_q_H),
        number_text(kWindingU), number_text(kWindingU));
    if (std::isfinite(w->degC)) out += fmt::format("temperature_degC = {}\n", number_text(w->degC));
  }
  out += "[uncertainty]\n";
  for (const auto& [key, u] : s.uncertainty) out += fmt::format("{} = {}\n", key, number_text(u));
  for (const modbus::BoundChannel& a : s.axes) {
    const modbus::Profile& p = s.buses[a.bus].devices[a.device].profile;
    out += fmt::format("[[instrument]]\naxis = \"{}\"\nmodel = {}\nchannel = {}\nevidence = {}\nsource = {}\n", modbus::name(a.axis),
                       quoted(p.title()), quoted(p.channels[a.channel].name), quoted(p.evidence), quoted(p.source));
  }
  out +=
      fmt::format("[calibration]\ndate = \"{}\"\nexpires = \"{}\"\nstand_sha256 = \"{}\"\n", s.calibrated_on, s.expires_on, f.stand_sha256);
  out += fmt::format("[esc_node]\nnode = {}\nname = {}\nunique_id = {}\nsoftware = {}\nimage_crc = {}\n", f.esc.node, quoted(f.esc.name),
                     quoted(f.esc.unique_id), quoted(f.esc.software), quoted(f.esc.image_crc));
  out += "[esc_parameters]\n";
  for (const tools::NodeParameter& p : f.esc.parameters) out += fmt::format("\"{}\" = {}\n", p.name, quoted(tools::value_text(p.value)));
  return out;
}

}  // namespace rotorloop::stand_run
