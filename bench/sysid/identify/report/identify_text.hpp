// An identification as text for a terminal.
#pragma once
#include <string>

#include "bench/sysid/identify/report/identify_page.hpp"

namespace rotorloop::identify {

std::string identify_text(const IdentifyPage& page);

}  // namespace rotorloop::identify
