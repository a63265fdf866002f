// Before a motor turns: the ESC on its bus, with everything that it is set to, and what a run writes about itself.
#pragma once
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/session.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/parameters.hpp"

namespace rotorloop::stand_run {

struct EscFacts {
  std::uint8_t node = 0;
  std::string name, unique_id, software, image_crc;  // image_crc "": the ESC does not know it
  int pole_pairs = 0;                                // 0: it has no such parameter
  std::vector<tools::NodeParameter> parameters;
  std::string parameter_file;      // as `esc params` writes it
  std::uint8_t duty_node() const;  // for SessionOptions; 0: it does not say what voltage it gives
};

// Listens for `listen_s`. Throws Error: device when no ESC has the index or it does not answer, safety when two have it, when another
// node sends commands, or when its pole pairs are not those of the stand file.
EscFacts find_esc(tools::ToolNode& tool, const tools::EscTable& table, const modbus::StandSetup& setup, int esc_index, double listen_s);

// What the ESC measured of its motor at rest (esc_commissioning.hpp).
struct WindingFacts {
  double phase_ohm = 0.0;    // one phase with its switches: what the current meets
  double winding_ohm = 0.0;  // less what the ESC knows of its switches: what a motor file holds
  double inductance_d_H = 0.0, inductance_q_H = 0.0;
  double degC =
      std::numeric_limits<double>::quiet_NaN();  // of the ESC, and of a motor that has not turned; not-a-number without a thermistor
};
// Relative standard uncertainties: a third of the limits that the commissioning is held to (docs/acceptance/esc_commissioning.md), 5 %.
inline constexpr double kWindingU = 0.017;

struct RunFacts {
  std::string started_utc, version;
  bool simulated = false;
  std::string sequence;
  EscFacts esc;
  std::optional<WindingFacts> winding;
  std::string stand_sha256;
  std::optional<double> density_kg_m3;  // given by a person; else of the instruments
  double airspeed_m_s = 0.0;            // along the axis, of a wind tunnel: > 0 as in climb
};

// run.toml: what `stand estimate` reads (docs/files.md, "Run folder of a stand"), and how the run ended.
std::string run_toml(const modbus::StandSetup& setup, const RunFacts& facts, const Session& session);

}  // namespace rotorloop::stand_run
