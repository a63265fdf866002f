// Answers one request of the adapter's line protocol (README.md of this folder).
#pragma once
#include <string>

namespace rotorloop {

// Never throws: whatever the line is, the answer is one line of JSON without its newline.
std::string adapter_answer(const std::string& line) noexcept;

}  // namespace rotorloop
