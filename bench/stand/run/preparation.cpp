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
    f.name = tools::node_name(node->second);
    f.unique_id = tools::unique_id_text(node->second);
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

stand::RunFacts facts_of(stand::RunFacts f, const EscFacts& esc, const Session& session) {
  const modbus::StandSetup& s = session.setup();
  f.motor = identity(s.motor);
  f.propeller = identity(s.propeller);
  f.esc = identity(s.esc);
  f.stand = s.name;
  f.pole_pairs = s.pole_pairs;
  f.diameter_m = s.diameter_m;
  f.uncertainty = s.uncertainty;
  f.calibrated_on = s.calibrated_on;
  f.calibration_expires = s.expires_on;
  f.sequence = fmt::format("{}", fmt::join(session.plan().names, ","));
  f.end = name(session.end());
  if (session.trip()) f.trip = text(*session.trip());
  const double temperature = session.air_mean(modbus::StandAxis::air_temperature),
               pressure = session.air_mean(modbus::StandAxis::air_pressure), humidity = session.air_mean(modbus::StandAxis::air_humidity);
  if (std::isfinite(temperature) && std::isfinite(pressure)) {
    f.air_temperature_degC = temperature;
    f.air_pressure_Pa = pressure;
  }
  if (std::isfinite(humidity)) f.air_humidity = std::clamp(0.01 * humidity, 0.0, 1.0);
  f.instruments.clear();
  for (const modbus::BoundChannel& a : s.axes) {
    const modbus::Profile& p = s.buses[a.bus].devices[a.device].profile;
    f.instruments.push_back({std::string(modbus::name(a.axis)), p.title(), p.channels[a.channel].name, p.evidence, p.source});
  }
  f.esc_node = esc.node;
  f.esc_name = esc.name;
  f.esc_unique_id = esc.unique_id;
  f.esc_software = esc.software;
  f.esc_image_crc = esc.image_crc;
  for (const tools::NodeParameter& p : esc.parameters) f.esc_parameters.emplace_back(p.name, tools::value_text(p.value));
  return f;
}

}  // namespace rotorloop::stand_run
