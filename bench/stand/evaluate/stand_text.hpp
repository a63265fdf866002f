// A stand's diagnosis for people and for other programs.
#pragma once
#include <string>

#include "bench/stand/evaluate/stand_diagnosis.hpp"

namespace rotorloop::stand {

std::string stand_text(const StandDiagnosis& d);
// {"files": [{"file", "verdict", "faults", "notes", "channels": [{"channel", "coefficient", "verdict", "best", "twins", "candidates"}]}],
// "remarks": []}
std::string stand_json(const StandDiagnosis& d);

}  // namespace rotorloop::stand
