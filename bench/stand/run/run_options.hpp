// What a run is asked for: sequences and speeds, what is known beside the stand file, and whether it may begin.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/prediction.hpp"
#include "bench/stand/run/sequence.hpp"
#include "bench/stand/run/session.hpp"

namespace rotorloop::stand_run {

struct RunOptions {
  std::filesystem::path out;  // new folder for the run
  std::vector<std::string> sequences{"staircase"};
  std::vector<double> rpm;  // LOW, HIGH; empty: a third to nine tenths of the stand's limit
  double idle_rpm = 1430.0;
  double supply_V = 16.0;  // for the predicted current
  SequenceOptions sequence;
  std::filesystem::path replay;  // CSV with rotor speed over time
  SessionOptions session;
  std::optional<bool> commission;       // the ESC measures R and L at rest before the run; not said: in virtual time alone
  std::optional<double> density_kg_m3;  // of the air, where no instrument measures it
  double airspeed_m_s = 0.0;            // of a wind tunnel along the axis, > 0 as in climb
  double listen_s = 2.0;                // for the ESC to say that it is there
  std::string version;                  // of the program, for run.toml
};

// Throws Error (usage): a sequence that is none, speeds that make no run, a replay that cannot be read.
Plan plan_of(const RunOptions& options, const modbus::StandSetup& setup);

// Throws Error before anything is armed: safety for a plan beyond the stand's limits, data_quality for an expired calibration, usage where
// nothing tells the density of the air.
void refuse_unsafe(const modbus::StandSetup& setup, const Plan& plan, const RunOptions& options);

}  // namespace rotorloop::stand_run
