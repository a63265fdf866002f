// A rejection in English, for text, pages and `ruled_out_by` of result.json.
#pragma once
#include "bench/sysid/diagnose/rejection.hpp"

namespace rotorloop::diagnose {

std::string words(const Reason& reason);  // empty: nothing speaks against it

}  // namespace rotorloop::diagnose
