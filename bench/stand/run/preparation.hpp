// Before a motor turns: the ESC on its bus, with everything that it is set to, and what a run writes about itself.
#pragma once
#include <string>
#include <vector>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/session.hpp"
#include "bench/stand/run_folder.hpp"
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

// What run.toml says of a run: to what the caller gives (when and by what it was made, the winding, density and airspeed of a person) comes
// what stand file, ESC and session know, and how the run has ended so far.
stand::RunFacts facts_of(stand::RunFacts given, const EscFacts& esc, const Session& session);

}  // namespace rotorloop::stand_run
