// One JSON object a line in, one a line out (README.md).
#include <iostream>
#include <string>

#include "test/adapter/adapter.hpp"

int main() {
  std::ios::sync_with_stdio(false);
  std::string line;
  while (std::getline(std::cin, line)) std::cout << rotorloop::adapter_answer(line) << '\n' << std::flush;
  return 0;
}
