// A whole run, from the ESC on its bus to the folder that it leaves: what runs on ports and in virtual time share, and the run on ports.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "bench/stand/run/preparation.hpp"
#include "bench/stand/run/run_options.hpp"
#include "bench/stand/run/run_summary.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop::stand_run {

// What a caller hears of a run while it goes on. A function that is not given is not called.
struct RunObserver {
  std::function<void(const std::string& line)> say;             // for people
  std::function<void(Session& session, double now_s)> on_turn;  // every 20 ms of the bus's time, and once at the end; may ask for a stop
};

class RunOnStand {
 public:
  // Finds the ESC and, with `commission`, lets it measure its motor. Throws Error as find_esc and measure_winding do.
  RunOnStand(const modbus::StandSetup& setup, const Plan& plan, tools::ToolNode& tool, const tools::EscTable& table,
             const RunOptions& options, bool commission, const RunObserver& observer);
  // Makes the folder. Throws Error as RunFiles does.
  Session& begin(tools::EscTable& table);
  // run.toml; the first time also the stand file and the ESC's parameters. Throws Error (device).
  void write_facts();
  stand::RunFacts facts;  // of what is known before the run

 private:
  const modbus::StandSetup& setup_;
  const Plan& plan_;
  tools::ToolNode& tool_;
  RunOptions options_;
  EscFacts esc_;
  std::optional<RunFiles> files_;
  std::optional<Session> session_;
};

// On the ports of the stand file and an ESC on `bus`; `node.stop` ends the wait for the ESC. Nothing when it was stopped before the run
// began. Throws Error as refuse_unsafe does, and: device for a port, an ESC or an instrument that is not there, safety for an ESC that
// does not fit the stand file.
std::optional<RunSummary> run_on_ports(const modbus::StandSetup& setup, const Plan& plan, const RunOptions& options, TimedBus& bus,
                                       const tools::ToolNodeConfig& node, const RunObserver& observer);

}  // namespace rotorloop::stand_run
