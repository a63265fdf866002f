// Code-to-code comparisons of the rotor, drive and airframe models with recorded outputs of other programs, each in that
// program's own conventions. The recordings stay in the data folder; docs/acceptance/rotor_oracles.md discusses every figure.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "sim/rotor/reference/conventions.hpp"

namespace rotorloop::propeller {

struct OracleRow {
  std::string source;     // program and recording
  std::string condition;  // of the case
  std::string quantity;   // with its unit
  double recorded = 0.0;
  double ours = 0.0;
  double deviation = 0.0;  // relative to the recorded value, or to the scale that `note` names
  double limit = 0.0;      // on |deviation|; 0: for information, judged by nobody
  std::string note;

  bool judged() const { return limit > 0.0; }
  bool met() const { return !judged() || (deviation <= limit && deviation >= -limit); }
};

// Applied to an oracle's conventions before it solves: shows that a limit notices a choice left out.
using ConventionChange = std::function<void(sim::RotorConventions&)>;

// `data` is the folder that ROTORLOOP_DATA names. Throw Error with the file's name when a recording is missing or malformed.
std::vector<OracleRow> qprop_oracle(const std::filesystem::path& data, const ConventionChange& change = {});       // CAM 6x3
std::vector<OracleRow> agilicious_oracle(const std::filesystem::path& data, const ConventionChange& change = {});  // 12 rotor cases
std::vector<OracleRow> jsbsim_rotor_oracle(const std::filesystem::path& data, const ConventionChange& change = {});
std::vector<OracleRow> jsbsim_drive_oracle(const std::filesystem::path& data);
std::vector<OracleRow> rigid_body_oracle(const std::filesystem::path& data);  // RotorPy and Agilicious, given loads
std::vector<OracleRow> rotor_oracles(const std::filesystem::path& data);      // all of these

// One line per row, columns aligned, misses marked. For stdout.
std::string oracle_table(const std::vector<OracleRow>& rows);

}  // namespace rotorloop::propeller
