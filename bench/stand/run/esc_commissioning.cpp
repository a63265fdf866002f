#include "bench/stand/run/esc_commissioning.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <memory>

#include "host/base/error.hpp"
#include "host/tools/commission.hpp"

namespace rotorloop::stand_run {
namespace {

constexpr std::int64_t kLook_ns = 5'000'000;
// Relative standard uncertainty: a third of the limits that the commissioning is held to (docs/acceptance/esc_commissioning.md), 5 %.
constexpr double kWindingU = 0.017;

// "R 64.3 mohm with switches, L_d …": the parameter holds the winding alone.
std::optional<double> phase_ohm_of(const std::string& said) {
  if (!said.starts_with("R ") || said.find(" mohm with switches") == std::string::npos) return std::nullopt;
  return 1e-3 * std::strtod(said.c_str() + 2, nullptr);
}

double value_of(const tools::CommissionReport& report, const std::string& name) {
  for (const tools::CommissionedValue& m : report.measured)
    if (m.name == name) return std::strtod(tools::value_text(m.value).c_str(), nullptr);
  return 0.0;
}

}  // namespace

std::optional<stand::MeasuredWinding> measure_winding(tools::ToolNode& tool, const tools::EscTable& table, const EscFacts& esc,
                                                      int esc_index) {
  stand::MeasuredWinding w;
  w.u_resistance = w.u_inductance = kWindingU;
  const tools::EscRow* row = table.of_index(esc_index);
  if (row != nullptr) w.degC = static_cast<double>(row->status.temperature_K) - 273.15;
  // Requests that are open and the listener for messages outlive this function: the tool keeps what they touch.
  auto phase_ohm = std::make_shared<std::optional<double>>();
  auto commission =
      std::make_shared<tools::Commission>(tool, esc.node, tools::CommissionOptions{.spin = false}, [phase_ohm](const std::string& said) {
        if (const auto ohm = phase_ohm_of(said)) *phase_ohm = ohm;
      });
  tool.on<protocols::LogMessage>([commission](const protocols::LogMessage&, std::uint8_t) {});
  commission->begin();
  while (!commission->over()) {
    tool.poll();
    commission->step(!tool.stopped());
    tool.bus().wait_until(tool.now_ns() + kLook_ns);
  }
  if (tool.stopped()) return std::nullopt;
  const tools::CommissionReport report = commission->finish();
  const std::string where = fmt::format("node {}", esc.node);
  if (!report.done())
    throw Error({where, "the commissioning before the run " + report.end,
                 "a phase that is open, a supply that limits its current, a rotor that is held",
                 "look at: rotorloop esc log; or give --no-commission, and R and K_v come from the run's power alone"},
                ExitCode::safety);
  for (const tools::CommissionedValue& m : report.measured)
    tools::set_parameter(tool, esc.node, tools::read_parameter(tool, esc.node, m.name), m.before);
  if (!*phase_ohm)
    throw Error({where, "its message of the resistance did not arrive", "frames lost on the bus", "begin again"}, ExitCode::device);
  const double mean_H = value_of(report, "inductance"), ratio = value_of(report, "inductance_ratio");
  w.phase_ohm = **phase_ohm;
  w.winding_ohm = value_of(report, "resistance");
  w.inductance_d_H = 2.0 * mean_H / (1.0 + ratio);
  w.inductance_q_H = ratio * w.inductance_d_H;
  return w;
}

}  // namespace rotorloop::stand_run
