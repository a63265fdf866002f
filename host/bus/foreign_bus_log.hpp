// Bus logs of the two programs that most CAN adapters come with: PCAN-View's .trc (PEAK, "PCAN Trace File Format", versions 1.0 to 2.1) and
// Vector's .asc (CANalyzer, "ASCII Logging File Format"). Frames alone: remote frames and error reports are counted, what else stands
// there (statistics, events) is passed over.
#pragma once
#include <string>
#include <string_view>

#include "host/bus/logged_frames.hpp"

namespace rotorloop {

bool looks_like_trc(std::string_view text);
bool looks_like_asc(std::string_view text);

// Both throw Error (exit 2) with file and line for a line that has the shape of a frame and none in it. A last line without its end that
// cannot be read is left out and noted. Times: since 1970 where a .trc says when it began, else since the start of the log.
BusLog parse_trc(std::string_view text, const std::string& name);
BusLog parse_asc(std::string_view text, const std::string& name);

}  // namespace rotorloop
