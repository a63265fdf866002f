// The text of docs/wire.md, for the tests that hold it to the code.
#pragma once
#include <fstream>
#include <sstream>
#include <string>

namespace rotorloop::protocols {

inline const std::string& document() {
  static const std::string text = [] {
    std::ifstream file(std::string(ROTORLOOP_SOURCE_DIR) + "/docs/wire.md");
    std::stringstream all;
    all << file.rdbuf();
    return all.str();
  }();
  return text;
}

}  // namespace rotorloop::protocols
