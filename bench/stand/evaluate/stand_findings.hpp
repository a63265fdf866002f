// What the diagnosis of a thrust stand's files says: of each file, of each of its channels, and of all together.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/evaluate/stand_checks.hpp"
#include "bench/sysid/diagnose/verdict.hpp"
#include "host/base/block_fit.hpp"

namespace rotorloop::stand {

// One effect against what c ω² leaves of one channel.
struct StandCandidate {
  std::string id;                                        // effects/catalogue.toml where it has one
  std::string law;                                       // what is added to c ω²
  std::vector<diagnose::NamedValue> parameters;          // its coefficients; u holds for correlated neighbours
  double z = 0.0;                                        // of its coefficients together, in standard errors
  double rms = 0.0;                                      // with it, of all points
  double held_out_rms_before = 0.0, held_out_rms = 0.0;  // on runs that did not estimate it
  RmsReduction held_out_fall;                            // of that rms, with its 95 % interval
  bool of_the_rotor = true;                              // false: a wrong zero, a gain that drifts
  std::string ruled_out_by;                              // empty: it may be the missing effect
};

struct StandChannelFit {
  std::string channel, unit;         // "thrust", "N"
  diagnose::NamedValue coefficient;  // c_t or c_q: of one rotor, SI
  double rms = 0.0, r2 = 0.0, largest = 0.0;
  std::size_t points = 0, runs = 0;
  std::vector<StandCandidate> candidates;  // the one that serves held-out runs best first
  diagnose::DiagnosisVerdict verdict =
      diagnose::DiagnosisVerdict::clean;  // unexplained: real, and best described by something that is none of the rotor's
  std::optional<std::size_t> best;        // index into candidates: named, or first of the class
  std::vector<std::string> aliases;       // ambiguous: what serves held-out runs about as well
  BlockFit with_best;                     // c and the best candidate's coefficients
};

struct StandFileDiagnosis {
  std::string name, motor, propeller;
  diagnose::DiagnosisVerdict verdict = diagnose::DiagnosisVerdict::clean;
  std::vector<StandFault> faults;
  std::vector<std::string> notes;
  std::vector<StandChannelFit> channels;
  std::optional<double> full_speed_per_volt, full_current_per_volt;  // at the largest command: rad/s/V, A/V
};

struct StandDiagnosis {
  std::vector<StandFileDiagnosis> files;
  std::vector<std::string> remarks;  // of the comparison, in words
};

}  // namespace rotorloop::stand
