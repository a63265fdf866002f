// Text files of other programs, whatever encoding they were saved in.
#pragma once
#include <string>

namespace rotorloop {

// The text as UTF-8 without byte order mark. UTF-16 is known by its mark, or by a zero in every other of the first bytes.
std::string as_utf8(std::string bytes);

}  // namespace rotorloop
