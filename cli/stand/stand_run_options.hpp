// What `stand run` and `stand demo` share: options of a run, a run in virtual time, and what is said at its end.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/preparation.hpp"
#include "bench/stand/run/sequence.hpp"
#include "bench/stand/virtual/virtual_stand.hpp"

namespace CLI {
class App;
}

namespace rotorloop::cli {

struct StandRunOptions {
  std::filesystem::path setup, out;
  std::vector<std::string> sequences{"staircase"};
  std::vector<double> rpm;  // LOW, HIGH; empty: a third to nine tenths of the stand's limit
  double idle_rpm = 1430.0, supply_V = 16.0;
  stand_run::SequenceOptions sequence;
  std::filesystem::path replay;
  stand_run::SessionOptions session;
  std::optional<bool> commission;  // the ESC measures R and L at rest before the run; not said: in virtual time alone
  std::optional<double> density_kg_m3;
  double airspeed_m_s = 0.0;
  bool json = false, jsonl = false, quiet = false, live = false;
  bool summary = true;  // one line about the run on stdout at its end, where neither json nor jsonl is asked for
  int live_port = 0;
};
void add_sequence_options(CLI::App& command, StandRunOptions& options);

// Plan and prediction of the options. Throws Error (usage).
stand_run::Plan plan_of(StandRunOptions& options, const modbus::StandSetup& setup);

struct VirtualRunOptions {
  std::filesystem::path plant = "vehicles/reference_plant.toml";
  std::uint64_t seed = 1;
  double wind_m_s = 0.0, strut = 0.08;
  bool perfect = false;  // a chain without errors
  int esc_pole_pairs = 0;
  std::string dies;
  double dies_at_s = 0.0, chipped_at_s = 0.0;
  double pace = 0.0;  // seconds of the stand in a second of the clock; 0: as fast as it goes
};
void add_virtual_options(CLI::App& command, VirtualRunOptions& options);

// Progress of a running session on stderr and, with jsonl, on stdout: one line for each step.
class RunTelling {
 public:
  RunTelling(const stand_run::Session& session, const StandRunOptions& options) : session_(session), options_(options) {}
  void operator()();

 private:
  const stand_run::Session& session_;
  const StandRunOptions& options_;
  std::size_t told_ = 0;
};

// Runs all of it in virtual time and writes the run folder. Returns the exit code (exit_of).
int run_virtually(StandRunOptions& options, const VirtualRunOptions& virtual_options, const modbus::StandSetup& setup,
                  const stand_run::Plan& plan);

// What the command knows of a run that run.toml says.
stand::RunFacts given_facts(const StandRunOptions& options, const modbus::StandSetup& setup);
// What the ESC measures of its motor at rest, told on stderr; nothing when the tool was stopped meanwhile.
std::optional<stand::MeasuredWinding> measured_winding(const StandRunOptions& options, tools::ToolNode& tool, const tools::EscTable& table,
                                                       const stand_run::EscFacts& esc);
// run.toml, the stand file and the ESC's parameters.
void write_facts(const std::filesystem::path& folder, const stand::RunFacts& given, const stand_run::EscFacts& esc,
                 const stand_run::Session& session);
// Says how it ended; 0, 4 tripped, 5 steps that did not settle.
int tell_end(const StandRunOptions& options, const stand_run::Session& session);

}  // namespace rotorloop::cli
