// The program that the tests of the sandbox start inside it, as `rotorloop close probe` is started by the command:
//   sandbox_prober try PID SECRET…          attempts every way to the secrets
//   sandbox_prober choose FOLDER SECRET…    chooses a sandbox for FOLDER on this machine as a loop does, and prints its record
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "bench/hil/closed_loop/isolation_probe.hpp"
#include "bench/hil/closed_loop/isolation_record.hpp"
#include "bench/hil/closed_loop/program_call.hpp"

int main(int argc, char** argv) {
  using namespace rotorloop::closed_loop;
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < 2) return 2;
  if (words[0] == "try") return probe_command(std::span(words).subspan(1));
  const std::vector<std::filesystem::path> secrets(words.begin() + 2, words.end());
  std::cout << isolation_record(find_sandbox(words[1], {own_program(), {"try"}}, secrets));
  return 0;
}
