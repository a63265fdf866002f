// What a thrust stand's files say beyond T = c_t ω² and Q = c_q ω²: faults of its sensors first, then one effect at a time, judged by
// runs that had no part in estimating it. Files of one propeller are compared with each other.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "bench/stand/evaluate/stand_checks.hpp"
#include "bench/stand/evaluate/stand_findings.hpp"

namespace rotorloop::stand {

struct StandDiagnosisOptions {
  double least_fall = 0.02;  // of the held-out rms
  double least_z = 3.3;
  std::uint64_t seed = 1;
};

// One file that has been read. Throws Error (data_quality) only when nothing can be fitted and no fault says why.
StandFileDiagnosis diagnose_stand(StandRecord record, const StandDiagnosisOptions& options = {});

// All files through one mapping, compared where they share a propeller (mapping's [file_name]; without it all do).
StandDiagnosis diagnose_stands(const std::vector<std::filesystem::path>& files, const StandMapping& mapping,
                               const StandDiagnosisOptions& options = {});

}  // namespace rotorloop::stand
